"""The views of parts and of single sources."""

from __future__ import annotations

import json

import numpy as np
import pytest

import spem
from spem.decomposition.choice import error_curve
from spem.errors import ParameterError
from spem.server.arrays import pack_arrays
from spem.server.views import VIEWS
from spem.server.views import division as division_module
from spem.server.views import source as source_module
from spem.server.views.division import divide, on_shape
from spem.server.views.options import coarser_shape

parts_of, source_of, geometry_of = VIEWS["parts"], VIEWS["source"], VIEWS["geometry"]


@pytest.fixture(scope="module")
def bone():
    """Return two knobs joined by a bar."""
    mask = np.pad(np.ones((3, 20)), ((4, 4), (0, 0)))
    mask[:, :8] = mask[:, -8:] = 1
    return spem.Shape.from_mask(mask, name="bone")


@pytest.fixture(scope="module")
def cross():
    """Return a cross of four arms."""
    mask = np.zeros((19, 19), bool)
    mask[8:11] = mask[:, 8:11] = True
    return spem.Shape.from_mask(mask, name="cross")


def test_given_parts_are_those_of_the_library(bone):
    """With k given, labels, codes and sizes are those of `spem.parts`."""
    header, arrays = parts_of(bone, {"k": 2})
    parts = spem.parts(bone, 2)
    np.testing.assert_array_equal(arrays["node_part"], parts.node_labels)
    np.testing.assert_allclose(arrays["strength"], parts.components.T, rtol=1e-6)
    np.testing.assert_allclose(arrays["sizes"], parts.sizes)
    assert (header["k"], header["chosen"], "curve" in arrays) == (2, False, False)


def test_number_of_parts_is_chosen_by_the_elbow(cross):
    """Without k it is that of the error curve, which is told, for a shape of few nodes on all of them."""
    header, arrays = parts_of(cross, {"k": None})
    expected = error_curve(spem.source_fields(spem.api.parts.part_sources(cross)), division_module.MOST_PARTS)
    assert header["chosen"]
    assert header["k"] == expected.suggested
    np.testing.assert_allclose(arrays["curve"], expected.errors, rtol=1e-5)


def test_penalty_is_the_share_of_the_largest(bone):
    """The paper's λ is a tenth of the largest norm of a measurement."""
    header, _ = parts_of(bone, {"k": 2})
    fields = spem.source_fields(spem.parts(bone, 2).sources)
    largest = np.linalg.norm(spem.decomposition.measurements.measurements(fields), axis=0).max()
    assert header["sparsity"] == {"penalty": pytest.approx(0.1 * largest), "share": 0.1}


def test_contour_has_the_parts_of_the_nodes_inside(bone):
    """Left and right ends of a bone belong to its two parts, along the contour too."""
    _, arrays = parts_of(bone, {"k": 2})
    _, geometry = geometry_of(bone, {})
    np.testing.assert_array_equal(arrays["contour_part"], arrays["node_part"][geometry["contour_node"]])
    left = arrays["contour_part"][geometry["contour"][:, 1] < 8]
    assert len(set(left.tolist())) == 1


def test_surface_has_parts_at_the_vertices_of_the_geometry():
    """Vertices are those of the view of the geometry, in its order."""
    mask = np.ones((5, 5, 24), bool)
    mask[:, [0, 1, 3, 4], 10:14] = False
    shape = spem.Shape.from_mask(mask)
    _, arrays = parts_of(shape, {"k": 2})
    _, geometry = geometry_of(shape, {})
    assert arrays["vertex_part"].shape == (len(geometry["vertex"]),)
    ends = geometry["vertex"][:, 2]
    assert len(set(arrays["vertex_part"][ends < 8].tolist())) == 1
    assert {0, 1} <= set(arrays["vertex_part"].tolist()) <= {-1, 0, 1}


def test_large_shapes_are_divided_on_a_coarser_grid(bone, monkeypatch):
    """Every node of the fine grid has a part, halves remain, and the header says on how many nodes."""
    fine = spem.shapes.rescale.to_spacing(bone, 0.5)
    whole = divide(fine, {"k": 2}).labels
    monkeypatch.setattr(division_module, "_DIVIDED_NODES", 300)
    header, arrays = parts_of(fine, {"k": 2})
    assert header["divided_nodes"] < 310 < fine.n_nodes
    same = float(np.mean(arrays["node_part"] == whole))
    assert max(same, 1 - same) > 0.95
    parts = on_shape(divide(fine, {"k": 2}))
    np.testing.assert_array_equal(parts.node_labels, arrays["node_part"])
    assert parts.components.shape == (2, fine.n_nodes)
    assert parts.basis.shape == (2, parts.sources.n_sources)


def test_shapes_too_thin_for_a_coarser_grid_stay():
    """A coarser grid would lose most of a diagonal line of voxels, and have no node in a sheet."""
    mask = np.zeros((60, 60, 60), bool)
    mask[np.arange(60), np.arange(60), np.arange(60)] = mask[:, 5, 5] = True
    for shape in (spem.Shape.from_mask(mask), spem.Shape.from_mask(np.ones((200, 2)))):
        assert coarser_shape(shape, 20) is shape


@pytest.mark.parametrize("k", [0, 13, "4", 2.5])
def test_number_of_parts_out_of_range_is_refused(bone, k):
    """From 1 to 12 are divided."""
    with pytest.raises(ParameterError, match=r"k=.*: expected a whole number from 1 to 12"):
        parts_of(bone, {"k": k})


@pytest.mark.parametrize(
    "shape", [spem.Shape.from_mask(np.ones(30)), spem.Shape.from_mask(np.ones((4,) * 4))]
)
def test_parts_of_other_dimensions_have_nodes_alone(shape):
    """Shapes that have no picture have parts of their nodes."""
    _, arrays = parts_of(shape, {"k": 2})
    assert set(arrays) == {"node_part", "strength", "sizes", "intensity"}


def test_source_is_the_field_of_its_patch():
    """The log field of a patch is that of the source that the geometry numbers so."""
    disk = spem.synthetic.disk(radius=20.0, spacing=1.0)
    header, arrays = source_of(disk, {"patch": 7, "rho": 4.0})
    sources = spem.api.parts.part_sources(disk, 200, boundary="surface")
    np.testing.assert_allclose(arrays["log"], spem.source_fields(sources.select([7]), 4.0).log[0], rtol=1e-6)
    _, geometry = geometry_of(disk, {})
    own = geometry["contour"][geometry["contour_patch"] == 7]
    np.testing.assert_allclose(header["position"], own.mean(axis=0), atol=1e-4)
    assert header["rho"] == 4.0


def test_fields_of_all_patches_share_the_boundary(cross):
    """At infinite rho their sum is one everywhere, and so is that of their shares of the boundary."""
    replies = [source_of(cross, {"patch": patch}) for patch in range(12)]
    n = replies[0][0]["n_patches"]
    assert n == 76
    assert all(header["rho"] == "inf" for header, _ in replies)
    rest = [source_of(cross, {"patch": patch}) for patch in range(12, n)]
    total = sum(np.exp(arrays["log"].astype(float)) for _, arrays in replies + rest)
    np.testing.assert_allclose(total, 1.0, rtol=1e-5)
    assert sum(header["share"] for header, _ in replies + rest) == pytest.approx(1.0)


def test_large_shapes_are_factored_anew(monkeypatch):
    """What is kept of a small shape is what a large one is solved with each time."""
    disk = spem.synthetic.disk(radius=20.0, spacing=1.0)
    _, kept = source_of(disk, {"patch": 5})
    monkeypatch.setattr(source_module, "_KEPT_NODES", 10)
    _, anew = source_of(disk, {"patch": 5})
    np.testing.assert_array_equal(kept["log"], anew["log"])


def test_nodes_that_are_not_reached_are_counted():
    """Of two squares a source reaches one; the other has the least value, and JSON can say all of it."""
    mask = np.ones((5, 13), bool)
    mask[:, 5:8] = False
    header, arrays = source_of(spem.Shape.from_mask(mask), {"patch": 0})
    assert header["unreached"] == 25
    assert np.isfinite(arrays["log"]).all()
    assert np.count_nonzero(arrays["log"] == arrays["log"].min()) >= 25
    json.dumps(header, allow_nan=False)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "patch=None: expected the number"),
        ({"patch": True}, "patch=True: expected the number"),
        ({"patch": 76}, "source 76, expected 0 to 75"),
        ({"patch": "1"}, "source 1, expected"),
        ({"patch": 1, "rho": -1.0}, "rho=-1: expected a positive length"),
    ],
)
def test_sources_that_are_none_are_refused(cross, options, message):
    """No patch, one beyond the last and a negative length are named."""
    with pytest.raises(ParameterError, match=message):
        source_of(cross, options)


def test_replies_go_over_the_wire(bone):
    """Bodies of parts and sources pack."""
    assert pack_arrays(*parts_of(bone, {}))
    assert pack_arrays(*source_of(bone, {"patch": 1}))
