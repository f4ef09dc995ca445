"""Choice of the number of parts: the error of (4.3) against k, and its elbow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.division import SPARSITY, check_division, limit_of
from spem.decomposition.measurements import Centre, Over, measurements
from spem.decomposition.sparse_coding import fit_counts
from spem.errors import ParameterError
from spem.fields.superposition.fields import SourceFields, require_fields

# The curve is read to three digits.
_TOL = 1e-4


@dataclass(frozen=True, eq=False)
class ErrorCurve:
    """What (4.3) leaves of a shape's measurements, against the number of parts.

    Parameters
    ----------
    counts
        ``(n,)`` numbers of parts k, 1 and up.
    errors
        ``(n,)`` objective of (4.3), error and penalty, as a share of that without any component.
    """

    counts: NDArray[np.int64]
    errors: NDArray[np.float64]

    @property
    def suggested(self) -> int:
        """The elbow: the k farthest below the chord from k = 2, the first division, to the last k."""
        counts, errors = self.counts[1:], self.errors[1:]
        fall = errors[0] - errors[-1] if errors.size else 0.0
        if errors.size < 3 or fall <= 0:
            return int(self.counts[min(1, self.counts.size - 1)])
        along = (counts - counts[0]) / (counts[-1] - counts[0])
        return int(counts[np.argmin(along + (errors - errors[-1]) / fall)])

    def __repr__(self) -> str:
        return (
            f"ErrorCurve(k 1 to {self.counts[-1]}, error {self.errors[0]:.3g} to {self.errors[-1]:.3g}, "
            f"suggested {self.suggested})"
        )


def error_curve(
    fields: SourceFields,
    most: int = 16,
    *,
    over: Over = "region",
    sparsity: float = SPARSITY,
    centre: Centre = "mean",
    n_init: int = 2,
    rng: np.random.Generator | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> ErrorCurve:
    """Decompose with 1, 2, … components, each time starting from the ones before and a new one too.

    Parameters
    ----------
    fields
        Fields of sources that cover the boundary, at one ρ.
    most
        The largest k, cut to the number of sources or nodes.
    over
        ``"region"`` or ``"boundary"``: what is divided.
    sparsity
        λ as for `region_parts`.
    centre
        What the log-fields are measured from.
    n_init
        Number of starts at each k, the first from the components before; the best is kept.
    rng
        Randomness of the new components; seed 0 by default.
    progress
        Called with k and `most` after each k.

    Raises
    ------
    ParameterError
        When an argument is out of its range, or all measurements are equal.

    Examples
    --------
    >>> import spem
    >>> star = np.zeros((19, 19), bool)
    >>> star[8:11] = star[:, 8:11] = True
    >>> error_curve(spem.source_fields(spem.sources(spem.Shape.from_mask(star)), np.inf), 10).suggested
    4
    """
    asked: Any = most
    if not isinstance(asked, int | np.integer) or asked < 1:
        msg = f"most={most!r}: expected a whole number of parts, at least 1"
        raise ParameterError(msg)
    require_fields(fields)
    most = min(most, fields.sources.n_sources, fields.sources.system.n_nodes)
    check_division(fields, most, sparsity)
    measured = measurements(fields, centre, over=over)
    samples = np.ascontiguousarray(measured.T if over == "region" else measured)
    weight = sparsity * limit_of(samples, fields)
    seed = int((rng or np.random.default_rng(0)).integers(2**31))
    whole = float(np.vdot(samples, samples)) / 2
    coders = fit_counts(samples, range(1, most + 1), weight, n_init=n_init, tol=_TOL, random_state=seed)
    errors: list[float] = []
    for coder in coders:
        errors.append(coder.objective_ / whole)
        if progress is not None:
            progress(coder.n_components, most)
    # a start from the components before cannot end above them but for the tolerance of the descent
    return ErrorCurve(np.arange(1, most + 1), np.minimum.accumulate(errors))
