"""MDS-CM-BOF: depth views of the canonical form, bags of their features, and clock matching."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ShapeError
from spem.rivals.canonical_form import canonical_form
from spem.rivals.clock_matching import clock_distances, count_words
from spem.rivals.depth_views import depth_views, upright
from spem.rivals.extra import require
from spem.rivals.view_sphere import geodesic_sphere
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.remeshing import decimate
from spem.shapes.shape import Shape

# Rows and columns of the cells of a SIFT descriptor, and directions in each.
_CELLS = (4, 4, 8)
# Features that the vocabulary is learnt of, for each word.
_SAMPLE_PER_WORD = 60


@dataclass(frozen=True, eq=False)
class ViewFeatures:
    """SIFT features of the views of one shape.

    Parameters
    ----------
    descriptors
        ``(n_features, 128)``, view after view.
    starts
        ``(n_views + 1,)`` where the features of each view start.
    """

    descriptors: NDArray[np.uint8]
    starts: NDArray[np.int64]


@dataclass(frozen=True)
class MdsCmBof:
    """Bags of SIFT words in 66 depth views of the canonical form, compared by clock matching.

    The publications: Z. Lian, A. Godil, X. Sun, H. Zhang, "Non-rigid 3D shape retrieval using
    multidimensional scaling and bag-of-features", ICIP 2010, 3181-3184; Z. Lian, A. Godil, X. Sun, J. Xiao,
    "CM-BOF: visual similarity-based 3D shape retrieval using clock matching and bag-of-features", Machine
    Vision and Applications 24 (2013) 1685-1704. Its run in Table 1 is that of Lian et al., SHREC'11.

    Deviations: the canonical form is that of all vertices where there are no more than `max_vertices`; its
    scaling starts from the classical one, which depends on distances alone, so a form may come out mirrored,
    and matching tries the 24 reflections of the axes beside the 24 rotations. The descriptors of a mirrored
    view are those of the view with their cells in mirrored order, which is what SIFT would give. The axes are
    those of the covariance of the area. SIFT is that of OpenCV, with its defaults, in place of VLFeat. Views
    have 128 pixels a side in place of 256: on a hundred shapes of SHREC'11 the first tier was the same.

    Time: 0.17 s a mesh of 250 vertices on one core, 3 s a mesh of 2,000 or more; to compare 600 shapes takes
    40 s, half of it for the words.

    Parameters
    ----------
    n_words
        Size of the vocabulary, learnt of the shapes that are compared.
    side
        Pixels along each side of a view.
    max_vertices
        Surfaces of more vertices are decimated to as many.
    seed
        Of the vocabulary.

    Examples
    --------
    >>> from spem.rivals.extra import has
    >>> from spem.shapes.synthetic import box
    >>> shapes = [box((1.0, 1.0, 1.0), 0.25), box((4.0, 1.0, 1.0), 0.25)]
    >>> rival = MdsCmBof(n_words=8, side=64)
    >>> bool(rival.compare([rival.describe(s) for s in shapes])[0, 1] > 0) if has("cv2") else True
    True
    """

    n_words: int = 1500
    side: int = 128
    max_vertices: int = 2000
    seed: int = 0

    @property
    def name(self) -> str:
        """Name in tables."""
        return "MDS-CM-BOF"

    def describe(self, shape: Shape) -> ViewFeatures:
        """Compute the SIFT features of the views of a shape's canonical form.

        Parameters
        ----------
        shape
            A shape of three dimensions.

        Raises
        ------
        MissingExtraError
            When opencv-python-headless is not installed.
        ShapeError
            When the shape has no surface, or SIFT finds nothing in its views.
        """
        form = canonical_form(decimate(boundary_surface(shape), self.max_vertices))
        found = view_features(depth_views(upright(form), geodesic_sphere(), self.side))
        if not len(found.descriptors):
            msg = f"{shape.name}: no features in its views of {self.side} pixels a side; use larger views"
            raise ShapeError(msg)
        return found

    def compare(self, descriptions: Sequence[ViewFeatures]) -> NDArray[np.float64]:
        """Count the words of all views and match the views of each two shapes.

        Parameters
        ----------
        descriptions
            What `describe` gave for each shape.

        Returns
        -------
        numpy.ndarray
            ``(n_shapes, n_shapes)`` distances in [0, 1].
        """
        words = learn_words([each.descriptors for each in descriptions], self.n_words, self.seed)
        plain = [count_words(nearest_words(each.descriptors, words), each.starts) for each in descriptions]
        other = [
            count_words(nearest_words(mirror(each.descriptors), words), each.starts) for each in descriptions
        ]
        return clock_distances(plain, other, len(words))


def view_features(views: NDArray[np.uint8]) -> ViewFeatures:
    """Find the SIFT features of images.

    Parameters
    ----------
    views
        ``(n_views, side, side)`` grey images.

    Raises
    ------
    MissingExtraError
        Without opencv-python-headless.
    """
    sift = require("cv2", "opencv-python-headless").SIFT_create()
    found = [sift.detectAndCompute(view, None)[1] for view in views]
    kept = [np.zeros((0, 128)) if each is None else each for each in found]
    starts = np.cumsum([0, *(len(each) for each in kept)])
    # OpenCV rounds descriptors to whole numbers up to 255.
    return ViewFeatures(np.concatenate(kept).astype(np.uint8), starts)


def mirror(descriptors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the SIFT descriptors of the same features in mirrored images.

    Across the direction of its keypoint a descriptor's cells change places, and its directions turn round.

    Examples
    --------
    >>> descriptor = np.arange(128, dtype=np.uint8)[None]
    >>> mirror(descriptor)[0, :8]
    array([ 96, 103, 102, 101, 100,  99,  98,  97], dtype=uint8)
    """
    cells = descriptors.reshape(-1, *_CELLS)[:, ::-1]
    return cells[..., -np.arange(_CELLS[2])].reshape(-1, np.prod(_CELLS))


def learn_words(descriptors: Sequence[NDArray[np.uint8]], n_words: int, seed: int) -> NDArray[np.float32]:
    """Learn a vocabulary by k-means of a random sample of the features of all shapes.

    Parameters
    ----------
    descriptors
        ``(n_features, 128)`` of each shape.
    n_words
        Number of words; fewer where there are fewer features.
    seed
        Of the sample and of k-means.

    Returns
    -------
    numpy.ndarray
        ``(n_words, 128)`` centres.

    Examples
    --------
    >>> learn_words([np.zeros((3, 128), np.uint8), np.full((2, 128), 9, np.uint8)], 5, 0).shape
    (2, 128)
    """
    from sklearn.cluster import MiniBatchKMeans

    features = np.concatenate(descriptors)
    rng = np.random.default_rng(seed)
    size = min(len(features), _SAMPLE_PER_WORD * n_words)
    sample = np.unique(features[rng.choice(len(features), size, replace=False)], axis=0).astype(np.float32)
    n_words = min(n_words, len(sample))
    kmeans = MiniBatchKMeans(n_words, random_state=seed, n_init=1, batch_size=8192, max_iter=20)
    return np.asarray(kmeans.fit(sample).cluster_centers_, np.float32)


def nearest_words(descriptors: NDArray[np.uint8], words: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the word nearest to each descriptor.

    Examples
    --------
    >>> words = np.array([[0.0] * 128, [9.0] * 128], np.float32)
    >>> nearest_words(np.full((1, 128), 7, np.uint8), words)
    array([1])
    """
    offsets = (words**2).sum(axis=1) / 2
    return np.asarray(np.argmin(offsets - descriptors.astype(np.float32) @ words.T, axis=1))
