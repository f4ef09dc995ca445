"""Views of real shapes: they fit a first page, and agree with the library."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.codes.collection import encode_collection
from spem.codes.settings import Settings
from spem.server.arrays import pack_arrays
from spem.server.views import VIEWS
from spem.server.views.words import view_words

FILES = ("shrec11/T1.obj", "tari1000/obj9_1.png", "kimia216/Bone01.png")


@pytest.mark.data
@pytest.mark.parametrize("file", FILES)
def test_first_page_of_a_real_shape_is_small_and_right(data_dir, file):
    """Geometry and field take less than 1.5 MB, and fields in single precision are right to 1e-5."""
    shape = spem.read(data_dir / file, voxels=15_000)
    (_, geometry), (header, field) = (VIEWS[view](shape, {}) for view in ("geometry", "field"))
    assert len(pack_arrays({}, geometry)) + len(pack_arrays(header, field)) < 1.5e6
    sharp = spem.field(shape, field["rho"][[0, 31, 63]].astype(float))
    np.testing.assert_allclose(field["basis"] @ field["coefficients"][[0, 31, 63]].T, sharp, atol=1e-5)
    place = geometry["node"][geometry["contour_node" if shape.ndim == 2 else "vertex_node"]]
    rim = geometry["contour" if shape.ndim == 2 else "vertex"]
    assert np.abs(rim - place).max() < 4.0


@pytest.mark.data
def test_words_of_real_silhouettes_tell_like_ones_apart(data_dir):
    """Two bones share more words than a bone and a cat, and these have points on both."""
    files = ("kimia216/Bone01.png", "kimia216/Bone02.png", "tari1000/obj9_1.png")
    shapes = [spem.read(data_dir / file, voxels=3_000) for file in files]
    model = encode_collection(shapes, Settings(voxels=3_000)).model
    (alike, arrays), (other, _) = (view_words(shapes[0], shapes[i], model, {}) for i in (1, 2))
    assert alike["correlation"] > other["correlation"]
    assert len(arrays["query_points"]) > 4
    assert len(arrays["answer_points"]) > 4
