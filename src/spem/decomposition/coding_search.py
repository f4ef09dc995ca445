"""Where sparse coding starts, and the search over starts on growing samples of the data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.random import RandomState
from numpy.typing import NDArray

from spem.decomposition.coding_descent import Coding, descend, encode, objective, residual_squares

Rule = Literal["farthest", "k-means++", "random"]
RULES: tuple[Rule, ...] = ("farthest", "k-means++", "random")

# Samples of the first level, at least, and for each component; the growth from level to level.
_FIRST, _FIRST_EACH, _GROWTH = 1000, 32, 8
_COARSE_TOL = 1e-4
_ALIKE = 0.999  # cosine from which atoms count as the same


@dataclass(frozen=True)
class Search:
    """How starts are chosen and compared.

    Where some atoms are known, the second start ignores them. All starts descend on a small sample of the
    data, in float32; the one on whose atoms the next larger sample is coded best goes on, up to all data, in
    float64.

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
        unit = float(X.max()) or 1.0
        weight = sparsity / unit
        first, *between = _levels(X.shape[0], n_atoms)
        coarse = _sample(X, first, unit, random)
        starts = self._starts(coarse, n_atoms, known, random)
        found = _distinct([descend(coarse, atoms, weight, self.max_iter, _COARSE_TOL) for atoms in starts])
        for size in between:
            coarse = _sample(X, size, unit, random)
            best = _best(coarse, found, weight)
            found = [descend(coarse, best, weight, self.max_iter, _COARSE_TOL)]
        return descend(X, _best(X, found, sparsity), sparsity, self.max_iter, self.tol)

    def _starts(
        self, X: Any, n_atoms: int, known: NDArray[np.float64], random: RandomState
    ) -> list[NDArray[np.float64]]:
        """Return the atoms of each start."""
        starts = [start_atoms(X, n_atoms, self.rule, random, known)]
        if len(known) == n_atoms:
            return starts
        if len(known) and self.n_starts > 1:  # the known atoms may lie on the way to a poor minimum
            starts.append(start_atoms(X, n_atoms, self.rule, random))
        again: Rule = "k-means++" if self.rule == "farthest" else self.rule
        missing = range(self.n_starts - len(starts))
        return starts + [start_atoms(X, n_atoms, again, random, known) for _ in missing]


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
    distance = squares
    if known is not None and len(known):
        distance = residual_squares(X, known, encode(X, known, 0.0))
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
        return np.asarray(X.multiply(X).sum(axis=1), np.float64).ravel()
    return np.asarray(np.einsum("ij,ij->i", X, X), np.float64)


def _levels(n_samples: int, n_atoms: int) -> list[int]:
    """Return the growing numbers of samples to descend on before all of them."""
    size = max(_FIRST, _FIRST_EACH * n_atoms)
    sizes = [min(size, n_samples)]
    while 2 * _GROWTH * sizes[-1] <= n_samples:
        sizes.append(_GROWTH * sizes[-1])
    return sizes


def _sample(X: Any, size: int, unit: float, random: RandomState) -> Any:
    """Return samples, one of each stretch of the data, in multiples of a unit that float32 can hold."""
    n = X.shape[0]
    rows = np.unique(((np.arange(size) + random.uniform(size=size)) * (n / size)).astype(np.intp))
    rows = np.arange(n) if size == n else np.minimum(rows, n - 1)
    return (X[rows] / unit).astype(np.float32)


def _distinct(codings: list[Coding]) -> list[Coding]:
    """Return the codings without those that have the atoms of another one."""
    kept: list[Coding] = []
    for coding in codings:
        alike = ((coding.atoms @ other.atoms.T).max(axis=1).min() for other in kept)
        if max(alike, default=0.0) < _ALIKE:
            kept.append(coding)
    return kept


def _best(X: Any, found: list[Coding], sparsity: float) -> NDArray[np.float64]:
    """Return the atoms that these samples are best coded on; a small sample may prefer others."""
    if len(found) == 1:
        return found[0].atoms
    return min(
        (coding.atoms for coding in found),
        key=lambda atoms: objective(X, atoms, encode(X, atoms, sparsity), sparsity),
    )


def _draw(weight: NDArray[np.float64], random: RandomState) -> int:
    """Draw an index with these weights."""
    total = np.cumsum(weight)
    return min(int(np.searchsorted(total, random.uniform() * total[-1], "right")), len(weight) - 1)


def _row(X: Any, index: int) -> NDArray[np.float64]:
    """Return one sample as an array."""
    return np.asarray(X[[index]].toarray()[0] if scipy.sparse.issparse(X) else X[index], np.float64)
