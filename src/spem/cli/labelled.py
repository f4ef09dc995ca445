"""Codes with the class of each: of a file and a labels file, or of an index."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spem.cli.index import opened
from spem.cli.output import complain, counted
from spem.errors import LabelError, ParameterError

if TYPE_CHECKING:
    from spem.codes.codes import Codes

Collection = Annotated[
    str,
    typer.Argument(metavar="DB|CODES", help="Index: folder or address; or file that spem encode wrote."),
]


def load_labelled(
    collection: str, labels: Path | None, model: str | None = None, *, ignore_unlabelled: bool = False
) -> tuple[Codes, list[str]]:
    """Load codes with the class of each, and tell of labels that have no code.

    Parameters
    ----------
    collection
        An index, or a file of codes.
    labels
        File of labels; those of the index where None.
    model
        Digest, where the index has several models.
    ignore_unlabelled
        Leave out shapes that have no label.

    Raises
    ------
    LabelError
        When a shape has no label.
    ParameterError
        When a file of codes comes without labels, or with a model.
    """
    from spem.codes.codes import Codes

    if "://" not in collection and not Path(collection).is_dir():
        if labels is None or model is not None:
            msg = f"{collection}: a file of codes needs --labels FILE, and has one model; an index has labels"
            raise ParameterError(msg)
        return _of_table(Codes.load(collection), labels, ignore_unlabelled=ignore_unlabelled)
    codes, own = opened(collection).labelled_codes(model=model)
    if labels is not None:
        return _of_table(codes, labels, ignore_unlabelled=ignore_unlabelled)
    rows = [row for row, label in enumerate(own) if label]
    if len(rows) < len(own):
        missing = f"{counted(len(own) - len(rows), 'shape')} without a label"
        if not ignore_unlabelled or not rows:
            msg = f"{collection}: {missing}; --ignore-unlabelled leaves them out"
            raise LabelError(msg)
        complain(f"{missing} left out")
        codes = codes.take(rows)
    return codes, [own[row] for row in rows]


def _of_table(codes: Codes, labels: Path, *, ignore_unlabelled: bool) -> tuple[Codes, list[str]]:
    """Return codes with the classes that a file of labels gives them."""
    from spem.collections import row_keys
    from spem.retrieval.labels import labelled, match_labels, read_labels, unused_labels

    table = read_labels(labels)
    unused = unused_labels(row_keys(codes), table)
    if unused:
        complain(f"{labels}: {counted(len(unused), 'label')} without a code, such as {unused[0]}")
    if ignore_unlabelled:
        kept = codes.take(labelled(row_keys(codes), table))
        if len(kept) < len(codes):
            complain(f"{counted(len(codes) - len(kept), 'shape')} without a label left out")
        codes = kept
    return codes, match_labels(row_keys(codes), table)
