"""Where the shapes of the experiments come from."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from spem.errors import ParameterError
from spem.paper.data import INNER_RADIUS, Data, duplicate_names


@pytest.mark.parametrize("kind", ["hand", "cat", "human"])
def test_silhouettes_without_data_are_made_here(kind):
    """In pixels, with the inner radius asked for, and said to be no real ones."""
    found = Data().silhouettes(kind, 2)
    assert not found.real
    assert "made here" in found.source
    assert [shape.spacing for shape in found.shapes] == [(1.0, 1.0)] * 2
    again = Data().silhouettes(kind, 2)
    assert all((a.mask == b.mask).all() for a, b in zip(found.shapes, again.shapes, strict=True))


def test_collection_without_data_is_creatures():
    """As many of each class as asked for."""
    found = Data().collection("tari1000", ndim=2, per_class=2, voxels=300)
    assert not found.real
    assert len(found.items) == len(found.labels) == 2 * len(set(found.labels))


def test_absent_collections_are_told_with_what_to_do(tmp_path):
    """Whether a folder was given or not."""
    assert Data().absent("shrec11").startswith("no folder of shapes was given; SHREC'11")
    assert Data(tmp_path).absent("tari1000").startswith(f"{tmp_path} has no tari1000; ")
    assert "--data" in Data().absent("tosca_cats")


@pytest.mark.data
def test_real_silhouettes(data_dir):
    """Of the class, in order, at the inner radius of the paper, in pixels."""
    found = Data(data_dir).silhouettes("hand", 2)
    assert found.real
    assert [shape.name for shape in found.shapes] == ["obj11_1", "obj11_2"]
    assert all(0.9 < max(shape.spacing) / min(shape.spacing) < 1.1 for shape in found.shapes)
    with pytest.raises(ParameterError, match="21 silhouettes of a hand were asked for; tari1000 has 20"):
        Data(data_dir).silhouettes("hand", 21)
    assert INNER_RADIUS == 20


@pytest.mark.data
def test_duplicates_are_duplicates(data_dir):
    """Each file named has the pixels of an earlier one of its class."""
    folder = data_dir / "tari1000"
    for name in duplicate_names():
        label = name.partition("_")[0]
        earlier = [f"{label}_{i}.png" for i in range(1, int(name.partition("_")[2][:-4]))]
        pixels = np.asarray(Image.open(folder / name))
        assert any(np.array_equal(np.asarray(Image.open(folder / other)), pixels) for other in earlier), name


@pytest.mark.data
def test_real_collection_has_its_classes(data_dir):
    """Some of each, or all."""
    few = Data(data_dir).collection("shrec11", ndim=3, per_class=2)
    assert (few.name, len(few.items), len(set(few.labels))) == ("shrec11", 60, 30)
    assert len(Data(data_dir).collection("tari1000", ndim=2).items) == 1000
