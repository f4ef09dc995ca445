"""Claims and what is found."""

from __future__ import annotations

import pytest

from spem.errors import ParameterError
from spem.paper.findings import Claim, Table, judged


def test_a_claim_that_does_not_hold_needs_an_explanation():
    """Whether it differs or was not tested."""
    with pytest.raises(ParameterError, match="say why in its note"):
        Claim("a", "b", "c", "differs")
    with pytest.raises(ParameterError, match="say why in its note"):
        judged("a", "b", "c", True, note="", tested=False)


def test_a_verdict_is_one_of_three():
    """Anything else is refused."""
    with pytest.raises(ParameterError, match="holds, differs, not tested"):
        Claim("a", "b", "c", "maybe", "so")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("holds", "tested", "verdict", "note"),
    [(True, True, "holds", ""), (False, True, "differs", "why"), (True, False, "not tested", "why")],
)
def test_the_verdict_follows_from_the_test(holds, tested, verdict, note):
    """The note is kept where the claim does not hold."""
    claim = judged("a", "b", "c", holds, note="why", tested=tested)
    assert (claim.verdict, claim.note) == (verdict, note)


def test_rows_of_a_table_have_a_cell_for_each_title():
    """A short row is refused."""
    with pytest.raises(ParameterError, match="needs 2 cells"):
        Table("t", ("a", "b"), (("1",),))
