"""Parts of several shapes under one numbering."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spem.decomposition.joint import joint_parts
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.read import read
from spem.shapes.shape import Shape


def _fields(mask: np.ndarray, count: int | None = None, rho: float = np.inf) -> SourceFields:
    """Solve for the boundary points or arcs of a mask."""
    system = assemble(Shape.from_mask(mask), "voxel")
    return solve_sources(point_sources(system) if count is None else patch_sources(system, count), rho)


def _walker(lift: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a body with a long arm, raised by an angle, and a short leg; and what each pixel belongs to."""
    rows, columns = np.mgrid[:70, :110].astype(float)
    bones = [
        ((40.0, 20.0), (40.0, 60.0), 9.0),
        ((40.0, 66.0), (40 - 36 * np.sin(lift), 66 + 36 * np.cos(lift)), 4.0),
    ]
    bones.append(((48.0, 24.0), (66.0, 24.0), 4.0))
    owner = np.full(rows.shape, -1)
    for number, ((r, c), (s, d), width) in reversed(list(enumerate(bones))):
        along = np.clip(
            ((rows - r) * (s - r) + (columns - c) * (d - c)) / ((s - r) ** 2 + (d - c) ** 2), 0, 1
        )
        inside = np.hypot(rows - r - along * (s - r), columns - c - along * (d - c)) <= width
        owner[inside] = number
    return owner >= 0, owner


@pytest.mark.parametrize("over", ["region", "boundary"])
def test_a_raised_arm_keeps_its_number(over: str) -> None:
    """In three poses each bone is divided alike, to 5 % of its nodes, and the arm is a part of its own."""
    poses = [_walker(lift) for lift in (-0.1, 0.4, 0.9)]
    joint = joint_parts([_fields(mask, 80) for mask, _ in poses], 3, over=over)
    shares = []
    for parts, (mask, owner) in zip(joint.parts, poses, strict=True):
        table = np.array(
            [np.bincount(parts.node_labels[owner[mask] == bone], minlength=3) for bone in range(3)]
        )
        shares.append(table / table.sum(axis=1, keepdims=True))
    assert np.ptp(shares, axis=0).max() < 0.05
    arm = shares[0][1].argmax()
    assert shares[0][1, arm] > 0.75
    assert shares[0][[0, 2], arm].max() < 0.05


def test_a_turned_shape_has_the_same_parts() -> None:
    """A quarter turn moves labels with the nodes, also where the numbers of sources differ."""
    mask, _ = _walker(0.4)
    first, second = joint_parts([_fields(mask, 90), _fields(np.rot90(mask), 70)], 3).parts
    turned = np.rot90(first.shape.to_grid(first.node_labels, -9))
    assert np.mean(turned == second.shape.to_grid(second.node_labels, -9)) > 0.98


def test_one_shape_alone_may_be_divided() -> None:
    """A single shape is its own reference, at next to no cost."""
    joint = joint_parts([_fields(_walker(0.2)[0], 60)], 3)
    assert joint.reference == 0
    assert joint.costs[0] < 1e-3
    assert joint.parts[0].sizes.sum() == pytest.approx(1)


def test_parts_are_numbered_by_size_over_all_shapes() -> None:
    """The mean size over the shapes falls with the number."""
    joint = joint_parts([_fields(_walker(lift)[0], 60) for lift in (0.0, 0.5)], 4)
    assert np.all(np.diff(np.mean([parts.sizes for parts in joint.parts], axis=0)) <= 0)


def test_the_same_seed_gives_the_same_parts() -> None:
    """Nothing but the generator is random."""
    fields = [_fields(_walker(lift)[0], 60) for lift in (0.0, 0.5)]
    first, second = (joint_parts(fields, 3, rng=np.random.default_rng(5)) for _ in range(2))
    for a, b in zip(first.parts, second.parts, strict=True):
        assert np.array_equal(a.node_labels, b.node_labels)


def test_bad_arguments_are_refused() -> None:
    """No shape, two ρ or dimensions, no such reference, too many parts, a sparsity that leaves nothing."""
    mask, _ = _walker(0.2)
    one, other = _fields(mask, 30), _fields(mask, 30, rho=9.0)
    with pytest.raises(ParameterError, match="no shapes"):
        joint_parts([], 2)
    with pytest.raises(ParameterError, match="expected one ρ for all"):
        joint_parts([one, other], 2)
    with pytest.raises(ParameterError, match=r"is 3-D, .* is 2-D: shapes of one dimension"):
        joint_parts([one, _fields(np.ones((4, 4, 4)))], 2)
    with pytest.raises(ParameterError, match="reference=2: expected the number of a shape, 0 to 1"):
        joint_parts([one, one], 2, reference=2)
    with pytest.raises(ParameterError, match="n_parts=31: expected 1 to 30"):
        joint_parts([one], 31)
    with pytest.raises(ParameterError, match="sparsity=1"):
        joint_parts([one], 2, sparsity=1.0)


@pytest.mark.data
def test_fingers_keep_their_numbers(data_dir: Path) -> None:
    """Along the contours of three left hands, five parts or more are met once, in one order."""
    shapes = [read(data_dir / "tari1000" / f"obj11_{i}.png", inner_radius=20) for i in (7, 14, 19)]
    fields = [solve_sources(patch_sources(assemble(shape, "voxel"), 200), np.inf) for shape in shapes]
    met = []
    for parts in joint_parts(fields, 8).parts:
        labels = parts.source_labels
        met.append(labels[np.flatnonzero(labels != np.roll(labels, 1))].tolist())
    once = [label for label in range(8) if all(order.count(label) == 1 for order in met)]
    orders = [[label for label in order if label in once] for order in met]
    turned = [order[order.index(once[0]) :] + order[: order.index(once[0])] for order in orders]
    assert len(once) >= 5
    assert turned[0] == turned[1] == turned[2]
