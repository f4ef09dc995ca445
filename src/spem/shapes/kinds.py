"""Kinds of files, told by suffix and, for a TIFF, by its pages; no library is loaded to list them."""

from __future__ import annotations

from pathlib import Path

IMAGE_SUFFIXES = (
    ".png", ".gif", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pbm", ".pnm",
)  # fmt: skip
TIFF_SUFFIXES = (".tif", ".tiff")
VOLUME_SUFFIXES = (".npy", ".npz", ".nii", ".nii.gz")
MESH_SUFFIXES = (".obj", ".off", ".ply", ".stl", ".glb")
SUFFIXES = (*IMAGE_SUFFIXES, *VOLUME_SUFFIXES, *MESH_SUFFIXES)


def has_suffix(path: Path, suffixes: tuple[str, ...]) -> bool:
    """Tell whether a file's name ends in one of the suffixes, in either case.

    Examples
    --------
    >>> has_suffix(Path("tooth.NII.gz"), VOLUME_SUFFIXES)
    True
    """
    return path.name.lower().endswith(suffixes)


def is_volume(path: Path) -> bool:
    """Tell a volume from an image or a mesh, which for a TIFF depends on its pages.

    Examples
    --------
    >>> is_volume(Path("tooth.nii.gz")), is_volume(Path("hand.png"))
    (True, False)
    """
    if has_suffix(path, TIFF_SUFFIXES) and path.is_file():
        from spem.shapes.stacks import tiff_pages

        return tiff_pages(path) > 1
    return has_suffix(path, VOLUME_SUFFIXES)


def kind_of(path: Path) -> str:
    """Return by suffix what a file is, with its article; nothing for other kinds of files.

    Examples
    --------
    >>> kind_of(Path("hand.png")), kind_of(Path("shapes.spem"))
    ('an image', '')
    """
    kinds = {"an image": IMAGE_SUFFIXES, "a volume": VOLUME_SUFFIXES, "a mesh": MESH_SUFFIXES}
    return next((kind for kind, suffixes in kinds.items() if has_suffix(path, suffixes)), "")
