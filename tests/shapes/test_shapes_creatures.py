"""Collections of articulated creatures."""

from __future__ import annotations

import csv
from collections import Counter

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy import ndimage

from spem.errors import ParameterError
from spem.shapes.creatures import (
    collection,
    creature,
    creature_kinds,
    creature_mesh,
    write_collection,
)
from spem.shapes.poses import random_pose

KINDS = creature_kinds()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("ndim", "voxels"), [(2, 6000), (3, 15000)])
def test_creatures_meet_their_budget_in_one_piece(kind, ndim, voxels):
    """The number of nodes is within 6 % of the default budget, and all of them hang together."""
    shape = creature(kind, ndim=ndim, rng=np.random.default_rng(7))
    assert shape.ndim == ndim
    assert shape.name == kind
    assert abs(shape.n_nodes / voxels - 1) < 0.06
    assert ndimage.label(shape.mask)[1] == 1


def test_one_seed_is_one_creature_at_any_resolution():
    """Volumes at two resolutions agree, and two draws at one resolution are the same."""
    coarse, fine, again = (
        creature("dog", voxels=n, rng=np.random.default_rng(3)) for n in (4000, 16000, 16000)
    )
    assert fine.volume == pytest.approx(coarse.volume, rel=0.01)
    np.testing.assert_array_equal(fine.mask, again.mask)
    np.testing.assert_array_equal(fine.cuts.fraction, again.cuts.fraction)


def test_cuts_lie_on_the_outline():
    """The level is zero, to rounding, where the edges are cut."""
    shape = creature("octopus", spacing=0.02, rng=np.random.default_rng(5))
    body = random_pose("octopus", 2, np.random.default_rng(5))
    cuts = shape.cuts
    index = np.stack(np.unravel_index(cuts.voxel, shape.mask.shape), axis=1).astype(float)
    index[np.arange(len(cuts)), cuts.direction // 2] += np.where(cuts.direction % 2, 1, -1) * cuts.fraction
    points = np.asarray(shape.origin) + index * np.asarray(shape.spacing)
    clear = cuts.fraction > 2e-6
    np.testing.assert_allclose(body.level(points[clear], 1.0), 0, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_meshes_are_closed_and_oriented_outward(kind):
    """Every surface is watertight, in one piece, of positive volume and of the size asked for."""
    vertices, faces = creature_mesh(kind, np.random.default_rng(11), faces=1500)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume > 0
    assert len(faces) in (1499, 1500)


def test_mesh_and_volume_are_of_one_creature():
    """One seed gives the same body as a mesh and as a volume."""
    vertices, faces = creature_mesh("hand", np.random.default_rng(2))
    shape = creature("hand", ndim=3, rng=np.random.default_rng(2))
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(shape.volume, rel=0.03)
    np.testing.assert_allclose(vertices.min(axis=0), shape.points.min(axis=0), atol=2 * shape.spacing[0])


def test_a_collection_is_labelled_class_by_class():
    """As many shapes as asked for of each kind, each with its name and label."""
    pairs = collection(n_per_class=3, kinds=["ant", "crab"], voxels=1500, rng=np.random.default_rng(0))
    assert [label for _, label in pairs] == ["ant"] * 3 + ["crab"] * 3
    assert len({shape.name for shape, _ in pairs}) == 6
    assert len({shape.n_nodes for shape, _ in pairs if shape.name.startswith("ant")}) > 1


def test_written_collections_are_labelled_and_repeatable(tmp_path):
    """Images and meshes have a table each; the same seed writes the same bytes."""
    kinds = ["fish", "spider"]
    for run in ("one", "two"):
        rng = np.random.default_rng(4)
        folders = write_collection(tmp_path / run, n_per_class=2, kinds=kinds, rng=rng)
        assert [folder.name for folder in folders] == ["images", "meshes"]
    for folder in folders:
        twin = tmp_path / "one" / folder.name
        assert all(path.read_bytes() == (twin / path.name).read_bytes() for path in folder.iterdir())
        with (folder / "labels.csv").open() as file:
            rows = list(csv.DictReader(file))
        assert Counter(row["label"] for row in rows) == {"fish": 2, "spider": 2}
        assert {row["file"] for row in rows} | {"labels.csv"} == {path.name for path in folder.iterdir()}
    picture = np.asarray(Image.open(folders[0] / "fish_01.png"))
    assert picture.shape == (160, 160)
    assert set(picture[:4].ravel()) == {0}
    assert ((picture > 0) & (picture < 255)).any()
    assert trimesh.load(folders[1] / "spider_02.obj").is_watertight


def test_bad_arguments_are_refused():
    """Two sizes at once, a budget of nothing and unknown kinds are refused."""
    rng = np.random.default_rng(0)
    with pytest.raises(ParameterError, match=r"voxels = 10 and spacing = 0.1 are both given"):
        creature("ant", voxels=10, spacing=0.1, rng=rng)
    with pytest.raises(ParameterError, match="voxels must be at least 1, not 0"):
        creature("ant", voxels=0, rng=rng)
    with pytest.raises(ParameterError, match="faces must be at least 100, not 3"):
        creature_mesh("ant", rng, faces=3)
    with pytest.raises(ParameterError, match="kind must be one of"):
        collection(n_per_class=1, kinds=["unicorn"], rng=rng)
    with pytest.raises(ParameterError, match="n_per_class must be at least 1, not 0"):
        collection(n_per_class=0, rng=rng)
