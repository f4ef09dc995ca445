"""Node features of surfaces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.codes.settings import Settings
from spem.codes.surface_features import surface_features
from spem.errors import ShapeError
from spem.shapes.meshes import mesh_shape
from spem.shapes.shape import Shape


@pytest.mark.parametrize("kind", ["surface-hks", "surface-si-hks", "surface-wks"])
def test_features_ignore_place_and_size(kind: str) -> None:
    """A body that is moved, turned and scaled has the same features, up to one factor for all."""
    body = trimesh.creation.capsule(2.0, 0.5, count=(12, 12))
    moved = (
        body.copy()
        .apply_scale(7.0)
        .apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.4, 0.7])))
    )
    settings = Settings(features=kind, n_maps=5, n_pairs=60)
    one, two = (
        surface_features(mesh_shape(mesh.vertices, mesh.faces, voxels=300), settings)[0]
        for mesh in (body, moved)
    )
    assert one.dtype == np.float32
    assert np.allclose(one / one.mean(), two / two.mean(), rtol=1e-3, atol=1e-4)


def test_shape_without_a_surface_is_refused() -> None:
    """Silhouettes have no surface."""
    with pytest.raises(ShapeError, match="shapes of 3 dimensions, this one has 2"):
        surface_features(Shape.from_mask(np.ones((5, 5))), Settings(features="surface-wks"))
