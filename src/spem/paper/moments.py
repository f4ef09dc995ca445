"""The moment experiment of 5.4: silhouettes of one inner radius, their maps, and curves of accuracy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from spem.api.fields import sweep
from spem.codes.moments import N_MOMENTS, Compression, NodalMoments, hu_moments
from spem.embedding.maps import Maps, compute_maps
from spem.embedding.nodal import Cut
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import Boundary
from spem.fields.rho import DEFAULT_COUNT, Scheme, sample_rho
from spem.paper.data import INNER_RADIUS, Collection
from spem.retrieval.classification import Classification, classify_vectors, linear_svm
from spem.shapes.read import read
from spem.shapes.rescale import to_inner_distance
from spem.shapes.shape import Shape

N_MAPS = 9
# Two domains of seven moments.
PER_MAP = 2 * N_MOMENTS
# ρ in pixels. Figure 2 has 2 to 30; readings of 5.4 that begin at 1 are cut from the same hyperfields.
RHO = (2.0, 30.0)
_WIDEST = (1.0, 30.0)


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What 5.4 leaves open.

    Parameters
    ----------
    name
        For tables.
    compression
        What is made of moments of very different size: see `spem.codes.moments.hu_moments`.
    unit, at
        How projections are scaled and where they are cut: see `spem.codes.moments.NodalMoments`.
    rho, scheme
        Range of ρ in pixels, and how it is sampled.
    centred
        Whether the mean field is subtracted before the PCA.
    boundary
        Where the boundary lies.
    penalty
        Of the support vector machine: see `spem.retrieval.classification.linear_svm`.
    """

    name: str
    compression: Compression = "log"
    unit: bool = True
    at: Cut = "means"
    rho: tuple[float, float] = RHO
    scheme: Scheme = "linear"
    centred: bool = False
    boundary: Boundary = "surface"
    penalty: float = 1.0

    def moments(self, fields: Sequence[Hyperfield]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the moments of silhouettes ``(n_shapes, 7)`` and of their nodal domains ``(n_shapes, 126)``.

        Thresholds are learnt from these shapes.
        """
        binary = np.stack([hu_moments(field.shape, compression=self.compression) for field in fields])
        maps = maps_over(fields, self.rho, self.scheme, centred=self.centred)
        coder = NodalMoments(unit=self.unit, at=self.at, compression=self.compression, random_state=0)
        return binary, coder.fit_transform(maps)


# The first is the one of the figure; the others change what their names say.
READINGS = (
    Reading(name="as in the figure"),
    Reading(name="centred maps", centred=True),
    Reading(name="projections not scaled", unit=False),
    Reading(name="cut midway between clusters", at="midway"),
    Reading(name="ρ from 1 to 20, logarithmic", rho=(1.0, 20.0), scheme="log"),
    Reading(name="v = 1 on pixels", boundary="voxel"),
    Reading(name="arsinh(h / 1e-8)", compression="arsinh"),
    Reading(name="penalty 10 in place of 1", penalty=10.0),
    Reading(name="moments as they are", compression="none"),
    Reading(name="moments as they are, penalty 0.01", compression="none", penalty=0.01),
    Reading(
        name="moments as they are, cut midway, ρ from 1 to 20, logarithmic",
        compression="none",
        at="midway",
        rho=(1.0, 20.0),
        scheme="log",
    ),
)


@dataclass(frozen=True, eq=False)
class Curves:
    """Accuracies of Fig. 17.

    Parameters
    ----------
    binary
        Of the moments of the silhouettes themselves.
    single
        Of those of the nodal domains of each projection.
    stacked
        Of those of all projections up to each.
    """

    binary: Classification
    single: tuple[Classification, ...]
    stacked: tuple[Classification, ...]

    def to_json(self) -> Mapping[str, Any]:
        """Return means and standard deviations in percent."""
        return {
            "binary": (self.binary.mean, self.binary.deviation),
            **{
                name: [(each.mean, each.deviation) for each in found]
                for name, found in (("single", self.single), ("stacked", self.stacked))
            },
        }

    def some(self) -> list[float]:
        """Return the means that `score_readings` gives."""
        chosen = (self.binary, self.single[0], self.single[-1], self.stacked[2], self.stacked[-1])
        return [each.mean for each in chosen]


def hyperfields(items: Iterable[Path | Shape], boundary: Boundary = "surface") -> list[Hyperfield]:
    """Sweep silhouettes, each scaled to an inner radius of 20 pixels.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> cat = Data().silhouettes("cat", 1).shapes[0]
    >>> [field.rho.size for field in hyperfields([cat])]
    [64]
    """
    return [_sweep(_scaled(item), boundary) for item in items]


def maps_over(
    fields: Iterable[Hyperfield],
    rho: tuple[float, float] = RHO,
    scheme: Scheme = "linear",
    *,
    centred: bool = False,
) -> list[Maps]:
    """Return the first nine maps over a range of ρ, in pixels.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> maps = maps_over(hyperfields(Data().silhouettes("cat", 1).shapes))
    >>> maps[0].basis.shape
    (64, 9)
    """
    found = []
    for field in fields:
        low, high = (end * field.shape.spacing[0] for end in rho)
        samples = sample_rho(field.shape.size, low, high, DEFAULT_COUNT, scheme)
        found.append(compute_maps(replace(field, rho=samples), N_MAPS, centred=centred))
    return found


def curves(
    binary: NDArray[np.float64],
    domains: NDArray[np.float64],
    labels: Sequence[str],
    *,
    n_train: int,
    repeats: int,
) -> Curves:
    """Classify by the moments of silhouettes, of single projections, and of the first few together.

    Parameters
    ----------
    binary
        ``(n_shapes, 7)`` moments of the silhouettes.
    domains
        ``(n_shapes, n_maps * 14)`` moments of nodal domains, map by map.
    labels
        Class of each shape.
    n_train, repeats
        Training shapes of each class, and number of splits; all vectors are tested on the same ones.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> found = curves(rng.random((8, 7)), rng.random((8, 28)), "aaaabbbb", n_train=2, repeats=2)
    >>> len(found.single), len(found.stacked)
    (2, 2)
    """
    n_maps = domains.shape[1] // PER_MAP
    sets = [
        binary,
        *(domains[:, j * PER_MAP : (j + 1) * PER_MAP] for j in range(n_maps)),
        *(domains[:, : (j + 1) * PER_MAP] for j in range(n_maps)),
    ]
    found = Parallel(n_jobs=-1 if repeats * len(labels) > 10_000 else 1)(
        delayed(classify_vectors)(np.ascontiguousarray(each), labels, n_train=n_train, repeats=repeats)
        for each in sets
    )
    return Curves(found[0], tuple(found[1 : n_maps + 1]), tuple(found[n_maps + 1 :]))


def score_readings(
    collection: Collection,
    fields: Sequence[Hyperfield],
    chosen: Sequence[Reading],
    *,
    n_train: int,
    repeats: int,
) -> dict[str, list[float]]:
    """Return the accuracy of some vectors in each reading, in percent.

    Parameters
    ----------
    collection
        Silhouettes and their classes.
    fields
        Their hyperfields with the surface boundary.
    chosen
        The readings.
    n_train, repeats
        Training shapes of each class, and number of splits.

    Returns
    -------
    dict
        Name of the reading → accuracy by silhouettes, the first and the last projection alone, the first
        three and all nine together.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> pairs = Data().collection("tari1000", ndim=2, per_class=2, voxels=600)
    >>> few = Collection("few", pairs.items[:4], pairs.labels[:4], "", False)
    >>> found = score_readings(few, hyperfields(few.items), READINGS[:1], n_train=1, repeats=1)
    >>> [len(values) for values in found.values()]
    [5]
    """
    rows = {}
    for reading in chosen:
        own = fields if reading.boundary == "surface" else hyperfields(collection.items, reading.boundary)
        binary, domains = reading.moments(own)
        several = (binary, domains[:, :PER_MAP], domains[:, -PER_MAP:], domains[:, : 3 * PER_MAP], domains)
        machine = linear_svm(penalty=reading.penalty)
        rows[reading.name] = [
            classify_vectors(
                each, collection.labels, n_train=n_train, repeats=repeats, classifier=machine
            ).mean
            for each in several
        ]
    return rows


def _scaled(item: Path | Shape) -> Shape:
    """Return a silhouette with a largest distance to the boundary of 20 pixels, as 5.4 has them."""
    if isinstance(item, Shape):
        return to_inner_distance(item, INNER_RADIUS)
    return read(item, inner_radius=INNER_RADIUS)


def _sweep(shape: Shape, boundary: Boundary) -> Hyperfield:
    """Sweep the widest range of ρ that is read from, in pixels."""
    low, high = (end * shape.spacing[0] for end in _WIDEST)
    rho = sample_rho(shape.size, low, high, DEFAULT_COUNT, "log")
    return sweep(shape, rho, boundary=boundary)
