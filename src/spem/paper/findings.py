"""What an experiment finds: numbers, pictures, and claims of the paper set beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, get_args

from spem.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Verdict = Literal["holds", "differs", "not tested"]


@dataclass(frozen=True)
class Claim:
    """A statement of the paper beside what was measured.

    Parameters
    ----------
    statement
        What is claimed, in one sentence, with the place where it stands.
    paper
        The paper's value or words.
    ours
        What was measured, in words or numbers.
    verdict
        ``"holds"``, ``"differs"``, or ``"not tested"`` where the shapes it is about are absent.
    note
        Why it differs or was not tested; needed unless it holds.

    Raises
    ------
    ParameterError
        If a verdict is not one of the three, or one other than ``"holds"`` has no note.

    Examples
    --------
    >>> Claim("v grows with ρ (2.1).", "grows", "grows at 100 % of the nodes", "holds").verdict
    'holds'
    """

    statement: str
    paper: str
    ours: str
    verdict: Verdict
    note: str = ""

    def __post_init__(self) -> None:
        if self.verdict not in get_args(Verdict):
            msg = f"verdict={self.verdict!r} must be one of {', '.join(get_args(Verdict))}"
            raise ParameterError(msg)
        if self.verdict != "holds" and not self.note:
            msg = f"the claim {self.statement!r} {self.verdict}: say why in its note"
            raise ParameterError(msg)


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure with a name for its file and a caption.

    Parameters
    ----------
    name
        File name without its ending.
    figure
        The figure, made without pyplot.
    caption
        What is seen, in a sentence or two.
    """

    name: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Table:
    """Numbers in rows, as words.

    Parameters
    ----------
    caption
        What the table holds.
    head
        A title for each column.
    rows
        Cells, as many as there are titles; the first names the row.

    Raises
    ------
    ParameterError
        If a row has another number of cells.

    Examples
    --------
    >>> len(Table("Scores in percent.", ("code", "FT"), (("SPEM", "98.4"),)).rows)
    1
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.head):
                msg = f"the row {row} of the table {self.caption!r} needs {len(self.head)} cells"
                raise ParameterError(msg)


@dataclass(frozen=True, eq=False)
class Finding:
    """What one experiment found.

    Parameters
    ----------
    shapes
        Which shapes it was made on, and how they differ from the paper's.
    claims
        Statements of the paper beside what was measured.
    pictures
        The figures.
    tables
        Numbers in rows.
    numbers
        Everything measured, by name: plain numbers, words, lists, dictionaries and arrays.
    """

    shapes: str
    claims: tuple[Claim, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = field(default=(), kw_only=True)
    numbers: Mapping[str, Any] = field(default_factory=dict)


def judged(statement: str, paper: str, ours: str, holds: bool, *, note: str, tested: bool = True) -> Claim:
    """Return a claim whose verdict follows from a test.

    Parameters
    ----------
    statement, paper, ours
        As `Claim` has them.
    holds
        Whether what was measured agrees.
    note
        What to say where it does not, or where it was not tested; dropped where it holds.
    tested
        Whether the shapes that the claim is about were there.

    Examples
    --------
    >>> judged("Nine projections reach 80 % (5.4).", "80 %", "84.1 %", 84.1 >= 80, note="").verdict
    'holds'
    """
    if not tested:
        return Claim(statement, paper, ours, "not tested", note)
    return (
        Claim(statement, paper, ours, "holds", "")
        if holds
        else Claim(statement, paper, ours, "differs", note)
    )
