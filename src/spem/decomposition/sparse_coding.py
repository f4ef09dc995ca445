"""Non-negative sparse coding (4.3) as a scikit-learn estimator."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Self

import numpy as np
import scipy.sparse
from numpy.random import RandomState
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from spem.decomposition.coding_descent import encode
from spem.decomposition.coding_search import RULES, Rule, Search, row_squares
from spem.errors import ParameterError

# The largest sample entry: its square must neither underflow nor, summed over all, overflow.
_LOWEST, _HIGHEST = 1e-140, 1e150


def largest_sparsity(X: Any) -> float:
    """Return the λ at and above which all codes of (4.3) vanish: the largest norm of a sample.

    A code a·y − λ of sample y on an atom a of the unit ball can be positive only below ‖y‖.

    Examples
    --------
    >>> largest_sparsity(np.array([[3.0, 4.0], [1.0, 0.0]]))
    5.0
    """
    return float(np.sqrt(row_squares(X).max(initial=0.0)))


def fit_counts(
    X: ArrayLike,
    counts: Iterable[int],
    sparsity: float = 0.0,
    *,
    n_init: int = 4,
    max_iter: int = 500,
    tol: float = 1e-5,
    random_state: int | None = None,
) -> Iterator[NonnegativeSparseCoding]:
    """Fit a coder for each of several numbers of components, one at a time.

    Each fit starts from the atoms of the one before, and from others, so that `objective_` falls.

    Parameters
    ----------
    X
        ``(n_samples, n_features)`` samples.
    counts
        Numbers of components, ascending.
    sparsity, n_init, max_iter, tol, random_state
        See `NonnegativeSparseCoding`.

    Examples
    --------
    >>> X = np.array([[2.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    >>> [round(coder.objective_, 6) for coder in fit_counts(X, [1, 2])]
    [4.5, 0.0]
    """
    known = None
    for count in counts:
        coder = NonnegativeSparseCoding(
            count,
            sparsity,
            init="farthest" if known is None else known,
            n_init=n_init,
            max_iter=max_iter,
            tol=tol,
            random_state=random_state,
        )
        known = coder.fit(X).components_
        yield coder


class NonnegativeSparseCoding(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Few non-negative atoms of the unit ball, and sparse non-negative codes on them (4.3).

    Minimises ½‖X − CD‖² + λ ΣC over codes C ≥ 0 and atoms D ≥ 0 with rows of norm at most 1; with Y = Xᵀ,
    A = Dᵀ and S = Cᵀ this is (4.3): `components_` are the atoms, Aᵀ, where `Parts.components` is S and
    `Parts.basis` Aᵀ. λ is absolute here, and relative in `spem.parts`. λ = 0 is non-negative matrix
    factorisation.

    Parameters
    ----------
    n_components
        Number k of atoms.
    sparsity
        λ, in the unit of the samples' norms; `largest_sparsity` is the limit at which all codes vanish.
    init
        How starts are chosen, ``"farthest"``, ``"k-means++"`` or ``"random"`` (see `Search`), or
        ``(≤ k, n_features)`` atoms to start from, such as those of a smaller k; missing ones are added as by
        ``"farthest"``.
    n_init
        Number of starts, compared on a sample of the data; one if `init` has all atoms.
    max_iter
        Most outer iterations, on a sample or on all data.
    tol
        Share of the objective by which five outer iterations must lower it to go on.
    random_state
        Seed or `RandomState` of the starts.

    Attributes
    ----------
    components_
        ``(k, n_features)`` atoms D, of unit norm.
    objective_
        Objective of the codes that `fit_transform` returns.
    objective_path_
        ``(n_iter_,)`` objective after each outer iteration on all data; never rises.
    reconstruction_err_
        ‖X − CD‖.
    n_iter_
        Number of outer iterations on all data.
    converged_
        Whether they met `tol` within `max_iter`.
    n_active_
        Number of atoms that any sample uses; fewer than k where λ leaves nothing for another one.
    n_features_in_
        Number of features seen by `fit`.

    Examples
    --------
    >>> X = np.array([[2.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    >>> coder = NonnegativeSparseCoding(2, sparsity=0.5, random_state=0)
    >>> coder.fit_transform(X).round(6)[:, np.argsort(coder.components_[:, 1])]
    array([[1.5, 0. ],
           [3.5, 0. ],
           [0. , 2.5]])
    """

    def __init__(
        self,
        n_components: int = 8,
        sparsity: float = 0.0,
        *,
        init: Rule | ArrayLike = "farthest",
        n_init: int = 4,
        max_iter: int = 500,
        tol: float = 1e-8,
        random_state: int | RandomState | None = None,
    ) -> None:
        self.n_components = n_components
        self.sparsity = sparsity
        self.init = init
        self.n_init = n_init
        self.max_iter = max_iter
        self.tol = tol
        self.random_state = random_state

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Find atoms for the samples ``X`` of shape ``(n_samples, n_features)``; `y` is ignored."""
        self.fit_transform(X)
        return self

    def fit_transform(self, X: ArrayLike, y: Any = None) -> NDArray[np.float64]:
        """Find atoms and return the codes ``(n_samples, k)`` of the samples; `y` is ignored."""
        samples = self._samples(X, reset=True)
        self._check_parameters(samples)
        known, rule = self._known(samples.shape[1])
        search = Search(rule, self.n_init, self.max_iter, self.tol)
        random = check_random_state(self.random_state)
        coding = search.run(samples, self.n_components, known, self.sparsity, random)
        self.components_ = coding.atoms
        self.n_active_ = int(coding.codes.any(axis=0).sum())
        self.objective_path_ = coding.path
        self.objective_ = float(coding.path[-1])
        self.n_iter_ = len(coding.path)
        self.converged_ = coding.converged
        penalty = self.sparsity * coding.codes.sum()
        self.reconstruction_err_ = float(np.sqrt(max(2 * (self.objective_ - penalty), 0)))
        return coding.codes

    def transform(self, X: ArrayLike) -> NDArray[np.float64]:
        """Return the codes ``(n_samples, k)`` of samples: the exact non-negative lasso on the atoms."""
        check_is_fitted(self)
        return encode(self._samples(X, reset=False), self.components_, self.sparsity)

    def inverse_transform(self, codes: ArrayLike) -> NDArray[np.float64]:
        """Return the samples ``(n_samples, n_features)`` that codes ``(n_samples, k)`` stand for, CD."""
        check_is_fitted(self)
        given: Any = codes
        C = np.asarray(given.toarray() if scipy.sparse.issparse(given) else given, np.float64)
        k = len(self.components_)
        if C.ndim != 2 or C.shape[1] != k:
            msg = f"codes have the shape {C.shape}; expected (n_samples, {k}), as transform returns them"
            raise ParameterError(msg)
        return np.asarray(C @ self.components_)

    def _known(self, n_features: int) -> tuple[NDArray[np.float64], Rule]:
        """Return the atoms to start from and the rule by which the others are chosen."""
        if isinstance(self.init, str):
            if self.init not in RULES:
                msg = f"init={self.init!r}: expected one of {', '.join(map(repr, RULES))}, or atoms"
                raise ParameterError(msg)
            return np.empty((0, n_features)), self.init
        atoms = np.asarray(self.init, np.float64)
        fits = atoms.ndim == 2 and len(atoms) <= self.n_components and atoms.shape[1] == n_features
        if not fits or not np.isfinite(atoms).all() or (atoms < 0).any():
            msg = (
                f"init has the shape {atoms.shape}; expected finite atoms from 0 on, "
                f"of shape (≤ {self.n_components}, {n_features})"
            )
            raise ParameterError(msg)
        return atoms / np.maximum(np.linalg.norm(atoms, axis=1, keepdims=True), 1), "farthest"

    def _samples(self, X: ArrayLike, *, reset: bool) -> Any:
        """Check samples; return a float64 array or CSR matrix."""
        samples = validate_data(
            self, X, accept_sparse="csr", dtype=np.float64, ensure_all_finite=False, reset=reset
        )
        data = samples.data if scipy.sparse.issparse(samples) else samples
        low, high = (data.min(), data.max()) if data.size else (0.0, 0.0)
        if low >= 0 and high < np.inf:
            return samples
        if low < 0:
            msg = f"Negative values in data passed to X: {low:g}; expected finite numbers from 0 on"
        else:
            what = "NaN" if np.isnan(low) else "inf"
            msg = f"X contains {what}; expected finite numbers from 0 on"
        raise ParameterError(msg)

    def _check_parameters(self, samples: Any) -> None:
        """Check the parameters against the samples."""
        n, p = samples.shape
        k: Any = self.n_components
        weight: Any = self.sparsity
        if not (isinstance(k, int | np.integer) and 1 <= k <= min(n, p)):
            msg = f"n_components={k}: expected 1 to {min(n, p)}, no more than n_samples={n} or n_features={p}"
            raise ParameterError(msg)
        if not isinstance(weight, int | float | np.number) or not 0 <= weight < np.inf:
            msg = f"sparsity={weight!r}: expected a finite number from 0 on"
            raise ParameterError(msg)
        highest = float(samples.max())
        if highest and not _LOWEST <= highest <= _HIGHEST / np.sqrt(n * p):
            msg = f"the largest number of X is {highest:g}; squares leave the range of float64, scale X"
            raise ParameterError(msg)
        largest = largest_sparsity(samples)
        if self.sparsity > 0 and self.sparsity >= largest:
            msg = (
                f"sparsity={self.sparsity:g}: all codes vanish; "
                f"expected less than {largest:.6g}, the largest norm of a sample"
            )
            raise ParameterError(msg)
        kinds: tuple[tuple[str, Any, Any, int, str], ...] = (
            ("n_init", self.n_init, int | np.integer, 1, "a whole number, "),
            ("max_iter", self.max_iter, int | np.integer, 1, "a whole number, "),
            ("tol", self.tol, int | float | np.number, 0, ""),
        )
        for name, value, kind, least, what in kinds:
            if not isinstance(value, kind) or not value >= least:
                msg = f"{name}={value!r}: expected {what}at least {least}"
                raise ParameterError(msg)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.positive_only = True
        tags.input_tags.sparse = True
        return tags

    @property
    def _n_features_out(self) -> int:
        return len(self.components_)
