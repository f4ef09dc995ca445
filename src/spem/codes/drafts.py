"""Shapes that are read, and not swept yet: what workers leave for the process that has a device."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.batches import ON_DEVICE, part_codes, part_features
from spem.codes.container import read_container, write_container
from spem.codes.kinds import kind_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, read_shapes, source_path
from spem.codes.work import Entry, Work
from spem.codes.workers import one_line
from spem.errors import SpemError
from spem.fields.solvers.engine import Backend
from spem.shapes.packing import pack_shape, unpack_shape
from spem.shapes.shape import Shape

_KIND = "draft"
# Ends as work does, with which it is cleared.
_SUFFIX = ".draft.work"


@dataclass(frozen=True, eq=False)
class Draft:
    """What one shape of a source came to without a device.

    Parameters
    ----------
    suffix
        What tells the shape from others of its source.
    reason
        Why there is nothing, or empty.
    kinds
        Features of each kind; None for the one that a device makes.
    ndim, volume
        Of the shape, as `Entry` has them.
    shape
        The shape, where a device is to make features of it.
    """

    suffix: str
    reason: str = ""
    kinds: tuple[Bands | None, ...] = ()
    ndim: int = 0
    volume: float = math.nan
    shape: Shape | None = None


def draft_shapes(
    source: Source, settings: Settings, model: Model | None, threads: int | None = None
) -> list[Draft]:
    """Read the shapes of a source, and compute what features of them no device makes.

    Parameters
    ----------
    source
        A file or a shape.
    settings
        How it is read, and kinds of features.
    model
        What codes are to be made with, if there is one yet.
    threads
        Threads for a large shape; the outcome does not depend on it.

    Raises
    ------
    SpemError
        When the source as a whole, or its only shape, gives nothing.

    Examples
    --------
    >>> [draft] = draft_shapes(Shape.from_mask(np.ones((9, 9))), Settings(features="spem", voxels=None), None)
    >>> draft.shape.n_nodes, draft.kinds
    (81, (None,))
    """
    drafts = []
    for suffix, shape in read_shapes(source, settings):
        try:
            if isinstance(shape, SpemError):
                raise shape
            if model is not None:
                model.require_ndim(shape.ndim, source_path(source) + suffix)
            kinds = kind_features(shape, settings, threads, later=(ON_DEVICE,))
        except SpemError as error:
            if not suffix:
                raise
            drafts.append(Draft(suffix, one_line(error)))
            continue
        waits = shape if None in kinds else None
        drafts.append(Draft(suffix, "", kinds, shape.ndim, shape.volume, waits))
    return drafts


def finish_drafts(
    drafts: Sequence[Draft], settings: Settings, model: Model | None, device: Backend
) -> list[Entry]:
    """Make on a device what drafts lack, in batches, and entries of them.

    Parameters
    ----------
    drafts
        Drafts of shapes, of any sources.
    settings
        Settings of the features.
    model
        What codes are made with; entries have features where there is none.
    device
        Where to run.

    Returns
    -------
    list
        For each draft what is to be kept; one that gives nothing has the reason.
    """
    made: dict[int, Any] = {}
    waiting = {place: draft.shape for place, draft in enumerate(drafts) if draft.shape is not None}
    for ndim in sorted({shape.ndim for shape in waiting.values()}):
        chosen = {place: shape for place, shape in waiting.items() if shape.ndim == ndim}
        made |= zip(chosen, _on_device(list(chosen.values()), settings, model, device), strict=True)
    return [entry_of(draft, model, made.get(place)) for place, draft in enumerate(drafts)]


def _on_device(
    shapes: Sequence[Shape], settings: Settings, model: Model | None, device: Backend
) -> Iterator[Bands | NDArray[np.float64] | SpemError]:
    """Yield for each shape its maps, or the code of them where there is a model, or why there are none."""
    if model is None:
        [mine] = (part for part in settings.parts(shapes[0].ndim) if part.features == ON_DEVICE)
        return part_features(shapes, mine, device=device)
    [learnt] = (part for part in model.parts if part.settings.features == ON_DEVICE)
    return part_codes(shapes, learnt, device=device)


def entry_of(draft: Draft, model: Model | None, made: Any = None) -> Entry:
    """Put features or a code together of what a draft has and what was `made` on a device, if anything."""
    if draft.reason or isinstance(made, SpemError):
        return Entry(draft.suffix, draft.reason or one_line(made))
    name = "shape" if draft.shape is None else draft.shape.name
    entry = Entry(draft.suffix, ndim=draft.ndim, volume=draft.volume)
    if model is None:
        features = tuple(band for kind in draft.kinds for band in (made if kind is None else kind))
        return replace(entry, arrays=features)
    try:
        codes = [
            made if bands is None else part.encode(bands, name, model.digest)
            for bands, part in zip(draft.kinds, model.parts, strict=True)
        ]
    except SpemError as error:
        return Entry(draft.suffix, one_line(error))
    return replace(entry, arrays=(model.join(codes),))


def save_drafts(work: Work, key: str, drafts: Iterable[Draft]) -> None:
    """Write the drafts of a source to a work folder, in one step."""
    header: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    volumes = []
    for i, draft in enumerate(drafts):
        counts = [None if bands is None else len(bands) for bands in draft.kinds]
        about = {"suffix": draft.suffix, "reason": draft.reason, "ndim": draft.ndim, "kinds": counts}
        for j, bands in enumerate(draft.kinds):
            arrays |= {f"{i}.{j}.{k}": band for k, band in enumerate(bands or ())}
        if draft.shape is not None:
            packed, about["shape"] = pack_shape(draft.shape)
            arrays |= {f"{i}.{name}": array for name, array in packed.items()}
        header.append(about)
        volumes.append(draft.volume)
    write_container(
        work.folder / f"{key}{_SUFFIX}", _KIND, {"shapes": header}, arrays | {"volumes": np.array(volumes)}
    )


def load_drafts(work: Work, key: str) -> list[Draft]:
    """Read the drafts of a source from a work folder.

    Raises
    ------
    ReadError
        When they are not there, or damaged.
    """
    header, arrays = read_container(work.folder / f"{key}{_SUFFIX}", _KIND)
    drafts = []
    for i, (about, volume) in enumerate(zip(header["shapes"], arrays["volumes"].tolist(), strict=True)):
        kinds = tuple(
            None if count is None else tuple(arrays[f"{i}.{j}.{k}"] for k in range(count))
            for j, count in enumerate(about["kinds"])
        )
        mine = {
            name.removeprefix(f"{i}."): array for name, array in arrays.items() if name.startswith(f"{i}.")
        }
        shape = unpack_shape(mine, about["shape"]) if "shape" in about else None
        drafts.append(Draft(about["suffix"], about["reason"], kinds, about["ndim"], volume, shape))
    return drafts


def drop_drafts(work: Work, key: str) -> None:
    """Delete the drafts of a source, once its entries are saved."""
    (work.folder / f"{key}{_SUFFIX}").unlink(missing_ok=True)
