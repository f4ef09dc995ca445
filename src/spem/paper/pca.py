"""The reductions of section 4.2 measured against one another on poses of one body."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from spem.api.fields import sweep
from spem.paper.agreement import SAME, Agreement, agreement
from spem.paper.findings import Claim, judged
from spem.paper.poses import Poses, fields_at
from spem.paper.reductions import METHODS, STARTED

LINEAR = "PCA (SPEM)"
_RTOL = 1e-10


def measure(poses: Poses, n_components: int, n_rho: int = 64) -> dict[str, Agreement]:
    """Reduce the fields of each pose by each method, by itself, and compare at corresponding points.

    Methods that start from chance do so from the same numbers in all poses, which favours them, and, under
    the name that ends in ``own starts``, from other numbers in each.

    Examples
    --------
    >>> from spem.paper.poses import load_poses
    >>> from spem.paper.data import Data
    >>> [poses] = load_poses(Data(quick=True), n_inside=60, n_marks=2)
    >>> len(measure(poses, 2, n_rho=8))
    10
    """
    fields = [sweep(shape, n_rho=n_rho, rtol=_RTOL) for shape in poses.shapes]
    rows = [np.asarray(field.fields(), np.float64) for field in fields]
    wanted = [fields_at(field, points) for field, points in zip(fields, poses.inside, strict=True)]
    pairs = list(zip(rows, wanted, strict=True))
    found = {}
    for name, reduce in METHODS.items():
        same = [reduce(known, asked, n_components, np.random.default_rng(0)) for known, asked in pairs]
        found[name] = agreement(same)
        if name in STARTED:
            starts = [np.random.default_rng(i) for i in range(1, len(pairs) + 1)]
            own = [reduce(*pair, n_components, rng) for pair, rng in zip(pairs, starts, strict=True)]
            found[f"{name}, own starts"] = agreement(own)
    return found


def judge(
    statement: str,
    rivals: tuple[str, ...],
    found: Mapping[str, Mapping[str, Agreement]],
    why: str,
    missing: str,
) -> Claim:
    """Judge whether PCA is more consistent, in the order that it gives, than all variants of a rival.

    Parameters
    ----------
    statement
        What the paper claims.
    rivals
        Names of the variants.
    found
        By set of poses and method.
    why
        What to say where it does not hold.
    missing
        Which collections are absent; empty where none is.

    Examples
    --------
    >>> same, less = (Agreement(*3 * [np.full((1, 6), r)]) for r in (0.95, 0.8))
    >>> judge("PCA leads.", ("ICA",), {"cats": {LINEAR: same, "ICA": less}}, "", "").ours
    'mean correlation (how many above 0.9): cats: PCA (SPEM) 0.95 (6), ICA 0.80 (0)'
    """
    told, holds = [], True
    for name, by in found.items():
        figures = [f"{key} {by[key].means[0]:.2f} ({by[key].n_same})" for key in (LINEAR, *rivals)]
        told.append(f"{name}: {', '.join(figures)}")
        holds &= all(
            by[LINEAR].means[0] > by[key].means[0] and by[LINEAR].n_same >= by[key].n_same for key in rivals
        )
    ours = f"mean correlation (how many above {SAME:g}): " + "; ".join(told)
    paper = "less consistent than linear PCA, as observed"
    return judged(statement, paper, ours, holds, note=missing or why, tested=not missing)
