"""MDS-CM-BOF: mirrored descriptors, turned shapes, real ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spem.errors import MissingExtraError, ShapeError
from spem.retrieval.evaluation import evaluate
from spem.rivals.depth_views import depth_views
from spem.rivals.mds_cm_bof import (
    MdsCmBof,
    ViewFeatures,
    learn_words,
    mirror,
    nearest_words,
    view_features,
)
from spem.rivals.view_sphere import geodesic_sphere
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.synthetic import box, disk

pytest.importorskip("cv2")
trimesh = pytest.importorskip("trimesh")


def tube(bumps: float, turn: np.ndarray | None = None) -> Shape:
    """A bent tube with a bump, as a shape with a surface."""
    mesh = trimesh.creation.icosphere(2)
    x, y, z = np.asarray(mesh.vertices).T
    swell = 1 + bumps * np.exp(-8 * ((x - 0.6) ** 2 + (y - 0.5) ** 2))
    points = np.stack([3 * x, y * swell + 0.3 * x**2, 0.6 * z + 0.2 * x * y], axis=1)
    points = points if turn is None else points @ turn.T
    surface = Surface(points, np.asarray(mesh.faces, np.int64))
    return replace(box((1.0, 1.0, 1.0), 0.5), surface=surface)


def test_mirrored_descriptors_are_those_of_mirrored_images() -> None:
    """Most features of a mirrored view have a mirrored descriptor of the view, nearly to rounding."""
    corners = np.random.default_rng(0).uniform(-0.6, 0.6, (36, 3))
    views = depth_views(Surface(corners, np.arange(36).reshape(12, 3)), geodesic_sphere()[:4], 96)
    plain, flipped = view_features(views), view_features(np.ascontiguousarray(views[:, :, ::-1]))
    wanted = flipped.descriptors.astype(float)
    found, unturned = (
        np.median(np.linalg.norm(each[:, None].astype(float) - wanted, axis=2).min(axis=1))
        for each in (mirror(plain.descriptors), plain.descriptors)
    )
    # Descriptors have length 512.
    assert found < 40
    assert unturned > 200
    assert np.array_equal(mirror(mirror(plain.descriptors)), plain.descriptors)


def test_distances_do_not_change_with_a_quarter_turn() -> None:
    """A turned shape and a mirrored one are far nearer to the shape than another shape is."""
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    rival = MdsCmBof(n_words=100, side=64)
    shapes = tube(0.8), tube(0.8, quarter), tube(0.8, -quarter), tube(0.0)
    found = rival.compare([rival.describe(shape) for shape in shapes])
    assert found[0, 1:3].max() < 0.4 * found[0, 3]
    assert not found.diagonal().any()


def test_the_same_shapes_give_the_same_distances() -> None:
    """Describing and comparing twice agree to the last bit."""
    rival = MdsCmBof(n_words=20, side=32)
    first, second = (rival.compare([rival.describe(tube(b)) for b in (0.0, 0.8)]) for _ in range(2))
    assert np.array_equal(first, second)


def test_words_are_no_more_than_features() -> None:
    """A vocabulary of few features has a word for each that is distinct."""
    descriptors = np.arange(5 * 128, dtype=np.uint8).reshape(5, 128) % 100
    words = learn_words([descriptors, descriptors[:2]], 1500, 0)
    assert len(words) <= 5
    assert nearest_words(descriptors, words).max() < len(words)


def test_a_silhouette_has_no_views() -> None:
    """A shape of two dimensions is refused."""
    with pytest.raises(ShapeError, match="of shapes of 3 dimensions, this one has 2"):
        MdsCmBof().describe(disk(3.0, 1.0))


def test_views_without_features_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where SIFT finds nothing, the message names the shape and the size of its views."""
    nothing = ViewFeatures(np.zeros((0, 128), np.uint8), np.zeros(67, np.int64))
    monkeypatch.setattr("spem.rivals.mds_cm_bof.view_features", lambda _: nothing)
    with pytest.raises(ShapeError, match="no features in its views of 32 pixels"):
        MdsCmBof(side=32).describe(tube(0.8))


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without OpenCV the message says what to install."""
    monkeypatch.setattr("spem.rivals.extra.has", lambda module: module != "cv2")
    with pytest.raises(MissingExtraError, match="opencv-python-headless; install spem"):
        MdsCmBof(side=32).describe(tube(0.8))


@pytest.mark.data
def test_poses_of_real_shapes_are_nearest_to_each_other(data_dir: Path) -> None:
    """Of three classes of SHREC'11, every shape has one of its own class for its nearest neighbour."""
    rows = [line.split(",") for line in (data_dir / "shrec11" / "labels.csv").read_text().split()[1:]]
    kinds = {"ants": [], "hand": [], "snake": []}
    for file, label in rows:
        if label in kinds and len(kinds[label]) < 2:
            kinds[label].append(file)
    rival = MdsCmBof(n_words=200, side=96)
    shapes = [read(data_dir / "shrec11" / file, voxels=500) for files in kinds.values() for file in files]
    distances = rival.compare([rival.describe(shape) for shape in shapes])
    assert evaluate(distances, [kind for kind in kinds for _ in range(2)]).mean()["NN"] == 100
