"""The facade over ρ: one shape or many, on the processor or on a device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import spem
from spem.errors import ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.host import Host, HostEngine
from spem.shapes.shape import Shape


@dataclass
class Small:
    """A device of the processor's own that holds so many systems, and notes what it was asked for."""

    room: int = 100
    batches: list[list[int]] = field(default_factory=list)

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> HostEngine:
        """Make an engine of the processor, or refuse."""
        self.batches.append([system.n_nodes for system in systems])
        if len(systems) > self.room:
            msg = f"{len(systems)} shapes take more memory than there is"
            raise SizeError(msg)
        return Host().open(systems, dtype)


@pytest.fixture(scope="module")
def shapes() -> list[Shape]:
    """Return shapes of two dimensions, in no order."""
    disks = [spem.synthetic.disk(radius=r, spacing=1.0) for r in (6.0, 8.0, 7.0)]
    return [disks[0], spem.synthetic.ball(1.0, 0.4), *disks[1:]]


def same(a: spem.Hyperfield, b: spem.Hyperfield) -> bool:
    """Tell whether two hyperfields are equal bit by bit."""
    return a.shape is b.shape and all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("rho", "basis", "gram", "mass", "stiffness", "source")
    )


@pytest.mark.parametrize("device", [None, Small()], ids=["processor", "device"])
def test_many_are_as_alone(shapes, device):
    """Each shape of many has the hyperfield that it has alone, in the order that they were given."""
    found = spem.sweep_many(shapes, n_rho=12, device=device)
    assert all(same(many, spem.sweep(shape, n_rho=12)) for many, shape in zip(found, shapes, strict=True))


def test_shapes_of_one_dimension_go_together(shapes):
    """A device gets one batch for each dimension."""
    device = Small()
    spem.sweep_many(shapes, [2.0, 4.0], device=device)
    assert device.batches == [[shapes[i].n_nodes for i in rows] for rows in ([0, 2, 3], [1])]


def test_want_of_memory_halves_a_batch(shapes):
    """What does not fit together is swept apart, to the same; a single shape that does not is refused."""
    whole = spem.sweep_many(shapes, [2.0, 4.0])
    assert all(map(same, spem.sweep_many(shapes, [2.0, 4.0], device=Small(1)), whole))
    with pytest.raises(SizeError, match="1 shapes take more memory"):
        spem.sweep_many(shapes, [2.0, 4.0], device=Small(0))


def test_no_shapes():
    """Nothing gives nothing."""
    assert spem.sweep_many([]) == []


def test_one_shape_is_not_many(shapes):
    """A shape where a list is expected is told what to do."""
    with pytest.raises(ParameterError, match=r"expected a list of shapes; use spem\.sweep for one"):
        spem.sweep_many(shapes[0])


def test_every_entry_takes_the_device(shapes):
    """Fields, sweep and maps run where they are asked to, and come to the same."""
    device, shape = Small(), shapes[0]
    np.testing.assert_array_equal(spem.field(shape, 3.0, device=device), spem.field(shape, 3.0))
    assert same(spem.sweep(shape, device=device), spem.sweep(shape))
    np.testing.assert_array_equal(spem.maps(shape, device=device).values, spem.maps(shape).values)
    assert len(device.batches) == 3


def test_a_solver_has_its_own_device(shapes):
    """A solver and a device together are refused."""
    with pytest.raises(ParameterError, match="give the device to the solver"):
        spem.field(shapes[0], 3.0, solver=Direct(), device=Small())


def test_a_hyperfield_has_been_swept(shapes):
    """Maps of a hyperfield take no device: its sweep is over."""
    with pytest.raises(ParameterError, match="rtol and device are its own; give them to sweep"):
        spem.maps(spem.sweep(shapes[0]), device=Small())


@pytest.mark.parametrize("wrong", ["cuda", 0, spem.Cuda, "cpu"])
def test_what_is_no_device_is_refused(shapes, wrong):
    """Words, numbers and classes are no devices; the processor is not taken in their place."""
    shape = shapes[0]
    calls = [
        lambda: spem.field(shape, 3.0, device=wrong),
        lambda: spem.sweep(shape, device=wrong),
        lambda: spem.sweep_many([shape], device=wrong),
        lambda: spem.maps(shape, device=wrong),
        lambda: spem.encode([shape], n_centers=2, device=wrong),
        lambda: spem.MultigridGradients(device=wrong),
    ]
    for call in calls:
        with pytest.raises(ParameterError, match=r"^device=.*: expected spem\.Cuda\(\) or another backend"):
            call()


@pytest.mark.parametrize("wrong", ["multigrid", spem.MultigridGradients])
def test_what_is_no_solver_is_refused(shapes, wrong):
    """Words and classes are no solvers, of fields or of single sources."""
    with pytest.raises(ParameterError, match=r"^solver=.*: expected a solver, such as spem\.Multi"):
        spem.field(shapes[0], 3.0, solver=wrong)
    with pytest.raises(ParameterError, match=r"^solver=.*: expected a solver, such as spem\.Multi"):
        spem.SourceHyperfield(spem.sources(shapes[0], 8), [2.0], solver=wrong)


def test_many_are_any_shapes_in_a_row(shapes):
    """Shapes may be generated; a single one, or what holds none, is refused."""
    found = spem.sweep_many((shape for shape in shapes[2:]), [2.0, 4.0])
    assert [field.shape for field in found] == shapes[2:]
    for wrong in (shapes[0], 5, None):
        with pytest.raises(ParameterError, match=r"^shapes=.*: expected a list of shapes"):
            spem.sweep_many(wrong)
