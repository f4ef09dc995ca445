"""The value object of parts, and its file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import spem
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.parts import Parts, touched_part
from spem.errors import ParameterError, ReadError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Cuts, Shape

ARRAYS = ("components", "basis", "node_labels", "source_labels", "intensity")


def _bar(divide=region_parts, n_parts: int = 3) -> Parts:
    """Return the parts of a bar."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((3, 24)), name="bar"), "voxel"))
    return divide(solve_sources(sources, np.inf), n_parts)


@pytest.mark.parametrize("divide", [region_parts, boundary_parts])
def test_relabelled_parts_can_be_numbered_back(divide):
    """New numbers go to labels, components, basis and intensity alike; the inverse order restores them."""
    parts = _bar(divide)
    there = parts.relabelled([2, 0, 1])
    np.testing.assert_array_equal(there.components, parts.components[[2, 0, 1]])
    np.testing.assert_array_equal(there.node_labels == 0, parts.node_labels == 2)
    np.testing.assert_allclose(there.sizes, parts.sizes[[2, 0, 1]])
    back = there.relabelled([1, 2, 0])
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(back, name), getattr(parts, name))


def test_order_may_leave_parts_out_and_make_empty_ones():
    """-1 makes an empty part; what belongs to parts left out is in none."""
    parts = _bar()
    fewer = parts.relabelled([1, -1])
    assert fewer.n_parts == 2
    np.testing.assert_array_equal(fewer.node_labels, np.where(parts.node_labels == 1, 0, -1))
    assert fewer.sizes[1] == fewer.intensity[1] == fewer.components[1].max() == 0


@pytest.mark.parametrize("order", [[], [0, 0], [0, 3], [-2, 1]])
def test_other_orders_are_refused(order):
    """Numbers that no part has, or one twice, are refused."""
    with pytest.raises(ParameterError, match=r"bar: order .*: expected different parts from 0 to 2, or -1"):
        _bar().relabelled(order)


@pytest.mark.parametrize("divide", [region_parts, boundary_parts])
def test_weak_parts_give_what_they_hold_to_others(divide):
    """Without the weakest part its nodes and sources belong to others, and nothing else moves."""
    parts = _bar(divide, 4)
    weakest = int(parts.intensity.argmin())
    threshold = float(np.sort(parts.intensity)[:2].mean() * 4)
    left = parts.without_weak(threshold)
    number = np.insert(np.arange(3), weakest, -1)
    for name in ("node_labels", "source_labels"):
        before, after = getattr(parts, name), getattr(left, name)
        moved = before == weakest
        np.testing.assert_array_equal(after[~moved], number[before[~moved]])
    assert left.n_parts == 3
    assert left.unexplained < 0.2
    assert parts.without_weak(0.0) is parts
    with pytest.raises(ParameterError, match="threshold=5: every part is weaker"):
        parts.without_weak(5.0)


def test_dataset_has_labelled_dimensions():
    """Arrays carry the dimensions part, node and source, and coordinates of both."""
    parts = _bar(boundary_parts)
    data = parts.to_xarray()
    assert data["components"].dims == ("part", "source")
    assert data["basis"].dims == ("part", "node")
    np.testing.assert_array_equal(data["x1"], parts.shape.points[:, 1])
    np.testing.assert_array_equal(data["source_x0"], parts.sources.position[:, 0])
    assert data.attrs == {"name": "bar", "rho": np.inf, "over": "boundary"}


@pytest.mark.parametrize(
    ("shape", "count"),
    [
        (spem.synthetic.interval(1.0, 0.05), None),
        (spem.creatures.creature("hand", voxels=300, rng=np.random.default_rng(0)), 40),
        (spem.synthetic.ball(1.0, (0.3, 0.25, 0.2)), 30),
    ],
)
def test_saved_parts_come_back(shape, count, tmp_path):
    """A file restores parts, shape and sources of any dimension, and plain NumPy reads it."""
    system = assemble(shape)
    sources = point_sources(system) if count is None else patch_sources(system, count)
    parts = boundary_parts(solve_sources(sources, 3.0), 2)
    path = tmp_path / "parts.npz"
    parts.save(path)
    again = Parts.load(path)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(parts, name))
    np.testing.assert_array_equal(again.sources.group, parts.sources.group)
    np.testing.assert_array_equal(again.shape.mask, shape.mask)
    np.testing.assert_array_equal(again.sources.rhs.toarray(), parts.sources.rhs.toarray())
    assert (again.shape.report, again.shape.spacing, again.rho) == (shape.report, shape.spacing, 3.0)
    assert repr(again) == repr(parts)
    with np.load(path) as file:
        np.testing.assert_array_equal(file["points"], shape.points)
        np.testing.assert_array_equal(file["labels"], parts.node_labels)
        np.testing.assert_allclose(file["sources"], parts.sources.position)


def test_other_files_are_refused(tmp_path):
    """A missing, truncated, foreign or later file, and one whose arrays do not fit, are refused."""
    path = tmp_path / "parts.npz"
    with pytest.raises(ReadError, match=r"parts\.npz: no such file"):
        Parts.load(path)
    _bar().save(path)
    whole = path.read_bytes()
    with np.load(path) as file:
        arrays = dict(file)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ReadError, match="no whole parts of a shape"):
        Parts.load(path)
    later = str(arrays["about"]).replace('"format": 1', '"format": 9')
    damaged = {
        "no whole parts": {"about": np.array("{}")},
        "parts of format 9, expected 1": {"about": np.array(later)},
        "node_labels do not fit": {"labels": arrays["labels"] + 1},
        "basis do not fit": {"basis": arrays["basis"][:, 1:]},
        "basis are no finite numbers": {"basis": arrays["basis"] * np.nan},
        "components are no finite numbers": {"components": arrays["components"].astype(str)},
        "source_labels are no finite numbers": {"source_labels": arrays["source_labels"] + 0.5},
        "rho is -1": {"rho": np.array(-1.0)},
    }
    for message, changed in damaged.items():
        np.savez(path, **(arrays | changed))
        with pytest.raises(ReadError, match=message):
            Parts.load(path)
    np.savez(path, about=np.array([{}], object))
    with pytest.raises(ReadError, match="no whole parts"):
        Parts.load(path)


def test_parts_that_cannot_be_written_leave_no_file(tmp_path):
    """A folder that is not there is named, and nothing is left behind."""
    with pytest.raises(ParameterError, match="cannot be written"):
        _bar().save(tmp_path / "absent" / "parts.npz")
    assert not list(tmp_path.iterdir())


def test_source_is_of_the_part_that_most_of_its_edges_lead_to():
    """However near the surface comes to one node, the edges of the others outvote it."""
    framed = Shape.from_mask(np.ones((1, 4)))
    cut = Cuts(framed.voxels[:1], np.array([0], np.uint8), np.array([1e-6]))
    points = point_sources(assemble(Shape(framed.mask, framed.spacing, framed.origin, cuts=cut)))
    whole = replace(points, group=np.zeros(points.n_sources, np.int32))
    assert touched_part(whole, np.array([0, 1, 1, 1], np.int32), 2).tolist() == [1]
