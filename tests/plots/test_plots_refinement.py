"""Refined meshes: no long edge, the same surface, values carried along."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.plots.refinement import refine


@pytest.mark.parametrize("longest", [0.08, 0.3, 5.0])
@pytest.mark.parametrize("make", [trimesh.creation.box, trimesh.creation.icosahedron, trimesh.creation.cone])
def test_refined_mesh_is_the_same_solid(make, longest):
    """A refined mesh is closed, encloses the same volume, and has no edge above the limit."""
    mesh = make(radius=1, height=4) if make is trimesh.creation.cone else make()
    vertices, faces = refine(np.array(mesh.vertices), np.array(mesh.faces, np.int64), longest)
    refined = trimesh.Trimesh(vertices, faces, process=False)
    assert refined.is_watertight
    assert refined.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert refined.edges_unique_length.max() <= longest
    assert np.array_equal(vertices[: len(mesh.vertices)], mesh.vertices)


def test_values_are_interpolated():
    """A value that is linear in the coordinates stays so."""
    mesh = trimesh.creation.icosahedron()
    rows = np.hstack([mesh.vertices, mesh.vertices @ [[1.0], [2.0], [3.0]] + 4.0])
    rows, _ = refine(rows, np.array(mesh.faces, np.int64), 0.2)
    assert np.allclose(rows[:, 3], rows[:, :3] @ [1.0, 2.0, 3.0] + 4.0)
