"""Which of several models a query is asked with, where nobody says: the one that can answer it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spem.codes.codes import file_hash
from spem.index.filters import literal
from spem.index.models import ModelFacts
from spem.index.row import ID_DIGITS
from spem.index.store import Store
from spem.shapes.kinds import IMAGE_SUFFIXES, MESH_SUFFIXES, TIFF_SUFFIXES, has_suffix
from spem.shapes.shape import Shape


def models_for(query: Any, store: Store, models: Sequence[ModelFacts]) -> list[str]:
    """Return the digests of the models that a query can be asked with.

    Parameters
    ----------
    query
        A file, a shape, a code, or the id, name or path of a shape of the index.
    store
        The database.
    models
        Its models.

    Returns
    -------
    list of str
        Of the length of a code; of the dimension of a shape, as far as the kind of a file tells it; or those
        that hold a shape of this content, id, name or path.
    """
    if isinstance(query, np.ndarray):
        return [model.digest for model in models if query.shape == (model.n_code,)]
    if isinstance(query, Shape):
        return [model.digest for model in models if model.ndim in (0, query.ndim)]
    file = Path(str(query))
    if not file.is_file():
        path = literal(store.stored(str(query)))
        name = literal(str(query))
        where = f"id = {name} OR name = {name} OR path = {path} OR array_has(copies, {path})"
        return [model.digest for model in models if store.count(model.digest, where)]
    key = literal(file_hash(file)[:ID_DIGITS])
    holding = [model.digest for model in models if store.count(model.digest, f"id = {key}")]
    ndims = file_dimensions(file)
    return holding or [model.digest for model in models if not ndims or model.ndim in (0, *ndims)]


def file_dimensions(file: Path) -> tuple[int, ...]:
    """Return the dimension that the shape of a file has by its kind, nothing where the kind does not tell.

    Examples
    --------
    >>> file_dimensions(Path("cat.obj")), file_dimensions(Path("scan.nii.gz"))
    ((3,), ())
    """
    if has_suffix(file, MESH_SUFFIXES):
        return (3,)
    return (2,) if has_suffix(file, IMAGE_SUFFIXES) and not has_suffix(file, TIFF_SUFFIXES) else ()
