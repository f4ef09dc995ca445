"""Shape-DNA against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import spem
from spem.errors import ParameterError, ShapeError
from spem.rivals.shape_dna import ShapeDNA
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.synthetic import ball, box


def _sphere(level: int, scale: float = 1.0) -> Shape:
    """Return a ball whose surface is a divided icosahedron."""
    mesh = trimesh.creation.icosphere(level, scale)
    return replace(ball(scale, scale / 5), surface=Surface(mesh.vertices, np.asarray(mesh.faces, np.int64)))


def test_the_sphere_has_its_degrees() -> None:
    """The values of the sphere times its area are 4π l (l + 1), each 2 l + 1 times, to second order."""
    exact = 4 * np.pi * np.repeat([2.0, 6.0], [3, 5])
    rival = ShapeDNA(n_values=8, n_vertices=1)
    errors = [np.abs(rival.describe(_sphere(level)) / exact - 1).max() for level in (2, 3)]
    assert errors[1] < 0.02
    assert errors[0] / errors[1] > 3.5


def test_a_folded_sheet_does_not_feel_its_fold() -> None:
    """An icosahedron and the one with a corner pushed in are isometric, and agree."""
    mesh = trimesh.creation.icosahedron()
    apex, ring = 0, list(mesh.vertex_neighbors[0])
    dented = mesh.vertices.copy()
    centre = dented[ring].mean(axis=0)
    dented[apex] = 2 * centre - dented[apex]
    out, into = (
        replace(ball(1.0, 0.2), surface=Surface(vertices, np.asarray(mesh.faces, np.int64)))
        for vertices in (mesh.vertices, dented)
    )
    rival = ShapeDNA(n_vertices=100)
    assert rival.describe(into) == pytest.approx(rival.describe(out), rel=1e-8)


def test_scale_does_not_count() -> None:
    """A scaled shape has the same description, surface and solid."""
    for rival in (ShapeDNA(n_values=5, n_vertices=1), ShapeDNA(solid=True, n_values=5)):
        small, large = (rival.describe(_sphere(2, scale)) for scale in (1.0, 7.0))
        assert large == pytest.approx(small, rel=1e-9)


def test_the_solid_ball_has_the_zeros_of_bessel_functions() -> None:
    """The lowest values of the ball are π² and 4.4934² over R², here for unit volume."""
    unit = (4 * np.pi / 3) ** (2 / 3)
    exact = unit * np.array([np.pi, *[4.49341] * 3]) ** 2
    rival = ShapeDNA(solid=True, n_values=4)
    errors = [np.abs(rival.describe(ball(1.0, h)) / exact - 1).max() for h in (0.2, 0.1)]
    assert errors[1] < 0.015
    assert errors[0] / errors[1] > 3.5


def test_reweighting_divides_by_the_index() -> None:
    """The i-th value is divided by i; there are 50, and 12 without it."""
    plain, weighted = (
        ShapeDNA(n_values=50).describe(_sphere(3)),
        ShapeDNA(reweighted=True).describe(_sphere(3)),
    )
    assert weighted == pytest.approx(plain / np.arange(1, 51))
    assert ShapeDNA().describe(_sphere(3)).shape == (12,)


def test_distances_are_euclidean() -> None:
    """Distances are symmetric, zero on the diagonal and those of the vectors."""
    found = ShapeDNA().compare([np.array([3.0, 0.0]), np.array([0.0, 4.0])])
    assert found == pytest.approx(np.array([[0, 5], [5, 0]]))


def test_names_tell_variants_apart() -> None:
    """The variants have names of their own."""
    assert ShapeDNA().name == "Shape-DNA"
    assert ShapeDNA(solid=True, reweighted=True).name == "Shape-DNA (solid, reweighted)"


def test_few_vertices_are_divided() -> None:
    """A surface of fewer vertices than values is divided until there are enough."""
    assert ShapeDNA(n_values=40, n_vertices=1).describe(_sphere(0)).shape == (40,)


def test_a_plane_shape_has_no_surface() -> None:
    """A shape of two dimensions is refused by the surface, and taken by the solid."""
    square = box((1.0, 1.0), 0.1)
    with pytest.raises(ShapeError, match="surface"):
        ShapeDNA().describe(square)
    values = ShapeDNA(solid=True, n_values=2).describe(square) / square.size**2
    assert values == pytest.approx(np.pi**2 * np.array([2.0, 5.0]), rel=0.03)


def test_a_solid_of_few_nodes_is_refused() -> None:
    """More values than nodes cannot be had."""
    with pytest.raises(ParameterError, match="n_pairs=12"):
        ShapeDNA(solid=True).describe(Shape.from_mask(np.ones((2, 2, 2))))


@pytest.mark.data
def test_poses_are_nearer_than_classes(data_dir: Path) -> None:
    """Of three shapes of SHREC'11, the two of one class are nearest."""
    folder = data_dir / "shrec11"
    rows = [line.split(",") for line in (folder / "labels.csv").read_text().splitlines()[1:]]
    of = {label: [file for file, other in rows if other == label] for label in ("man", "snake")}
    files = [of["man"][0], of["man"][1], of["snake"][0]]
    rival = ShapeDNA()
    distances = rival.compare([rival.describe(spem.read(folder / file, voxels=500)) for file in files])
    assert distances[0, 1] < distances[0, 2]


@pytest.mark.parametrize(("parameter", "value"), [("n_values", 0), ("n_values", -1)])
def test_numbers_out_of_range_are_refused(parameter: str, value: float) -> None:
    """When the system is made, by the name of the parameter."""
    with pytest.raises(ParameterError, match=f"{parameter}={value}.* expected at least"):
        ShapeDNA(**{parameter: value})  # type: ignore[arg-type]
