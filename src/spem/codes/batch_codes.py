"""Maps and codes of a batch of swept shapes, made on the device that holds their fields.

`spem.codes.vlad` says what is computed; here nodes are rows of tables on a device, and only sums over the
nodes of each word leave it. They do not depend on what else is in the batch, bit by bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.features import band_rho, node_features
from spem.codes.part import Part
from spem.codes.settings import Settings
from spem.codes.vocabulary import Residuals
from spem.codes.word_sums import Kept, Rows, WordSums
from spem.embedding.maps import principal_components
from spem.errors import ParameterError, SizeError
from spem.fields.solvers.batch import Batch
from spem.fields.solvers.cuda.engine import CudaEngine
from spem.fields.solvers.cuda.runtime import Array, Runtime


def project_maps(batch: Batch, engine: CudaEngine, settings: Settings, band: int) -> Array:
    """Compute the maps of one band of all shapes of a batch.

    Parameters
    ----------
    batch
        Shapes swept over the ρ of all bands.
    engine
        The engine of the batch.
    settings
        Settings of SPEM maps.
    band
        Which range of ρ.

    Returns
    -------
    Array
        ``(n_rows, n_maps)`` float32 on the device.
    """
    mixes = [_mix(batch, index, settings, band) for index in range(len(batch))]
    return engine.project(*(np.stack(each) for each in zip(*mixes, strict=True)))


def _mix(
    batch: Batch, index: int, settings: Settings, band: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the coefficients of one shape's maps in the constant and in the columns of the engine."""
    system, reduced = batch.systems[index], batch.reduced[index]
    if not batch.outcome.converged[index]:
        # fails later, with its best iterate, and keeps no other shape from its maps
        return np.zeros(settings.n_maps), np.zeros((len(reduced.turn), settings.n_maps))
    rho = band_rho(system.shape, settings, band)
    coefficients = batch.coefficients(index, rho)
    found = principal_components(
        reduced.gram, coefficients, rho, system.n_nodes, settings.n_maps, centred=settings.centred
    )
    return found.mix[0], reduced.turn @ found.mix[1:]


def batch_features(batch: Batch, settings: Settings, kept: Sequence[Kept]) -> list[Bands]:
    """Compute the node features of all shapes of a batch, on the host.

    Parameters
    ----------
    batch
        Shapes swept over the ρ of all bands, on a device or on the processor.
    settings
        Settings of SPEM maps.
    kept
        For each shape ``(n_nodes,)`` whether a node counts.

    Returns
    -------
    list
        For each shape what `spem.codes.features.node_features` returns.

    Raises
    ------
    SizeError
        When they do not fit into the memory of the device.
    """
    engine = batch.engine
    if not isinstance(engine, CudaEngine):
        return [node_features(field, settings) for field in batch.hyperfields()]
    with _memory(engine.runtime, batch):
        bands = [
            engine.to_nodes(project_maps(batch, engine, settings, band))
            for band in range(len(settings.rho_ranges))
        ]
    return [
        tuple(np.ascontiguousarray(maps if keep.all() else maps[keep], np.float32) for maps in shape)
        for *shape, keep in zip(*bands, kept, strict=True)
    ]


def batch_codes(batch: Batch, part: Part, kept: Sequence[Kept]) -> list[NDArray[np.float64] | ParameterError]:
    """Make the codes of all shapes of a batch.

    Parameters
    ----------
    batch
        Shapes swept over the ρ of all bands, on a device or on the processor.
    part
        What a model has learnt of SPEM maps.
    kept
        For each shape ``(n_nodes,)`` whether a node counts.

    Returns
    -------
    list
        For each shape ``(n_code,)``, as `Part.encode` returns it; where maps are not finite, the error.

    Raises
    ------
    SizeError
        When they do not fit into the memory of the device.
    """
    engine = batch.engine
    if not isinstance(engine, CudaEngine):
        features = batch_features(batch, part.settings, kept)
        return [
            part.encode(bands, system.shape.name)
            for bands, system in zip(features, batch.systems, strict=True)
        ]
    with _memory(engine.runtime, batch):
        rows = Rows.of(engine, kept)
        bands = [
            WordSums.of(part, band, rows, engine.runtime)(project_maps(batch, engine, part.settings, band))
            for band in range(len(part.centers))
        ]
    names = (system.shape.name for system in batch.systems)
    return [_code(part, found, name) for name, *found in zip(names, *bands, strict=True)]


def _code(part: Part, found: Sequence[Residuals], name: str) -> NDArray[np.float64] | ParameterError:
    """Make the code of one shape of its sums, which are finite where maps are."""
    if not all(np.isfinite(each.squares).all() for each in found):
        return ParameterError(f"the maps of {name} contain NaN or inf; they must be finite")
    return part.encode_residuals(found)


@contextmanager
def _memory(runtime: Runtime, batch: Batch) -> Iterator[None]:
    """Turn a device's want of memory into a `SizeError` that says for what."""
    try:
        yield
    except runtime.memory_errors as error:
        nodes, count = sum(system.n_nodes for system in batch.systems), len(batch)
        shapes = "1 shape" if count == 1 else f"{count} shapes"
        msg = (
            f"maps of {shapes} of {nodes:,} nodes do not fit on {runtime.name} beside their fields; "
            "take fewer voxels, or no device"
        )
        raise SizeError(msg) from error
