"""Parts of a shape: the components of a non-negative decomposition of its interaction vectors (4.3)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.measurements import Over
from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of one shape, of its region (4.1) or of its boundary (5.2).

    For the region Y ≈ A S, one column for each node; for the boundary Yᵀ ≈ A S, one column for each source.
    `components` is S and `basis` Aᵀ; those of the estimator, `NonnegativeSparseCoding.components_`, are the
    atoms, Aᵀ. Parts are numbered by size, the largest first. `spem.parts` makes them of the sources of the
    ``"voxel"`` boundary, the paper's, where `spem.sources` and `spem.field` take ``"surface"`` by default.

    Parameters
    ----------
    sources
        The boundary sources.
    rho
        Screening length of the slice.
    over
        What is divided: ``"region"`` or ``"boundary"``.
    components
        ``(k, n_nodes)`` rows of S for the region, ``(k, n_sources)`` for the boundary.
    basis
        ``(k, n_sources)`` columns of A for the region, ``(k, n_nodes)`` for the boundary; of unit norm, or 0.
    node_labels
        ``(n_nodes,)`` part of each node, -1 where no component explains it.
    source_labels
        ``(n_sources,)`` part of each source, -1 where no component explains it.
    intensity
        ``(k,)`` share of each component in the sum of all codes.
    """

    sources: Sources
    rho: float
    over: Over
    components: NDArray[np.float64]
    basis: NDArray[np.float64]
    node_labels: NDArray[np.int32]
    source_labels: NDArray[np.int32]
    intensity: NDArray[np.float64]

    @property
    def shape(self) -> Shape:
        """The shape."""
        return self.sources.system.shape

    @property
    def n_parts(self) -> int:
        """Number of parts, k."""
        return int(self.components.shape[0])

    @property
    def sizes(self) -> NDArray[np.float64]:
        """``(k,)`` share of each part in the nodes; together at most 1."""
        labelled = self.node_labels[self.node_labels >= 0]
        return np.bincount(labelled, minlength=self.n_parts) / self.node_labels.size

    @property
    def unexplained(self) -> float:
        """Share of the nodes that no component explains."""
        return float(np.mean(self.node_labels < 0))

    def relabelled(self, order: Sequence[int] | NDArray[np.integer]) -> Parts:
        """Return the same parts with other numbers.

        Parameters
        ----------
        order
            For each new number the old one, or -1 for a part that this shape does not have. What belongs to
            parts that are not named is labelled -1.

        Raises
        ------
        ParameterError
            When a number is not that of a part, or stands twice.
        """
        old = np.asarray(order, np.int64).reshape(-1)
        named = old[old >= 0]
        if old.size == 0 or old.min() < -1 or old.max() >= self.n_parts or np.unique(named).size < named.size:
            given, most = ", ".join(map(str, old[:20])), self.n_parts - 1
            msg = f"{self.shape.name}: order {given}: expected different parts from 0 to {most}, or -1"
            raise ParameterError(msg)
        number = np.full(self.n_parts + 1, -1, np.int32)  # the last entry serves label -1
        number[named] = np.flatnonzero(old >= 0)
        kept = old[:, None] >= 0
        return replace(
            self,
            components=np.where(kept, self.components[old], 0.0),
            basis=np.where(kept, self.basis[old], 0.0),
            node_labels=number[self.node_labels],
            source_labels=number[self.source_labels],
            intensity=np.where(kept[:, 0], self.intensity[old], 0.0),
        )

    def without_weak(self, threshold: float = 0.1) -> Parts:
        """Drop weak parts (Fig. 12); what they held goes to the strongest part left, or to none.

        Over the boundary sources go by their components and nodes by the basis: the walks by which
        `boundary_parts` gives nodes to parts take the fields, which are not kept.

        Parameters
        ----------
        threshold
            Least intensity of a part that is kept, in units of the mean intensity 1/k.

        Raises
        ------
        ParameterError
            When no part is that strong.
        """
        weak = self.intensity * self.n_parts < threshold
        if not weak.any():
            return self
        if weak.all():
            strongest = self.intensity.max() * self.n_parts
            msg = f"threshold={threshold:g}: every part is weaker; expected at most {strongest:.3g}"
            raise ParameterError(msg)
        samples = strongest_part(np.where(weak[:, None], 0.0, self.components))
        if self.over == "region":
            nodes = _given_away(self.node_labels, weak, samples)
            beside = touched_part(self.sources, nodes, self.n_parts)
            sources = _given_away(self.source_labels, weak, beside)
        else:
            sources = _given_away(self.source_labels, weak, samples)
            strength = np.where(weak, 0.0, np.linalg.norm(self.components, axis=1))
            nodes = _given_away(self.node_labels, weak, strongest_part(self.basis * strength[:, None]))
        filled = replace(self, node_labels=nodes, source_labels=sources)
        return filled.relabelled(np.flatnonzero(~weak))

    def to_xarray(self) -> xarray.Dataset:
        """Label the arrays: dims ``part``, ``node`` and ``source``, coordinates of nodes and sources."""
        import xarray

        sample, feature = ("node", "source") if self.over == "region" else ("source", "node")
        coords = {f"x{a}": ("node", column) for a, column in enumerate(self.shape.points.T)}
        coords |= {f"source_x{a}": ("source", column) for a, column in enumerate(self.sources.position.T)}
        arrays = {
            "components": (("part", sample), self.components),
            "basis": (("part", feature), self.basis),
            "node_labels": ("node", self.node_labels),
            "source_labels": ("source", self.source_labels),
            "intensity": ("part", self.intensity),
            "size": ("part", self.sizes),
        }
        attributes = {"name": self.shape.name, "rho": self.rho, "over": self.over}
        return xarray.Dataset(arrays, coords | {"part": np.arange(self.n_parts)}, attributes)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the parts to an npz file (see `spem.decomposition.parts_files`)."""
        from spem.decomposition.parts_files import save_parts

        save_parts(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Parts:
        """Read parts that `save` wrote."""
        from spem.decomposition.parts_files import load_parts

        return load_parts(path)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{100 * size:.0f}" for size in self.sizes)
        lost = f", {100 * self.unexplained:.0f} % of the nodes in none" if self.unexplained else ""
        what = f"{self.n_parts} parts of its {self.over}, rho {self.rho:g}"
        return f"Parts({self.shape.name!r}, {what}, sizes {sizes} %{lost})"


def strongest_part(contribution: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the component of most contribution to each column of ``(k, n)``, -1 where none has any."""
    strongest = contribution.argmax(axis=0)
    return np.where(contribution.max(axis=0) > 0, strongest, -1).astype(np.int32)


def touched_part(sources: Sources, node_labels: NDArray[np.int32], n_parts: int) -> NDArray[np.int32]:
    """Return the part that most of each source's boundary edges lead to, -1 where it touches none.

    Parameters
    ----------
    sources
        The sources.
    node_labels
        ``(n_nodes,)`` part of each node, or -1.
    n_parts
        Number of parts.
    """
    touched = np.zeros((n_parts, sources.n_sources))
    label, source = node_labels[sources.system.domain.boundary_edges[0]], sources.edge_source
    used = (label >= 0) & (source >= 0)
    np.add.at(touched, (label[used], source[used]), 1.0)
    return strongest_part(touched)


def _given_away(
    labels: NDArray[np.int32], gone: NDArray[np.bool_], others: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Labels, with other ones where the part is gone."""
    return np.where(np.append(gone, False)[labels], others, labels)  # the last entry serves label -1
