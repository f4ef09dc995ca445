"""The models of an index: each as the bytes of its file, in a table of their own."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spem.codes.model import Model
from spem.errors import ModelError, ReadError
from spem.files import write_whole
from spem.index.extra import require
from spem.index.schema import models_schema

if TYPE_CHECKING:
    import pyarrow

# All but the model itself.
FACTS = ("digest", "features", "ndim", "n_code", "made")


@dataclass(frozen=True)
class ModelFacts:
    """What an index says of one of its models.

    Parameters
    ----------
    digest
        The model's name.
    features
        Kinds of features that codes are made of.
    ndim
        Dimension of the shapes; 0 where the model does not say.
    n_code
        Length of a code.
    n_shapes
        Number of rows.
    """

    digest: str
    features: str
    ndim: int
    n_code: int
    n_shapes: int


def to_table(model: Model) -> pyarrow.Table:
    """Return a model as the one row that the database has of it."""
    pa = require("pyarrow")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "model.spem")
        model.save(file)
        data = file.read_bytes()
    record: dict[str, Any] = {
        "digest": model.digest,
        "features": model.settings.features,
        "ndim": model.ndim or 0,
        "n_code": model.n_code,
        "made": datetime.now(UTC),
        "model": data,
    }
    return pa.Table.from_pylist([record], schema=models_schema())


def from_bytes(data: bytes, digest: str, address: str) -> Model:
    """Return the model that these bytes of a file are.

    Raises
    ------
    ModelError
        When they are damaged, or of another model.
    ParameterError
        When the folder of temporary files cannot be written, or is full.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "model.spem")
        write_whole(file, lambda opened: opened.write(data))
        try:
            model = Model.load(file)
        except ReadError as error:
            msg = f"{address}: model {digest} is damaged; add the shapes to a new index"
            raise ModelError(msg) from error
        except ModelError as error:
            msg = f"{address}: model {digest}: {str(error).removeprefix(f'{file}: ')}"
            raise ModelError(msg) from error
    if model.digest != digest:
        msg = f"{address}: the model kept as {digest} is {model.digest}; add the shapes to a new index"
        raise ModelError(msg)
    return model
