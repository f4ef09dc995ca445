"""Node features of kind "sources": sizes, invariance, holes, small shapes, what is refused, real shapes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spem.codes.settings import Settings
from spem.codes.source_features import N_PATCHES, source_features
from spem.codes.vlad import VLAD
from spem.errors import ParameterError, ShapeError
from spem.retrieval.evaluation import evaluate
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, disk, star_polygon

SETTINGS = Settings(features="spem", n_maps=44)


def test_one_band_with_a_row_for_each_arc() -> None:
    """A silhouette has a hundred arcs and their mirror images, of as many values as asked for, in float32."""
    (band,) = source_features(disk(1.0, 0.03), SETTINGS)
    assert band.shape == (2 * N_PATCHES, 44)
    (plain,) = source_features(disk(1.0, 0.03), SETTINGS, mirrored=False)
    assert np.array_equal(band[:N_PATCHES], plain)
    assert band.dtype == np.float32
    assert np.isfinite(band).all()


def test_units_and_place_change_nothing() -> None:
    """The same silhouette in another unit and place has the same features."""
    shape = star_polygon(7, 2)
    moved = replace(shape, spacing=tuple(3 * h for h in shape.spacing), origin=(5.0, -7.0))
    assert np.allclose(source_features(shape, SETTINGS), source_features(moved, SETTINGS), atol=1e-4)


def test_reflections_have_the_same_features() -> None:
    """What all arcs of a shape see together is what those of its mirror image see; without them it is not."""
    mask = np.ones((40, 28), bool)
    mask[:18, :12] = mask[30:, 20:] = False
    mask[:4] = False
    shape, mirror = Shape.from_mask(mask), Shape.from_mask(mask[:, ::-1])
    both = [source_features(each, SETTINGS)[0].mean(axis=0) for each in (shape, mirror)]
    alone = [source_features(each, SETTINGS, mirrored=False)[0].mean(axis=0) for each in (shape, mirror)]
    assert np.linalg.norm(both[0] - both[1]) < 0.5 * np.linalg.norm(alone[0] - alone[1])


def test_holes_are_boundary_of_no_arc() -> None:
    """Arcs are those of the outer contour, in number its share, and see the hole as boundary."""
    (band,) = source_features(annulus(0.5, 1.0, 0.02), SETTINGS)
    assert abs(len(band) / 2 - N_PATCHES * 2 / 3) < 4
    (filled,) = source_features(disk(1.0, 0.02), SETTINGS)
    assert np.abs(band.mean(axis=0) - filled.mean(axis=0)).max() > 0.02


@pytest.mark.parametrize("holes", [60, 98, 169])
def test_a_sieve_has_features(holes: int) -> None:
    """With more holes than arcs, or nearly so, the outer contour still has arcs of its own."""
    mask = np.ones((105, 105), bool)
    for hole in range(holes):
        mask[3 + 8 * (hole // 13), 3 + 8 * (hole % 13)] = False
    (band,) = source_features(Shape.from_mask(mask), SETTINGS)
    assert len(band) / 2 > N_PATCHES / 2
    assert np.isfinite(band).all()


@pytest.mark.parametrize("mask", [np.ones((1, 1)), np.ones((1, 2)), np.ones((2, 2)), np.ones((1, 300))])
def test_the_smallest_shapes_have_features(mask: np.ndarray) -> None:
    """A single pixel, two, four and a line have finite features."""
    (band,) = source_features(Shape.from_mask(mask), SETTINGS)
    assert 4 <= len(band) / 2 <= N_PATCHES
    assert np.isfinite(band).all()


def test_the_paper_s_boundary_works_too() -> None:
    """With v = 1 on outside pixels there are features as well."""
    (band,) = source_features(star_polygon(5, 2), replace(SETTINGS, boundary="voxel"))
    assert np.isfinite(band).all()


def test_bad_input_is_refused() -> None:
    """Solids and more values than bins are refused."""
    with pytest.raises(ShapeError, match="'sources' are of silhouettes; this shape has 3 dimensions"):
        source_features(ball(1.0, 0.25), SETTINGS)
    with pytest.raises(ParameterError, match="expected at least 1 and at most one for each bin"):
        source_features(disk(1.0, 0.1), replace(SETTINGS, n_maps=600, n_rho=600))


@pytest.mark.data
def test_real_silhouettes_are_found(data_dir: Path) -> None:
    """Eight silhouettes of each of five classes of tari1000 are found among each other."""
    folder = data_dir / "tari1000"
    if not folder.is_dir():
        pytest.skip("tari1000 is absent")
    names = [(f"obj{label}", i) for label in (1, 9, 11, 20, 40) for i in range(7, 15)]
    bands = [source_features(read(folder / f"{label}_{i}.png"), SETTINGS) for label, i in names]
    codes = VLAD(32, moments=1, nodes_per_shape=40, random_state=0).fit_transform(bands)
    found = evaluate(1 - np.corrcoef(codes), [label for label, _ in names])
    assert found.mean()["NN"] > 95
    assert found.mean()["FT"] > 80
