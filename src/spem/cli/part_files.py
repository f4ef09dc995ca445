"""Where parts are written: an array file, a picture, a page and a mesh, or folders of files."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from spem.cli.output import PLOT_SUFFIXES, check_folder, check_target, write_figure
from spem.cli.results import NPZ, check_drawable, spare_sources
from spem.errors import ParameterError, ShapeError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from spem.decomposition.parts import Parts
    from spem.shapes.shape import Shape

PAGES, MESHES = (".html", ".htm"), (".ply",)
# Line of the header by which a PLY file with parts is known, and the array of an npz file.
_PLY_MARK, _NPZ_MARK = b"comment label: part of the vertex", "source_labels.npy"


@dataclass(frozen=True)
class PartFiles:
    """Files that parts are written to.

    Parameters
    ----------
    sources
        The files that the shapes are read from.
    output, mesh
        Array file and mesh; folders of them, named by the shapes, where there are several.
    plot, page
        Picture and page of all shapes.
    """

    sources: tuple[str, ...]
    output: Path | None
    plot: Path | None
    page: Path | None
    mesh: Path | None

    def check(self) -> None:
        """Make sure, before a shape is read, that what was asked for can be written.

        Raises
        ------
        ParameterError
            When it cannot, or it would replace what is read or is not of parts.
        """
        if len(self.sources) > 1:
            self._check_names()
        if self.plot is not None:
            spare_sources(check_target(self.plot, PLOT_SUFFIXES), self.sources)
        if self.page is not None:
            spare_sources(check_target(self.page, PAGES), self.sources)
        for place, suffixes in ((self.output, NPZ), (self.mesh, MESHES)):
            if place is not None:
                self._check_place(place, suffixes)

    def check_dimensions(self, shapes: Sequence[Shape]) -> None:
        """Refuse pictures, pages and meshes of shapes that have none, before anything is solved.

        Raises
        ------
        ShapeError
            When a shape has too many dimensions for a picture, or not three for a page or a mesh.
        """
        for shape in shapes:
            check_drawable(shape, self.plot)
            for option, target in (("--page", self.page), ("--mesh", self.mesh)):
                if target is not None and shape.ndim != 3:
                    dimensions = f"{shape.ndim} dimension{'' if shape.ndim == 1 else 's'}"
                    msg = f"{shape.name}: has {dimensions}; {option} takes shapes of 3, leave it out"
                    raise ShapeError(msg)

    def write(self, divided: Sequence[Parts]) -> None:
        """Write all files that were asked for, each all of a piece."""
        for parts, target in zip(divided, self._each(self.output, NPZ), strict=False):
            parts.save(target)
        if not (self.plot or self.page or self.mesh):
            return
        meshes = [_mesh(source, parts.shape) for source, parts in zip(self.sources, divided, strict=True)]
        for parts, mesh, target in zip(divided, meshes, self._each(self.mesh, MESHES), strict=False):
            from spem.plots.ply import write_parts_mesh

            write_parts_mesh(target, parts.shape, parts.node_labels, mesh=mesh)
        if self.plot is not None:
            from spem.plots.parts import figure_parts

            write_figure(self.plot, figure_parts(divided, meshes=meshes))
        if self.page is not None:
            from spem.plots.parts_page import write_parts_page

            write_parts_page(self.page, divided, title=f"Parts of {_title(divided)}", meshes=meshes)

    def written(self) -> list[Path]:
        """Return the files, in the order in which they were written."""
        each = [*self._each(self.output, NPZ), *self._each(self.mesh, MESHES)]
        return each + [target for target in (self.plot, self.page) if target is not None]

    def _each(self, place: Path | None, suffixes: tuple[str, ...]) -> list[Path]:
        """Return the file of each shape; none where none is wanted."""
        if place is None:
            return []
        if len(self.sources) == 1:
            return [place]
        return [place / f"{_name(source)}{suffixes[0]}" for source in self.sources]

    def _check_names(self) -> None:
        """Refuse shapes of one name, which would be written to one file or not be told apart."""
        seen: dict[str, str] = {}
        for source in self.sources:
            name = _name(source)
            if name in seen:
                msg = f"{seen[name]} and {source}: both are named {name}; rename one of them"
                raise ParameterError(msg)
            seen[name] = source

    def _check_place(self, place: Path, suffixes: tuple[str, ...]) -> None:
        """Make sure that the files of one kind can be written."""
        if len(self.sources) == 1:
            spare_sources(check_target(place, suffixes), self.sources)
            return
        if place.suffix.lower() in suffixes and not place.is_dir():
            msg = f"{place}: {len(self.sources)} shapes are written to a folder, a file each; give a folder"
            raise ParameterError(msg)
        check_folder(place)
        for target in self._each(place, suffixes):
            spare_sources(check_target(target), self.sources)
            if target.exists() and not _is_of_parts(target):
                msg = f"{target}: is there already and not parts that spem wrote; write to another folder"
                raise ParameterError(msg)


def _name(source: str) -> str:
    """Return the name of the shape of a file."""
    from spem.codes.sources import source_name

    return source_name(Path(source))


def _title(divided: Sequence[Parts]) -> str:
    """Return what a page is about."""
    return divided[0].shape.name if len(divided) == 1 else f"{len(divided)} shapes"


def _mesh(source: str, shape: Shape) -> tuple[NDArray[np.float64], NDArray[np.int64]] | None:
    """Return vertices and faces of a file that is a mesh."""
    from spem.shapes.kinds import MESH_SUFFIXES, has_suffix

    if shape.ndim != 3 or not has_suffix(Path(source), MESH_SUFFIXES):
        return None
    from spem.shapes.mesh_files import load_mesh

    return load_mesh(Path(source))


def _is_of_parts(path: Path) -> bool:
    """Say whether a file is one that parts were written to."""
    try:
        if path.suffix.lower() in NPZ:
            with zipfile.ZipFile(path) as file:
                return _NPZ_MARK in file.namelist()
        with path.open("rb") as file:
            return _PLY_MARK in file.read(200)
    except (OSError, zipfile.BadZipFile):
        return False
