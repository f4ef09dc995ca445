"""Where sparse coding starts, and the search over starts on growing samples of the data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.random import RandomState
from numpy.typing import NDArray

from spem.decomposition.coding_descent import Coding, descend, encode, residual_squares

Rule = Literal["farthest", "k-means++", "random"]
RULES: tuple[Rule, ...] = ("farthest", "k-means++", "random")

# Samples of the first level, at least, and for each component; the growth from level to level.
_FIRST, _FIRST_EACH, _GROWTH = 1000, 32, 8
_COARSE_TOL = 1e-4


@dataclass(frozen=True)
class Search:
    """How starts are chosen and compared.

    All starts descend on a small sample of the data; the best goes on through larger samples to all data.

    Parameters
    ----------
    rule
        ``"farthest"``: the longest sample, then the one farthest from the rays of the atoms so far, again
        and again (from the second start on as ``"k-means++"``); ``"k-means++"``: samples drawn with their
        squared distance from these rays as weights; ``"random"``: with their squared norms.
    n_starts
        Number of starts.
    max_iter
        Most iterations on each level.
    tol
        Share of the objective that ends the descent on all data.
    """

    rule: Rule
    n_starts: int
    max_iter: int
    tol: float

    def run(
        self, X: Any, n_atoms: int, known: NDArray[np.float64], sparsity: float, random: RandomState
    ) -> Coding:
        """Return the best coding found of the samples ``X``, starting from known atoms and chosen ones."""
        order = random.permutation(X.shape[0])
        sizes = _levels(X.shape[0], n_atoms)
        starts = self.n_starts if len(known) < n_atoms else 1
        coarse = X[np.sort(order[: sizes[0]])]
        rules: list[Rule] = [self.rule] + (["k-means++"] if self.rule == "farthest" else [self.rule]) * (
            starts - 1
        )
        codings = [
            descend(
                coarse,
                start_atoms(coarse, n_atoms, rule, random, known),
                sparsity,
                self.max_iter,
                _COARSE_TOL,
            )
            for rule in rules
        ]
        best = min(codings, key=lambda coding: float(coding.path[-1]))
        for size in sizes[1:-1]:
            best = descend(X[np.sort(order[:size])], best.atoms, sparsity, self.max_iter, _COARSE_TOL)
        return descend(X, best.atoms, sparsity, self.max_iter, self.tol)


def start_atoms(
    X: Any, n_atoms: int, rule: Rule, random: RandomState, known: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return ``(n_atoms, n_features)`` known atoms followed by samples chosen by a rule, of unit norm.

    Parameters
    ----------
    X
        ``(n_samples, n_features)`` samples, an array or a CSR matrix.
    n_atoms
        Number of atoms in all.
    rule
        See `Search`; distances start from the span of the known atoms.
    random
        The generator.
    known
        Atoms to keep.
    """
    squares = row_squares(X)
    atoms = [] if known is None else list(known)
    distance = residual_squares(X, np.array(atoms), encode(X, np.array(atoms), 0.0)) if atoms else squares
    while len(atoms) < n_atoms:
        weight = squares if rule == "random" else distance
        index = int(np.argmax(weight)) if rule == "farthest" else _draw(weight, random)
        atom = _row(X, index) / np.sqrt(squares[index] or 1.0)
        distance = np.minimum(distance, np.maximum(squares - np.square(X @ atom), 0))
        atoms.append(atom)
    return np.array(atoms)


def row_squares(X: Any) -> NDArray[np.float64]:
    """Return ``(n_samples,)`` squared norms of samples, an array or a CSR matrix."""
    if scipy.sparse.issparse(X):
        return np.asarray(X.multiply(X).sum(axis=1)).ravel()
    return np.asarray(np.einsum("ij,ij->i", X, X))


def _levels(n_samples: int, n_atoms: int) -> list[int]:
    """Return growing numbers of samples, the last one all."""
    size = max(_FIRST, _FIRST_EACH * n_atoms)
    sizes = []
    while 2 * size < n_samples:
        sizes.append(size)
        size *= _GROWTH
    return [*(sizes or [n_samples]), n_samples]


def _draw(weight: NDArray[np.float64], random: RandomState) -> int:
    """Draw an index with these weights."""
    total = np.cumsum(weight)
    return min(int(np.searchsorted(total, random.uniform() * total[-1], "right")), len(weight) - 1)


def _row(X: Any, index: int) -> NDArray[np.float64]:
    """Return one sample as an array."""
    return np.asarray(X[[index]].toarray()[0] if scipy.sparse.issparse(X) else X[index])
