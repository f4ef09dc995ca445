"""SD-GDM: distances over the sphere, what leaves the values alone, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.errors import ParameterError, ShapeError
from spem.rivals.sd_gdm import SDGDM, geodesic_matrix, largest_values
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.synthetic import ball, disk

pytest.importorskip("potpourri3d")


def sphere(subdivisions: int = 3, stretch: tuple[float, float, float] = (1, 1, 1)) -> Surface:
    mesh = trimesh.creation.icosphere(subdivisions)
    return Surface(np.array(mesh.vertices) * stretch, np.array(mesh.faces, np.int64))


def shape_of(surface: Surface) -> Shape:
    """A solid of which the surface matters alone: its voxels fill the box around it."""
    low, size = surface.vertices.min(axis=0), np.ptp(surface.vertices, axis=0)
    step = tuple((size / 8).tolist())
    return Shape.from_mask(np.ones((9, 9, 9)), step, origin=tuple(low.tolist()), surface=surface)


def test_distances_on_the_unit_sphere_are_angles():
    """Great-circle distances to a few percent, symmetric, zero on the diagonal; areas sum to 4π."""
    surface = sphere()
    distances, areas = geodesic_matrix(surface, 10_000)
    angles = np.arccos(np.clip(surface.vertices @ surface.vertices.T, -1, 1))
    assert np.abs(distances - angles).mean() < 0.03
    assert np.array_equal(distances, distances.T)
    assert not distances.diagonal().any()
    assert areas.sum() == pytest.approx(4 * np.pi, rel=0.02)


def test_values_of_the_sphere_are_those_of_the_integral_operator():
    """The largest is the mean distance π/2; the next three, of linear functions, are π/8 (Funk-Hecke)."""
    values = SDGDM(n_values=4).describe(shape_of(sphere())) * np.sqrt(4 * np.pi)
    assert values[0] == pytest.approx(np.pi / 2, rel=0.02)
    assert values[1:] == pytest.approx(np.full(3, np.pi / 8), rel=0.03)


def test_few_points_stand_for_all():
    """With a quarter of the points the largest values change little."""
    surface = shape_of(sphere(3, (1, 1, 3)))
    all_points, few = (SDGDM(n_values=8, samples=n).describe(surface) for n in (10_000, 160))
    assert few == pytest.approx(all_points, rel=0.1)


def test_place_scale_and_order_do_not_matter():
    """Neither a rotation, nor a scale, nor another order of the vertices changes the values."""
    surface = sphere(2, (1, 2, 3))
    turn = trimesh.transformations.rotation_matrix(1.0, [1, 2, 3])[:3, :3]
    order = np.random.default_rng(0).permutation(len(surface.vertices))
    place = np.argsort(order)
    moved = Surface(7 * surface.vertices[order] @ turn.T + 5, place[surface.faces])
    one, other = (SDGDM(n_values=10).describe(shape_of(s)) for s in (surface, moved))
    assert other == pytest.approx(one, rel=1e-3)


def test_iterated_values_are_those_of_the_whole_spectrum():
    """Above some size only the values that are wanted are computed."""
    distances, _ = geodesic_matrix(sphere(3), 10_000)
    assert largest_values(distances, 6) == pytest.approx(
        np.sort(np.abs(np.linalg.eigvalsh(distances)))[::-1][:6], rel=1e-8
    )


def test_comparison_is_the_mean_of_relative_differences():
    """Symmetric, zero for equal ones, and of the values that all have."""
    found = SDGDM().compare([np.array([4.0, 1.0]), np.array([4.0, 3.0, 2.0])])
    assert found == pytest.approx(np.array([[0, 0.5], [0.5, 0]]))


def test_a_solid_of_voxels_has_the_values_of_its_surface():
    """Of a ball without a mesh the surface is taken from the grid."""
    values = SDGDM(n_values=2, samples=200).describe(ball(1.0, 0.15)) * np.sqrt(4 * np.pi)
    assert values == pytest.approx([np.pi / 2, np.pi / 8], rel=0.08)


def test_a_silhouette_is_refused():
    """It has no surface, and the message names it."""
    with pytest.raises(ShapeError, match=r"disk.*surface is of shapes of 3 dimensions"):
        SDGDM().describe(disk(3.0, 1.0))


@pytest.mark.data
def test_poses_of_one_class_are_nearer(data_dir):
    """Two horses in different poses are nearer to each other than to a snake."""
    rows = [line.split(",") for line in (data_dir / "shrec11" / "labels.csv").read_text().split()[1:]]
    files = [f for f, label in rows if label == "horse"][:2] + [f for f, label in rows if label == "snake"][
        :1
    ]
    rival = SDGDM()
    shapes = [read(data_dir / "shrec11" / f, voxels=500) for f in files]
    distances = rival.compare([rival.describe(shape) for shape in shapes])
    assert distances[0, 1] < 0.5 * distances[0, 2]


@pytest.mark.parametrize(("parameter", "value"), [("n_values", 0), ("samples", 1)])
def test_numbers_out_of_range_are_refused(parameter: str, value: float) -> None:
    """When the system is made, by the name of the parameter."""
    with pytest.raises(ParameterError, match=f"{parameter}={value}.* expected at least"):
        SDGDM(**{parameter: value})  # type: ignore[arg-type]
