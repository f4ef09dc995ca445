"""Sweeps of several shapes at once."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ConvergenceError, SizeError
from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.host import Host
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk

RHO = np.geomspace(0.5, 30.0, 16)


def systems():
    """A disk, a comb, a single pixel and pixels apart: sweeps of different lengths."""
    comb = np.zeros((20, 31), bool)
    comb[15:] = True
    comb[:, ::3] = True
    apart = np.zeros((40, 40), bool)
    apart[::2, ::2] = True
    masks = (comb, np.ones((1, 1), bool), apart)
    return [assemble(disk(radius=14.3, spacing=1.0)), *(assemble(Shape.from_mask(mask)) for mask in masks)]


class Scarce:
    """A backend with room for so many systems."""

    def __init__(self, room):
        self.room, self.opened = room, []

    def open(self, batch, dtype):
        """Make an engine, or say that there is no room."""
        self.opened.append(len(batch))
        if len(batch) > self.room:
            msg = f"{len(batch)} shapes do not fit"
            raise SizeError(msg)
        return Host().open(batch, dtype)


def test_shapes_in_a_batch_have_the_fields_that_they_have_alone():
    """Bit by bit, whatever else is in the batch and however long it takes."""
    batch = systems()
    together = Sweep(device=Host()).hyperfields(batch, [RHO] * len(batch))
    for system, field in zip(batch, together, strict=True):
        alone = Sweep().hyperfield(system, RHO)
        assert np.array_equal(field.fields(), alone.fields())
        assert field.error == alone.error
        assert np.abs(field.fields() - Direct().solve(system, RHO).values).max() < 1e-6


def test_a_batch_that_does_not_fit_is_halved():
    """Half the shapes at a time, down to one; the order of the answers stays."""
    batch, backend = systems(), Scarce(2)
    fields = Sweep(device=backend).hyperfields(batch, [RHO] * len(batch))
    assert backend.opened == [4, 2, 2]
    assert [field.shape for field in fields] == [system.shape for system in batch]
    with pytest.raises(SizeError, match="1 shapes do not fit"):
        Sweep(device=Scarce(0)).hyperfields(batch, [RHO] * len(batch))


def test_a_shape_of_a_batch_that_fails_is_named():
    """One that misses the tolerance is named, and the error carries its best fields."""
    comb = systems()[1]
    easy = assemble(Shape.from_mask(np.ones((2, 2)), name="easy"))
    sweep = Sweep(max_blocks=1)
    with sweep.batch([easy, comb], [RHO, RHO]) as batch:
        assert batch.outcome.converged.tolist() == [True, False]
        batch.require(0)
        with pytest.raises(ConvergenceError, match=r"shape: residual .* raise rtol=1e-06") as caught:
            batch.require(1)
    assert caught.value.solution.values.shape == (comb.n_nodes, 1)


def test_voxels_apart_are_coarsened_to_the_end():
    """A lattice of single voxels, where no block of two merges any at first, takes no dense matrix of all."""
    mask = np.zeros((300, 300), bool)
    mask[::2, ::2] = True
    system = assemble(Shape.from_mask(mask), "voxel")
    values = Sweep().solve(system, np.array([1.0, 3.0])).values
    assert np.allclose(values, 4 / (4 + np.array([1.0, 3.0]) ** -2.0), atol=1e-6)


def test_a_batch_is_closed_with_its_block():
    """After the block nothing is left in the engine."""
    with Sweep().batch([assemble(ball(radius=3.0, spacing=1.0))], [RHO]) as batch:
        [field] = batch.hyperfields()
        assert np.array_equal(batch.coefficients(0), field.coefficients())
    assert batch.engine.each == []
