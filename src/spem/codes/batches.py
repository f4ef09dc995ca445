"""Shapes in batches: node features and codes of many shapes, their fields and maps made on a device."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.batch_codes import batch_codes, batch_features
from spem.codes.features import SWEEP_RTOL, kept_nodes, swept_rho
from spem.codes.kinds import KINDS
from spem.codes.model import Model
from spem.codes.part import Part
from spem.codes.settings import Settings
from spem.codes.word_sums import Kept
from spem.errors import MissingExtraError, ParameterError, SpemError
from spem.fields.operator import System, assemble
from spem.fields.solvers.batch import Batch
from spem.fields.solvers.cuda.device import Cuda
from spem.fields.solvers.engine import Backend, require_backend
from spem.fields.solvers.sweep import Sweep
from spem.fields.solvers.team import usable_threads
from spem.shapes.shape import Shape

# The kind of features that is made on a device.
ON_DEVICE = "spem"
# Nodes of a batch, enough to fill any device; one with less memory gets half of them at a time.
BATCH_NODES = 4_000_000
# What a shape takes beside its nodes, in nodes.
_EACH = 256

T = TypeVar("T")
Make = Callable[[Batch, Sequence[Kept]], Sequence[T | SpemError]]


def batches(counts: Sequence[int], max_nodes: int = BATCH_NODES) -> list[range]:
    """Divide shapes into batches, in their order; a shape of more nodes than a batch is one by itself.

    Parameters
    ----------
    counts
        Number of nodes of each shape.
    max_nodes
        Most nodes of a batch; small shapes count for a few hundred.

    Examples
    --------
    >>> batches([3000, 2000, 9000, 10], max_nodes=6000)
    [range(0, 2), range(2, 3), range(3, 4)]
    """
    found, start, held = [], 0, 0
    for index, count in enumerate(counts):
        if index > start and held + count + _EACH > max_nodes:
            found.append(range(start, index))
            start, held = index, 0
        held += count + _EACH
    return [*found, range(start, len(counts))] if len(counts) else []


def require_device(device: Backend) -> None:
    """Raise at once what using a device would, before shapes are read.

    Raises
    ------
    MissingExtraError, ParameterError
        When it is no device, there is none such, or it cannot be used; see
        `spem.fields.solvers.cuda.device.Cuda`.

    Examples
    --------
    >>> from spem.fields.solvers.host import Host
    >>> require_device(Host())
    """
    require_backend(device)
    if isinstance(device, Cuda):
        device.runtime()


def encode_shapes(
    shapes: Sequence[Shape],
    model: Model,
    *,
    device: Backend,
    rtol: float = SWEEP_RTOL,
    max_nodes: int = BATCH_NODES,
) -> NDArray[np.float32]:
    """Make the codes of shapes, in batches.

    Fields, SPEM maps and what is summed of them are made on the device, other kinds of features on the
    processor. What else is in a batch changes nothing, bit by bit.

    Parameters
    ----------
    shapes
        Shapes of the model's dimension.
    model
        The model.
    device
        Where to run, such as ``spem.Cuda()``. A batch that does not fit into its memory is halved.
    rtol
        Largest error of any field at any node.
    max_nodes
        Most nodes of a batch.

    Returns
    -------
    NDArray
        ``(n_shapes, n_code)`` codes, those of `spem.codes.collection.encode_file` but for rounding and nodes
        that are equally near to two words.

    Raises
    ------
    SizeError
        When a single shape does not fit into the memory of the device.
    SpemError
        When a shape has no code.

    Examples
    --------
    >>> from spem.codes.collection import encode_collection
    >>> from spem.fields.solvers.host import Host
    >>> square = Shape.from_mask(np.ones((9, 9)))
    >>> model = encode_collection([square], Settings(features="spem", voxels=None, n_centers=4)).model
    >>> encode_shapes([square], model, device=Host()).shape
    (1, 256)
    """
    for shape in shapes:
        model.require_ndim(shape.ndim, shape.name)
    kinds = [
        list(part_codes(shapes, part, device=device, rtol=rtol, max_nodes=max_nodes)) for part in model.parts
    ]
    joined = [model.join([_value(code) for code in codes]) for codes in zip(*kinds, strict=True)]
    return np.stack(joined) if joined else np.empty((0, model.n_code), np.float32)


def features_of(
    shapes: Sequence[Shape],
    settings: Settings,
    *,
    device: Backend,
    rtol: float = SWEEP_RTOL,
    max_nodes: int = BATCH_NODES,
) -> list[Bands]:
    """Compute the node features of shapes, SPEM maps in batches on a device.

    Parameters
    ----------
    shapes
        Shapes of one dimension.
    settings
        Kinds of features, and what belongs to them.
    device, rtol, max_nodes
        As `encode_shapes` takes them.

    Returns
    -------
    list
        For each shape what `spem.codes.kinds.shape_features` returns.

    Raises
    ------
    SizeError
        When a single shape does not fit into the memory of the device.
    ParameterError
        When the shapes are of several dimensions.
    SpemError
        When a shape has no features.

    Examples
    --------
    >>> from spem.fields.solvers.host import Host
    >>> square = Shape.from_mask(np.ones((9, 9)))
    >>> [[maps]] = features_of([square], Settings(features="spem"), device=Host())
    >>> maps.shape
    (81, 8)
    """
    parts = settings.parts(shapes[0].ndim) if shapes else ()
    kinds = [
        list(part_features(shapes, part, device=device, rtol=rtol, max_nodes=max_nodes)) for part in parts
    ]
    return [sum((_value(bands) for bands in shape), ()) for shape in zip(*kinds, strict=True)]


def part_codes(
    shapes: Sequence[Shape],
    part: Part,
    *,
    device: Backend,
    rtol: float = SWEEP_RTOL,
    max_nodes: int = BATCH_NODES,
) -> Iterator[NDArray[np.float64] | SpemError]:
    """Yield for each shape the code of one kind of features, or why there is none; see `encode_shapes`."""
    if part.settings.features == ON_DEVICE:

        def make(batch: Batch, kept: Sequence[Kept]) -> Sequence[NDArray[np.float64] | SpemError]:
            return batch_codes(batch, part, kept)

        return _swept(shapes, part.settings, Sweep(rtol, device=device), make, max_nodes)
    return (
        _attempt(
            lambda each: part.encode(KINDS[part.settings.features](each, part.settings, None), each.name),
            shape,
        )
        for shape in shapes
    )


def part_features(
    shapes: Sequence[Shape],
    settings: Settings,
    *,
    device: Backend,
    rtol: float = SWEEP_RTOL,
    max_nodes: int = BATCH_NODES,
) -> Iterator[Bands | SpemError]:
    """Yield for each shape its features of one kind, or why there are none; see `features_of`."""
    if settings.features == ON_DEVICE:

        def make(batch: Batch, kept: Sequence[Kept]) -> Sequence[Bands]:
            return batch_features(batch, settings, kept)

        return _swept(shapes, settings, Sweep(rtol, device=device), make, max_nodes)
    return (_attempt(lambda each: KINDS[settings.features](each, settings, None), shape) for shape in shapes)


class _Ready(NamedTuple):
    """A shape that can be swept."""

    system: System
    rho: NDArray[np.float64]
    kept: Kept


def _swept(
    shapes: Sequence[Shape], settings: Settings, sweep: Sweep, make: Make[T], max_nodes: int
) -> Iterator[T | SpemError]:
    """Yield for each shape what is made of its sweep, or why there is nothing."""
    dimensions = sorted({shape.ndim for shape in shapes})
    if len(dimensions) > 1:
        msg = (
            f"shapes of dimensions {', '.join(map(str, dimensions))}; give shapes of one dimension at a time"
        )
        raise ParameterError(msg)
    plan = batches([shape.n_nodes for shape in shapes], max_nodes)

    def prepare(shape: Shape) -> _Ready | SpemError:
        return _attempt(lambda each: _ready(each, settings), shape)

    # The next batch is discretised while this one is on the device.
    with ThreadPoolExecutor(usable_threads()) as pool:
        ahead = [pool.map(prepare, shapes[places.start : places.stop]) for places in plan[:1]]
        for number in range(len(plan)):
            given = list(ahead.pop())
            following = plan[number + 1 : number + 2]
            ahead = [pool.map(prepare, shapes[places.start : places.stop]) for places in following]
            made = iter(_together([each for each in given if isinstance(each, _Ready)], sweep, make))
            yield from (next(made) if isinstance(each, _Ready) else each for each in given)


def _ready(shape: Shape, settings: Settings) -> _Ready:
    """Discretise a shape."""
    kept = np.zeros(shape.n_nodes, bool)
    kept[kept_nodes(shape, drop_boundary=settings.drop_boundary)] = True
    return _Ready(assemble(shape, settings.boundary), swept_rho(shape, settings), kept)


def _together(ready: Sequence[_Ready], sweep: Sweep, make: Make[T]) -> list[T | SpemError]:
    """Sweep shapes in one batch; where that fails, half of them at a time."""
    if not ready:
        return []
    systems, rho, kept = zip(*ready, strict=True)
    try:
        with sweep.batch(systems, rho) as batch:
            made = make(batch, kept)
            return [_missed(batch, index) or each for index, each in enumerate(made)]
    except MissingExtraError:
        raise
    except SpemError as error:
        if len(ready) == 1:
            return [error]
    half = len(ready) // 2
    return _together(ready[:half], sweep, make) + _together(ready[half:], sweep, make)


def _missed(batch: Batch, index: int) -> SpemError | None:
    """Return what a sweep that missed its tolerance has to say."""
    try:
        batch.require(index)
    except SpemError as error:
        return error
    return None


def _attempt(work: Callable[[Shape], T], shape: Shape) -> T | SpemError:
    """Return an error as a value, so that other shapes go on."""
    try:
        return work(shape)
    except SpemError as error:
        return error


def _value(outcome: T | SpemError) -> T:
    """Return what was made, or raise why there is nothing."""
    if isinstance(outcome, SpemError):
        raise outcome
    return outcome
