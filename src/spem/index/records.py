"""What an index holds: its models and rows, to be read, labelled, removed, exported and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from spem.codes.codes import Codes
from spem.codes.model import Model
from spem.errors import ModelError, ParameterError, ReadError
from spem.index import updates
from spem.index.annotations import annotated, labels_of
from spem.index.checking import Finding, check
from spem.index.exporting import codes_of, export, labelled_codes
from spem.index.filters import literal
from spem.index.models import ModelFacts
from spem.index.row import Row
from spem.index.schema import HEAVY, LIGHT
from spem.index.store import Store
from spem.retrieval.labels import read_labels


@dataclass(frozen=True, eq=False)
class Records:
    """The contents of an index.

    Parameters
    ----------
    store
        The database.
    """

    store: Store

    def models(self) -> tuple[ModelFacts, ...]:
        """Return what the index has of each model: digest, features, dimension, numbers."""
        facts = {record["digest"]: record for record in self.store.model_records()}
        return tuple(
            ModelFacts(
                digest,
                facts[digest]["features"],
                facts[digest]["ndim"],
                facts[digest]["n_code"],
                self.store.count(digest),
            )
            for digest in self.store.digests()
            if digest in facts
        )

    def digest(self, model: str | Model | Codes | None = None) -> str:
        """Return the digest of a model of the index.

        Parameters
        ----------
        model
            Its digest, or the model itself, or codes made with it; without it the only one.

        Raises
        ------
        ModelError
            When the index has no such model, or several and none is named.
        """
        made = model.model if isinstance(model, Codes) else model
        given = made.digest if isinstance(made, Model) else made
        if given is not None and self.store.is_open(given):
            return given
        known = self.store.digests()
        if given is None:
            if len(known) == 1:
                return known[0]
            several = f"{len(known)} models ({', '.join(known)})"
            msg = f"{self.store.address}: {several}; name one of them as the model (--model)"
            if not known:
                msg = f"{self.store.address}: an index without a shape; add some first"
            raise ModelError(msg)
        if given not in known:
            has = ", ".join(known) or "none"
            msg = f"model {given} is none of {self.store.address}, which has {has}; make both with one model"
            raise ModelError(msg)
        return given

    def model(self, digest: str | None = None) -> Model:
        """Return a model of the index; without a digest the only one.

        Raises
        ------
        ModelError
            When there is no such model, or several and none is named.
        """
        return self.store.load_model(self.digest(digest))

    def get(self, row_id: str, *, columns: Sequence[str] = HEAVY, model: str | None = None) -> Row:
        """Return one row, with its code, picture and shape.

        Raises
        ------
        ReadError
            When there is no such row.
        """
        where = f"id = {literal(row_id)}"
        found = self.store.rows(self.digest(model), where, columns=[*LIGHT, *columns], limit=1)
        if not found:
            msg = f"{self.store.address}: no shape {row_id}; see: spem index list {self.store.address}"
            raise ReadError(msg)
        return found[0]

    def rows(
        self,
        where: str | None = None,
        *,
        sort: str | None = None,
        descending: bool = False,
        limit: int | None = None,
        offset: int = 0,
        model: str | None = None,
    ) -> list[Row]:
        """Return the rows that a filter lets through, without codes, pictures and shapes.

        Parameters
        ----------
        where
            SQL over the columns, such as ``label = 'cat' AND metadata.site = 'Oslo'``.
        sort, descending
            Column that orders them, such as ``"name"``; without it they come as they lie.
        limit, offset
            Number of rows, and of those passed over.
        model
            Digest of the model, where there are several.

        Raises
        ------
        ParameterError
            When the filter or the order has no meaning.
        """
        digest = self.digest(model)
        return self.store.rows(digest, where, limit=limit, offset=offset, sort=sort, descending=descending)

    def count(self, where: str | None = None, *, model: str | None = None) -> int:
        """Return the number of rows that a filter lets through."""
        return self.store.count(self.digest(model), where)

    def find(self, names: Sequence[str], *, model: str | None = None) -> list[str]:
        """Return the ids of rows by their ids or paths; a file that holds several shapes has several.

        Raises
        ------
        ReadError
            When one is no shape of the index.
        """
        return updates.ids_of(self.store, self.digest(model), names)

    def remove(
        self, ids: str | Sequence[str] | None = None, *, where: str | None = None, model: str | None = None
    ) -> int:
        """Remove rows by their ids or by a filter, and return how many there were."""
        digest = self.digest(model)
        if (ids is None) == (where is None):
            msg = "remove takes ids or a filter (where=...); give one of them"
            raise ParameterError(msg)
        if where is not None:
            return updates.remove_where(self.store, digest, where)
        return updates.remove(self.store, digest, [ids] if isinstance(ids, str) else list(ids or ()))

    def annotate(
        self,
        ids: str | Sequence[str] | None = None,
        *,
        where: str | None = None,
        label: str | None = None,
        metadata: Mapping[str, str | None] | None = None,
        model: str | None = None,
    ) -> int:
        """Give rows a label and metadata, and return how many changed.

        Parameters
        ----------
        ids, where
            The rows, by their ids or by a filter; all of them without either.
        label
            The label; an empty one takes theirs away.
        metadata
            Keys and values beside those that they have; a value None takes a key away.
        model
            Digest of the model, where there are several.
        """
        digest = self.digest(model)
        chosen = [ids] if isinstance(ids, str) else ids
        if chosen is not None and where is not None:
            msg = "annotate takes ids or a filter (where=...); give one of them, or neither for all"
            raise ParameterError(msg)
        changed = partial(annotated, label=label, metadata=metadata or {})
        return updates.annotate(self.store, digest, changed, ids=chosen, where=where)

    def label(
        self, labels: str | Path | Mapping[str, str], *, model: str | None = None
    ) -> tuple[int, list[str]]:
        """Label rows by a table of files and labels, and return how many changed and what fits no row.

        Parameters
        ----------
        labels
            A file as `spem.read_labels` takes it, or file → label.
        model
            Digest of the model, where there are several.
        """
        digest = self.digest(model)
        table = labels if isinstance(labels, Mapping) else read_labels(labels)
        given, unused = labels_of(self.store.rows(digest), table)
        return updates.annotate(self.store, digest, partial(_relabelled, given)), unused

    def codes(self, where: str | None = None, *, model: str | None = None) -> Codes:
        """Return the codes of rows, centred and of unit length, in order of name."""
        return codes_of(self.store, self.digest(model), where)

    def labelled_codes(
        self, where: str | None = None, *, model: str | None = None
    ) -> tuple[Codes, list[str]]:
        """Return codes as `codes` does, and the label of each, empty where there is none."""
        return labelled_codes(self.store, self.digest(model), where)

    def export(
        self,
        path: str | Path,
        *,
        where: str | None = None,
        with_codes: bool = False,
        model: str | None = None,
    ) -> int:
        """Write rows to a file and return how many: ``.csv``, ``.parquet``, or ``.spem`` for codes alone.

        Raises
        ------
        ParameterError
            When the file has another ending or cannot be written.
        """
        return export(self.store, self.digest(model), Path(path), where, with_codes=with_codes)

    def check(self, *, files: bool = False, repair: bool = False) -> tuple[Finding, ...]:
        """Read everything and return what is wrong.

        Parameters
        ----------
        files
            Whether the files that shapes came from are looked at too: gone, or changed.
        repair
            Whether rows that are damaged or doubled are removed.
        """
        return check(self.store, files=files, repair=repair)

    def __len__(self) -> int:
        return sum(self.store.count(digest) for digest in self.store.digests())


def _relabelled(labels: Mapping[str, str], row: Row) -> Row:
    """Return a row with its label of a table by id, where it has one."""
    return replace(row, label=labels.get(row.id, row.label))
