"""The shapes of the experiments: real ones where a folder holds them, creatures otherwise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from spem.errors import ParameterError
from spem.retrieval.labels import read_labels
from spem.shapes.creatures import collection as creature_collection
from spem.shapes.creatures import creature
from spem.shapes.read import read
from spem.shapes.rescale import to_inner_distance
from spem.shapes.shape import Shape

Silhouette = Literal["hand", "cat", "human"]

# Class of the "1000-shape" database, and the creature that stands in for it.
_SILHOUETTES: dict[str, tuple[str, str]] = {
    "hand": ("obj11", "hand"),
    "cat": ("obj9", "dog"),
    "human": ("obj1", "human"),
}
# The paper scales silhouettes to a largest distance of 20 pixels to the boundary (5.4).
INNER_RADIUS = 20.0
# Exact duplicates in the copy of the "1000-shape" database: class and the two indices.
DUPLICATES = (
    "6 1=4 2=6, 8 1=4 3=6, 12 5=6, 13 2=6, 14 2=4, 16 2=5, 19 3=5, 22 2=6, 23 1=3, 24 4=5, "
    "25 1=5 2=6, 26 1=3, 27 2=5, 28 1=3, 30 1=6 2=4"
)


@dataclass(frozen=True)
class Shapes:
    """Shapes and where they come from.

    Parameters
    ----------
    shapes
        The shapes.
    source
        One sentence for the page: what they are and how they differ from the paper's.
    real
        Whether they are real ones.
    """

    shapes: tuple[Shape, ...]
    source: str
    real: bool


@dataclass(frozen=True)
class Collection:
    """Files or shapes with a class each.

    Parameters
    ----------
    name
        Name of the collection.
    items
        A path, or a shape, each.
    labels
        A class each.
    source
        One sentence for the page.
    real
        Whether it is the collection asked for, not creatures in its place.
    """

    name: str
    items: tuple[Path | Shape, ...]
    labels: tuple[str, ...]
    source: str
    real: bool


@dataclass(frozen=True)
class Data:
    """Where real shapes are, and how much time an experiment may take.

    Parameters
    ----------
    folder
        Folder that holds the collections, each in a folder of its own; None to work on shapes
        made here.
    quick
        Whether to work in a reduced size: seconds in place of minutes.

    Examples
    --------
    >>> Data().silhouettes("hand", 1).real
    False
    """

    folder: Path | None = None
    quick: bool = False

    def find(self, name: str) -> Path | None:
        """Return the folder of a collection, or None where it is absent."""
        if self.folder is None or not (self.folder / name).is_dir():
            return None
        return self.folder / name

    @property
    def present(self) -> tuple[str, ...]:
        """Names of the collections that the folder holds."""
        return tuple(name for name in _ORIGINS if self.find(name) is not None)

    def absent(self, name: str) -> str:
        """Say that a collection is absent and how to get it, for the note of a claim."""
        where = "no folder of shapes was given" if self.folder is None else f"{self.folder} has no {name}"
        return f"{where}; {_ORIGINS[name]}: put it into DIR/{name} and give --data DIR"

    def silhouettes(
        self, kind: Silhouette, count: int, *, inner_radius: float | None = INNER_RADIUS
    ) -> Shapes:
        """Return silhouettes of one kind, scaled to an inner radius in pixels; lengths are pixels.

        Raises
        ------
        ParameterError
            If more are wanted than there are.
        """
        label, stand_in = _SILHOUETTES[kind]
        folder = self.find("tari1000")
        if folder is None:
            made = [
                creature(stand_in, rng=np.random.default_rng(seed), voxels=6000, name=f"{stand_in} {seed}")
                for seed in range(1, count + 1)
            ]
            scaled = (to_inner_distance(shape, inner_radius or INNER_RADIUS) for shape in made)
            source = f"Silhouettes made here (creature {stand_in!r}) in place of the paper's."
            return Shapes(tuple(_in_pixels(shape) for shape in scaled), source, False)
        paths = sorted(folder.glob(f"{label}_*.png"), key=lambda path: int(path.stem.rpartition("_")[2]))
        if count > len(paths):
            msg = f"{count} silhouettes of a {kind} were asked for; tari1000 has {len(paths)}"
            raise ParameterError(msg)
        shapes = tuple(_in_pixels(read(path, inner_radius=inner_radius)) for path in paths[:count])
        return Shapes(
            shapes,
            f"The nearest real silhouettes: class {label.removeprefix('obj')} ({kind}) of the 1000-shape "
            "database, in a pose-normalised copy of 128 × 128 pixels.",
            True,
        )

    def collection(
        self, name: str, *, ndim: int, per_class: int | None = None, voxels: int | None = None
    ) -> Collection:
        """Return a labelled collection, or creatures where it is absent.

        Parameters
        ----------
        name
            Its folder, which has a file ``labels.csv``.
        ndim
            Dimension of the creatures that stand in for it.
        per_class
            Number of shapes of each class; all of them by default, six creatures.
        voxels
            Number of nodes of a creature.
        """
        folder = self.find(name)
        if folder is None:
            rng = np.random.default_rng(0)
            pairs = creature_collection(n_per_class=per_class or 6, ndim=ndim, voxels=voxels, rng=rng)
            shapes, labels = zip(*pairs, strict=True)
            return Collection("creatures", shapes, labels, f"Creatures made here in place of {name}.", False)
        rows = read_labels(folder / "labels.csv")
        taken: dict[str, int] = {}
        chosen: list[tuple[Path, str]] = []
        for file, label in rows.items():
            taken[label] = taken.get(label, 0) + 1
            if per_class is None or taken[label] <= per_class:
                chosen.append((folder / file, label))
        return Collection(
            name, tuple(p for p, _ in chosen), tuple(label for _, label in chosen), _SOURCES[name], True
        )


def duplicate_names() -> tuple[str, ...]:
    """Return the files of tari1000 that repeat an earlier one.

    Examples
    --------
    >>> len(duplicate_names()), duplicate_names()[0]
    (19, 'obj6_4.png')
    """
    names = []
    for entry in DUPLICATES.split(", "):
        label, *pairs = entry.split()
        names += [f"obj{label}_{pair.partition('=')[2]}.png" for pair in pairs]
    return tuple(names)


def _in_pixels(shape: Shape) -> Shape:
    """Return the shape with the spacing of an image: lengths become pixels."""
    return replace(shape, spacing=(1.0,) * shape.ndim, origin=(0.0,) * shape.ndim)


_SOURCES = {
    "shrec11": "SHREC'11 non-rigid watertight meshes in the simplified copy of 500 faces a mesh; the paper "
    "used the originals of about 20,000.",
    "tari1000": "The 1000-shape database in a pose-normalised copy of 128 × 128 pixels.",
    "kimia216": "Kimia's 216 silhouettes.",
    "kimia99": "Kimia's 99 silhouettes.",
}
_ORIGINS = {
    "shrec11": "SHREC'11 Non-rigid 3D Watertight Meshes (Lian et al. 2011) is free for research",
    "tari1000": "the 1000-shape database (Aslan et al. 2008) is free for research",
    "kimia216": "Kimia's 216 silhouettes (Sebastian et al. 2004) are free for research",
    "kimia99": "Kimia's 99 silhouettes (Sebastian et al. 2004) are free for research",
    "horse_poses": "the horse in ten poses (Sumner and Popović 2004) is free for research",
    "tosca_cats": "the cats of TOSCA (Bronstein et al. 2008) are free for academic use",
}
