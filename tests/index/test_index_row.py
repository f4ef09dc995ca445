"""Tests of rows and packed shapes."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ReadError
from spem.index.row import pack, row_id, unpack
from spem.shapes import synthetic
from spem.shapes.shape import Report, Shape
from spem.shapes.surface import Surface


def _shapes() -> list[Shape]:
    """Return shapes of one to four dimensions, with and without cuts, surface, report and unequal spacing."""
    ball = synthetic.ball(radius=5.0, spacing=1.0)
    corners = np.array([[1e6, 0, 0], [1e6 + 3, 0, 0], [1e6, 3, 0], [1e6, 0, 3]])
    surface = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    report = Report("a.obj", "parity", watertight=True, repairs=("hole closed", "ρ ≠ 0"))
    affine = np.arange(16.0).reshape(4, 4)
    return [
        Shape.from_mask(np.ones(7), spacing=0.5, name="rod"),
        synthetic.disk(radius=8.0, spacing=1.0),
        Shape.from_mask(np.eye(5), spacing=(1.0, 0.3), origin=(-4.0, 2.0), name="diagonal"),
        Shape(ball.mask, ball.spacing, ball.origin, "ball", ball.cuts, report, affine, surface),
        Shape.from_mask(np.ones((2, 3, 2, 4)), name="block in space-time"),
    ]


@pytest.mark.parametrize("shape", _shapes(), ids=lambda shape: shape.name)
def test_shapes_come_back(shape: Shape) -> None:
    """What was packed comes back; cuts to a part of an edge, vertices to a part of the extent."""
    back = unpack(pack(shape))
    assert np.array_equal(back.mask, shape.mask)
    assert (back.spacing, back.origin, back.name) == (shape.spacing, shape.origin, shape.name)
    assert back.report == shape.report
    assert np.array_equal(back.cuts.voxel, shape.cuts.voxel)
    assert np.array_equal(back.cuts.direction, shape.cuts.direction)
    assert np.abs(back.cuts.fraction - shape.cuts.fraction).max(initial=0) <= 2.0**-12
    assert (back.affine is None) == (shape.affine is None)
    if shape.surface is not None and back.surface is not None:
        assert np.abs(back.surface.vertices - shape.surface.vertices).max() < 1e-6
        assert np.array_equal(back.surface.faces, shape.surface.faces)
    assert pack(back) == pack(unpack(pack(back)))


def test_a_cut_on_the_face_is_kept_as_it_is() -> None:
    """One half, where nothing is known of a cut, is one of the steps."""
    disk = synthetic.disk(radius=8.0, spacing=1.0)
    halves = type(disk.cuts)(disk.cuts.voxel, disk.cuts.direction, np.full(len(disk.cuts), 0.5))
    shape = Shape(disk.mask, disk.spacing, disk.origin, "disk", halves)
    assert (unpack(pack(shape)).cuts.fraction == 0.5).all()


def test_packed_shapes_are_small() -> None:
    """A solid of fifteen thousand nodes takes less than forty kilobytes."""
    ball = synthetic.ball(radius=15.3, spacing=1.0)
    assert 14_000 < ball.n_nodes < 16_000
    assert len(pack(ball)) < 40_000


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_truncated_shapes_are_refused(share: float) -> None:
    """Bytes cut short are told as damaged."""
    data = pack(synthetic.disk(radius=8.0, spacing=1.0))
    with pytest.raises(ReadError, match="row 7: its packed shape is damaged"):
        unpack(data[: int(share * len(data))], "row 7")


def test_overwritten_shapes_are_refused_or_read() -> None:
    """A byte that changed is found, or leaves a shape; nothing else is raised."""
    data = bytearray(pack(synthetic.disk(radius=8.0, spacing=1.0)))
    rng, refused = np.random.default_rng(0), 0
    for place in rng.integers(0, len(data), 60):
        changed = data.copy()
        changed[place] ^= int(rng.integers(1, 256))
        try:
            assert unpack(bytes(changed)).n_nodes
        except ReadError:
            refused += 1
    assert refused > 20


def test_ids_tell_shapes_of_a_file_apart() -> None:
    """The id is the beginning of the hash and the suffix of the label."""
    assert row_id("ab" * 32) == "ab" * 10
    assert row_id("ab" * 32, "-3") == "ab" * 10 + "-3"
