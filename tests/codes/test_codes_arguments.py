"""Checks of single arguments."""

from __future__ import annotations

import numpy as np
import pytest

from spem.codes.arguments import finite_number, truth_value, whole_number
from spem.codes.workers import run_all
from spem.errors import ParameterError
from spem.retrieval.ranking import rank


@pytest.mark.parametrize("bad", [0, 6, 2.0, True, None, "2", np.float64(2)])
def test_what_is_no_whole_number_is_refused(bad):
    """Numbers out of range, floats, truth values and text are refused, with what came."""
    with pytest.raises(ParameterError, match=r"^n=.* must be a whole number from 1 to 5$"):
        whole_number("n", bad, 1, 5)


@pytest.mark.parametrize("bad", [float("nan"), float("-inf"), None, "1", False, 1j])
def test_what_is_no_finite_number_is_refused(bad):
    """NaN, infinities, text and truth values are refused."""
    with pytest.raises(ParameterError, match=r"^x=.* must be a finite number$"):
        finite_number("x", bad)


def test_what_is_no_truth_value_is_refused():
    """Zero and one are numbers."""
    with pytest.raises(ParameterError, match=r"^dark=1 must be True or False$"):
        truth_value("dark", 1)


def test_number_of_answers_and_of_processes_are_whole():
    """`k` and `n_jobs` are checked before anything is done."""
    with pytest.raises(ParameterError, match=r"k=1.5 must be a whole number of at least 1"):
        rank([0.0], None, 1.5)
    with pytest.raises(ParameterError, match=r"n_jobs=1.5 must be a whole number"):
        list(run_all(int, ["1"], 1.5))
