"""Where sparse coding starts: atoms taken from the samples."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.random import RandomState
from numpy.typing import NDArray

Start = Literal["farthest", "k-means++", "random"]
STARTS: tuple[Start, ...] = ("farthest", "k-means++", "random")


def start_atoms(
    X: Any, known: NDArray[np.float64], n_atoms: int, rule: Start, random: RandomState
) -> NDArray[np.float64]:
    """Choose samples, scaled to unit norm, as atoms beside those already known.

    Parameters
    ----------
    X
        ``(n_samples, n_features)`` samples, an array or a CSR matrix.
    known
        ``(≥ 0, n_features)`` atoms to keep as the first ones.
    n_atoms
        Number of atoms in all.
    rule
        ``"farthest"``: the sample farthest from the rays of the atoms so far (the first: the longest,
        or, from the second start on, one drawn as in k-means++); ``"k-means++"``: drawn with its squared
        distance from these rays as the weight; ``"random"``: drawn with its squared norm as the weight.
    random
        The generator.
    """
    squares = row_squares(X)
    distance = squares.copy()
    atoms = list(known)
    for atom in known:
        distance = np.minimum(distance, _ray_distance(X, atom, squares))
    while len(atoms) < n_atoms:
        weight = squares if rule == "random" else distance
        index = int(np.argmax(weight)) if rule == "farthest" else _draw(weight, random)
        atom = _row(X, index) / np.sqrt(squares[index] or 1.0)
        distance = np.minimum(distance, _ray_distance(X, atom, squares))
        atoms.append(atom)
    return np.array(atoms)


def _draw(weight: NDArray[np.float64], random: RandomState) -> int:
    """Draw an index with these weights."""
    total = np.cumsum(weight)
    return min(int(np.searchsorted(total, random.uniform() * total[-1], "right")), len(weight) - 1)


def _ray_distance(X: Any, atom: NDArray[np.float64], squares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return squared distances of samples from the ray of a unit atom."""
    return np.asarray(np.maximum(squares - np.square(X @ atom), 0))


def _row(X: Any, index: int) -> NDArray[np.float64]:
    """Return one sample as an array."""
    return np.asarray(X[[index]].toarray()[0] if scipy.sparse.issparse(X) else X[index])


def row_squares(X: Any) -> NDArray[np.float64]:
    """Return ``(n_samples,)`` squared norms of samples, an array or a CSR matrix."""
    if scipy.sparse.issparse(X):
        return np.asarray(X.multiply(X).sum(axis=1)).ravel()
    return np.asarray(np.einsum("ij,ij->i", X, X))
