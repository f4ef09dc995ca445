"""The facade over boundary sources: from a shape to sources, fields and parts in one call each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import spem
from spem.errors import ParameterError, SizeError


def bone(n: int = 20) -> spem.Shape:
    """Two square ends joined by a thin bar of some length."""
    mask = np.zeros((11, n + 16), bool)
    mask[4:7] = True
    mask[:, :8] = mask[:, -8:] = True
    return spem.Shape.from_mask(mask, name=f"bone{n}")


def test_sources_are_points_or_patches_or_those_nearest():
    """Every boundary point, so many patches, or those next to given coordinates in the order given."""
    points, patches = spem.sources(bone(), boundary="voxel"), spem.sources(bone(), 12)
    assert points.n_sources == points.points.n_points
    assert patches.n_sources == 12
    at = [(5.0, 36.0), (5.0, -1.0)]
    two = spem.sources(bone(), at=at, boundary="voxel")
    assert np.allclose(two.position, at)


def test_fields_of_all_sources_are_the_field():
    """The fields of all patches sum to v at the same ρ (2.3)."""
    fields = spem.source_fields(spem.sources(bone(), 20), 4.0)
    assert np.allclose(fields.values.sum(axis=0), spem.field(bone(), 4.0, solver=spem.Direct()), rtol=1e-13)


@pytest.mark.parametrize("over", ["region", "boundary"])
def test_the_ends_of_a_bone_are_parts(over):
    """Two parts meet in the middle; the parts of the nodes mirror each other."""
    parts = spem.parts(bone(), 2, over=over)
    labels = parts.shape.to_grid(parts.node_labels)[1:-1, 1:-1]
    ends = labels[5, 0], labels[5, -1]
    assert sorted(ends) == [0, 1]
    assert np.nanmean(labels[:, :16] == ends[0]) + np.isnan(labels[:, :16]).mean() > 0.95
    assert parts.over == over


def test_parts_of_several_shapes_are_the_same_parts():
    """In bones of several lengths, the two ends and the bar have the same numbers."""
    found = spem.parts([bone(20), bone(26), bone(32)], 3)
    grids = [parts.shape.to_grid(parts.node_labels)[1:-1, 1:-1] for parts in found]
    middles = {grid[5, grid.shape[1] // 2] for grid in grids}
    assert len(middles) == 1
    for grid in grids:
        assert {grid[5, 1], grid[5, -2]} == {0.0, 1.0, 2.0} - middles


def test_words_that_mean_nothing_are_refused():
    """Only the region and the boundary can be divided."""
    with pytest.raises(ParameterError, match="over='area': expected one of 'region', 'boundary'"):
        spem.parts(bone(), 2, over="area")  # type: ignore[arg-type]


@pytest.mark.parametrize("rho", [[1.0, 2.0], [], -1.0, float("nan"), None])
def test_one_rho_is_one_rho(rho):
    """Several ρ are refused where one slice is made, not cut to the first."""
    with pytest.raises(ParameterError, match="rho"):
        spem.source_fields(spem.sources(bone(), 12), rho)
    with pytest.raises(ParameterError, match="rho"):
        spem.parts(bone(), 2, rho=rho)


def test_a_shape_of_more_pieces_than_patches():
    """Each separate piece of the boundary is a source at least."""
    mask = np.ones((60, 60))
    mask[2::4, 2::4] = 0
    assert spem.parts(spem.Shape.from_mask(mask), 2, n_patches=100).sources.n_sources == 226


def test_what_is_no_shape_is_refused():
    """Arrays and paths are to be made shapes first, shapes sources, and sources fields."""
    for call in (spem.parts, spem.sources, spem.sweep, spem.maps, lambda shape: spem.field(shape, 2.0)):
        for what, kind in (("hand.png", "str"), (Path("hand.png"), "Path|PosixPath"), (None, "NoneType")):
            with pytest.raises(ParameterError, match=rf"expected Shape, got ({kind}); read it first"):
                call(what)
    with pytest.raises(ParameterError, match="expected Shape, got str; read it first"):
        spem.parts(["hand.png"], 2)  # type: ignore[list-item]
    with pytest.raises(ParameterError, match="expected Sources, got Shape; make them first"):
        spem.source_fields(bone())  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="expected SourceFields, got Shape; solve for them first"):
        spem.cluster_interactions(bone(), 2)  # type: ignore[arg-type]


@pytest.mark.parametrize("spacing", [1e-160, 1e160])
def test_a_spacing_beyond_floating_point_is_refused(spacing):
    """Squares of the spacing must be numbers."""
    with pytest.raises(ParameterError, match="use another unit of length"):
        spem.sources(spem.Shape.from_mask(np.ones((3, 3)), spacing))


def test_shapes_that_do_not_fit_in_memory_together_are_refused(monkeypatch):
    """Before anything is solved it is said what all of them need."""
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "1M")
    with pytest.raises(SizeError, match=r"fields and measurements of 3 shapes together need .*; take fewer"):
        spem.parts([bone(20), bone(26), bone(32)], 3)
