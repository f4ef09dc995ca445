"""meshSIFT as a rival descriptor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.stats import special_ortho_group

import spem
from spem.errors import ParameterError, ShapeError
from spem.rivals.mesh_sift import MeshSIFT, refine
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.synthetic import box

QUICK = MeshSIFT(min_vertices=500, n_scales=6)


def _shape(vertices: np.ndarray, faces: np.ndarray) -> Shape:
    """Return a shape with a surface; its grid is not looked at."""
    return Shape.from_mask(np.ones((2, 2, 2)), surface=Surface(np.asarray(vertices), np.asarray(faces)))


def _bumpy(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a sphere with bumps, and noise that no two vertices share."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=3)
    centres = special_ortho_group.rvs(3, size=8, random_state=seed)[:, 0]
    square = np.square(ball.vertices[:, None] - centres).sum(axis=2)
    height = (rng.uniform(0.1, 0.5, 8) * np.exp(-square / (2 * rng.uniform(0.15, 0.4, 8) ** 2))).sum(axis=1)
    noise = 0.003 * rng.normal(size=ball.vertices.shape)
    return np.asarray(ball.vertices * (1 + height[:, None]) + noise), np.asarray(ball.faces)


def _same_rows(one: np.ndarray, two: np.ndarray) -> None:
    """Check that two sets of features are the same but for their order."""
    assert one.shape == two.shape
    assert len(one)
    cosines = one @ two.T
    assert cosines.max(axis=1).min() > 0.999
    assert cosines.max(axis=0).min() > 0.999


def test_invariant_to_rigid_motion() -> None:
    """Turned, moved and scaled meshes have the same features."""
    vertices, faces = _bumpy(0)
    turn = special_ortho_group.rvs(3, random_state=5)
    moved = 3.7 * vertices @ turn.T + [1.0, -2.0, 5.0]
    _same_rows(QUICK.describe(_shape(vertices, faces)), QUICK.describe(_shape(moved, faces)))


def test_invariant_to_vertex_order() -> None:
    """Meshes with vertices and faces in another order have the same features."""
    vertices, faces = _bumpy(1)
    order = np.random.default_rng(0).permutation(len(vertices))
    shuffled = np.argsort(order)[np.roll(faces[::-1], 1, axis=1)]
    _same_rows(QUICK.describe(_shape(vertices, faces)), QUICK.describe(_shape(vertices[order], shuffled)))


def test_a_mesh_is_nearest_to_itself() -> None:
    """A noisy copy of a mesh has more matches with it than other meshes have."""
    described, rng = [], np.random.default_rng(2)
    for seed in range(3):
        vertices, faces = _bumpy(seed)
        for _ in range(2):
            noisy = vertices + 0.002 * rng.normal(size=vertices.shape)
            described.append(QUICK.describe(_shape(noisy, faces)))
    distances = QUICK.compare(described)
    np.testing.assert_array_equal(distances, distances.T)
    assert not distances.diagonal().any()
    np.fill_diagonal(distances, np.inf)
    np.testing.assert_array_equal(distances.argmin(axis=1), [1, 0, 3, 2, 5, 4])


def test_features_are_unit_vectors() -> None:
    """Each feature has 144 non-negative entries and length one."""
    features = QUICK.describe(_shape(*_bumpy(3)))
    assert features.shape[1] == 144
    assert features.min() >= 0
    np.testing.assert_allclose(np.linalg.norm(features, axis=1), 1, rtol=1e-5)


def test_shapes_without_features_are_far_from_all() -> None:
    """Empty descriptions compare without a warning and match nothing."""
    none = np.empty((0, 144), np.float32)
    features = QUICK.describe(_shape(*_bumpy(0)))
    distances = QUICK.compare([none, features, features])
    assert distances[0, 1] == distances[0, 2] > distances[1, 2]


def test_refinement_leaves_fine_meshes() -> None:
    """A mesh with enough vertices is not subdivided."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices, _ = refine(Surface(ball.vertices, ball.faces), 162)
    np.testing.assert_array_equal(vertices, ball.vertices)


def test_volumes_have_features() -> None:
    """A shape without a mesh is described by the surface of its grid."""
    assert len(MeshSIFT(min_vertices=100).describe(box((8.0, 12.0, 20.0), 1.0))) > 0


def test_needs_a_surface() -> None:
    """A silhouette is refused by name."""
    with pytest.raises(ShapeError, match=r"flat: .* 3 dimensions"):
        MeshSIFT().describe(Shape.from_mask(np.ones((3, 3)), name="flat"))


@pytest.mark.parametrize(
    ("wrong", "match"),
    [({"n_scales": 3}, "n_scales 3"), ({"ratio": 0.0}, "ratio 0"), ({"first_steps": 0}, "first_steps 0")],
)
def test_parameters_are_checked(wrong: dict[str, float], match: str) -> None:
    """Numbers out of range are refused."""
    with pytest.raises(ParameterError, match=match):
        MeshSIFT(**wrong)  # type: ignore[arg-type]


@pytest.mark.data
def test_real_poses(data_dir: Path) -> None:
    """Of a few real meshes, the nearest to each is another pose of its class."""
    folder = data_dir / "shrec11"
    if not (folder / "labels.csv").exists():
        pytest.skip("no shrec11 meshes")
    rows = [line.split(",") for line in (folder / "labels.csv").read_text().split()[1:]]
    classes = ("cat", "pliers")
    files = [file for name in classes for file in [f for f, label in rows if label == name][:2]]
    rival = MeshSIFT(min_vertices=1000)
    distances = rival.compare([rival.describe(spem.read(folder / file, voxels=1000)) for file in files])
    np.fill_diagonal(distances, np.inf)
    np.testing.assert_array_equal(distances.argmin(axis=1), [1, 0, 3, 2])
