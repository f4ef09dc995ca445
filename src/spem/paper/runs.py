"""Run experiments one after the other: each result is kept on disk, and made once."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import spem
from spem.codes.workers import one_line
from spem.errors import ParameterError
from spem.files import DAMAGE, write_whole
from spem.paper.catalogue import Item
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Table

RECORD = "finding.json"
_DPI = 130
_PNG = b"\x89PNG"


@dataclass(frozen=True)
class Record:
    """A finding as it is on disk.

    Parameters
    ----------
    item
        Name of the item.
    title
        Title of its page.
    folder
        Where its pictures are.
    shapes
        Which shapes it was made on.
    claims
        Statements of the paper beside what was measured.
    pictures
        File name and caption of each picture.
    tables
        Numbers in rows.
    numbers
        Everything measured, as JSON has it.
    made
        What it was made with: version, size, data; and the seconds that it took.
    failure
        Why there is no finding, where the experiment failed.
    """

    item: str
    title: str
    folder: Path
    shapes: str = ""
    claims: tuple[Claim, ...] = ()
    pictures: tuple[tuple[str, str], ...] = ()
    tables: tuple[Table, ...] = ()
    numbers: Mapping[str, Any] | None = None
    made: Mapping[str, Any] | None = None
    failure: str = ""


def run(
    items: Sequence[Item],
    data: Data,
    folder: Path,
    *,
    again: bool = False,
    tell: Callable[[Item, Record, bool], None] = lambda item, record, kept: None,
) -> list[Record]:
    """Make items one after the other; those made already with the same data and size are kept.

    Parameters
    ----------
    items
        What to make.
    data
        The shapes to make it on.
    folder
        Where to: a folder for each item.
    again
        Whether to make again what is there.
    tell
        Called after each item, with whether it was kept.

    Returns
    -------
    list
        One record for each item, failed ones among them.

    Raises
    ------
    ParameterError
        If the folder cannot be written to.
    """
    records = []
    for item in items:
        found = None if again else load(item, folder)
        kept = found is not None and _same(found, _origin(item, data))
        if found is None or not kept:
            found = _make(item, data, folder)
        records.append(found)
        tell(item, found, kept)
    return records


def load(item: Item, folder: Path) -> Record | None:
    """Read what is on disk of an item; None where there is nothing whole."""
    place = folder / item.name
    try:
        record = _record(item, place, json.loads((place / RECORD).read_text(encoding="utf-8")))
        whole = all(_is_png(place / file) for file, _ in record.pictures)
    except DAMAGE:
        return None
    return record if whole else None


def load_all(items: Iterable[Item], folder: Path) -> list[Record]:
    """Read what is on disk of each item that has something."""
    return [record for item in items if (record := load(item, folder)) is not None]


def _make(item: Item, data: Data, folder: Path) -> Record:
    """Run one experiment and write it down."""
    start = time.perf_counter()
    try:
        finding = item.make(data)
    except Exception as error:  # noqa: BLE001 - the rest of a long run goes on
        return Record(item.name, item.words[0], folder / item.name, failure=one_line(error))
    made = _origin(item, data) | {"seconds": round(time.perf_counter() - start, 2)}
    return write(item, finding, folder, made)


def write(item: Item, finding: Finding, folder: Path, made: Mapping[str, Any]) -> Record:
    """Write a finding into a folder of its own: pictures, then the record, which is returned.

    Raises
    ------
    ParameterError
        If the folder cannot be written to.
    """
    place = folder / item.name
    try:
        place.mkdir(parents=True, exist_ok=True)
        (place / RECORD).unlink(missing_ok=True)
    except OSError as error:
        msg = f"{place}: cannot be written to ({error.strerror}); choose another folder with -o"
        raise ParameterError(msg) from error
    pictures = []
    for picture in finding.pictures:
        content = BytesIO()
        picture.figure.savefig(content, format="png", dpi=_DPI)
        write_whole(place / f"{picture.name}.png", _writer(content.getvalue()))
        pictures.append({"file": f"{picture.name}.png", "caption": picture.caption})
    values = {
        "item": item.name,
        "title": item.words[0],
        "shapes": finding.shapes,
        "claims": [asdict(claim) for claim in finding.claims],
        "pictures": pictures,
        "tables": [asdict(table) for table in finding.tables],
        "numbers": plain(finding.numbers),
        "made": dict(made),
    }
    text = json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_whole(place / RECORD, _writer(text.encode("utf-8")))
    return _record(item, place, values)


def plain(values: Any) -> Any:
    """Return numbers, arrays and mappings as JSON has them; what is not finite becomes a word.

    Examples
    --------
    >>> plain({"rho": (1.0, math.inf)})
    {'rho': [1.0, 'inf']}
    """
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, Mapping):
        return {str(key): plain(value) for key, value in values.items()}
    if isinstance(values, (list, tuple)):
        return [plain(value) for value in values]
    if isinstance(values, float) and not math.isfinite(values):
        return str(values)
    return values if isinstance(values, (bool, int, float, str)) or values is None else str(values)


def _record(item: Item, place: Path, values: Mapping[str, Any]) -> Record:
    """Return a record of what JSON holds.

    Raises
    ------
    KeyError, TypeError, ValueError
        If something is missing, of another kind, or a picture lies elsewhere.
    """
    pictures = tuple((entry["file"], entry["caption"]) for entry in values["pictures"])
    for file, _ in pictures:
        if Path(file).name != file:
            msg = f"{file}: a picture lies beside its record"
            raise ValueError(msg)
    made = dict(values["made"])
    return Record(
        item.name,
        item.words[0],
        place,
        values["shapes"],
        tuple(Claim(**claim) for claim in values["claims"]),
        pictures,
        tuple(_table(entry) for entry in values["tables"]),
        dict(values["numbers"]),
        made | {"seconds": float(made.get("seconds", 0.0))},
    )


def _table(entry: Mapping[str, Any]) -> Table:
    """Return a table as it was before JSON made lists of its tuples."""
    return Table(entry["caption"], tuple(entry["head"]), tuple(tuple(row) for row in entry["rows"]))


def _is_png(path: Path) -> bool:
    """Tell whether a picture is there, by its first bytes."""
    with path.open("rb") as file:
        return file.read(len(_PNG)) == _PNG


def _writer(content: bytes) -> Callable[[Any], Any]:
    """Return what writes these bytes to an open file."""
    return lambda file: file.write(content)


def _origin(item: Item, data: Data) -> dict[str, Any]:
    """Say what a record depends on: version, script and machinery, size and which collections are there."""
    machinery = b"\0".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return {
        "spem": spem.__version__,
        "script": sha256(item.script.read_bytes()).hexdigest()[:16],
        "machinery": sha256(machinery).hexdigest()[:16],
        "quick": data.quick,
        "data": None if data.folder is None else list(data.present),
    }


def _same(record: Record, origin: Mapping[str, Any]) -> bool:
    """Tell whether a record was made with the same version, size and data."""
    made = record.made or {}
    return all(made.get(key) == value for key, value in origin.items())
