"""Screened Poisson hyperfields: shapes in; fields, SPEM maps, codes and ranked answers out."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spem.api.fields import field, maps, sweep
    from spem.api.parts import parts, source_fields, sources
    from spem.codes.codes import Codes, Failure
    from spem.codes.model import Model
    from spem.codes.settings import Settings
    from spem.codes.vlad import VLAD
    from spem.codes.vocabulary import Vocabulary
    from spem.collections import encode, evaluate, search
    from spem.decomposition.parts import Parts
    from spem.decomposition.sparse_coding import NonnegativeSparseCoding
    from spem.embedding.maps import Maps
    from spem.errors import (
        ConvergenceError,
        LabelError,
        ModelError,
        ParameterError,
        ReadError,
        ShapeError,
        SizeError,
        SpemError,
    )
    from spem.fields.hyperfield import Hyperfield
    from spem.fields.solvers.cg import ConjugateGradient
    from spem.fields.solvers.direct import Direct
    from spem.fields.solvers.explicit import ExplicitIteration
    from spem.fields.solvers.protocol import Solution
    from spem.fields.solvers.sweep import Sweep
    from spem.fields.source_fields import SourceFields
    from spem.fields.sources import Sources
    from spem.retrieval.distances import correlation_distance, fuse
    from spem.retrieval.evaluation import PrecisionRecall, Scores, bulls_eye, precision_recall
    from spem.retrieval.ranking import Answer
    from spem.shapes import creatures, synthetic
    from spem.shapes.levels import signed_distance_shape
    from spem.shapes.read import read, read_all
    from spem.shapes.shape import Cuts, Report, Shape

__version__ = "0.1.0"

__all__ = [  # noqa: RUF022 - capitals first, as Python sorts, in all three lists
    "Answer",
    "Codes",
    "ConjugateGradient",
    "ConvergenceError",
    "Cuts",
    "Direct",
    "ExplicitIteration",
    "Failure",
    "Hyperfield",
    "LabelError",
    "Maps",
    "Model",
    "ModelError",
    "NonnegativeSparseCoding",
    "ParameterError",
    "Parts",
    "PrecisionRecall",
    "ReadError",
    "Report",
    "Scores",
    "Settings",
    "Shape",
    "ShapeError",
    "SizeError",
    "Solution",
    "SourceFields",
    "Sources",
    "SpemError",
    "Sweep",
    "VLAD",
    "Vocabulary",
    "bulls_eye",
    "correlation_distance",
    "creatures",
    "encode",
    "evaluate",
    "field",
    "fuse",
    "maps",
    "parts",
    "precision_recall",
    "read",
    "read_all",
    "search",
    "signed_distance_shape",
    "source_fields",
    "sources",
    "sweep",
    "synthetic",
]

# Public name -> module that defines it; each is imported when it is first used.
_HOME = {
    "Answer": "spem.retrieval.ranking",
    "Codes": "spem.codes.codes",
    "ConjugateGradient": "spem.fields.solvers.cg",
    "ConvergenceError": "spem.errors",
    "Cuts": "spem.shapes.shape",
    "Direct": "spem.fields.solvers.direct",
    "ExplicitIteration": "spem.fields.solvers.explicit",
    "Failure": "spem.codes.codes",
    "Hyperfield": "spem.fields.hyperfield",
    "LabelError": "spem.errors",
    "Maps": "spem.embedding.maps",
    "Model": "spem.codes.model",
    "ModelError": "spem.errors",
    "NonnegativeSparseCoding": "spem.decomposition.sparse_coding",
    "ParameterError": "spem.errors",
    "Parts": "spem.decomposition.parts",
    "PrecisionRecall": "spem.retrieval.evaluation",
    "ReadError": "spem.errors",
    "Report": "spem.shapes.shape",
    "Scores": "spem.retrieval.evaluation",
    "Settings": "spem.codes.settings",
    "Shape": "spem.shapes.shape",
    "ShapeError": "spem.errors",
    "SizeError": "spem.errors",
    "Solution": "spem.fields.solvers.protocol",
    "SourceFields": "spem.fields.source_fields",
    "Sources": "spem.fields.sources",
    "SpemError": "spem.errors",
    "Sweep": "spem.fields.solvers.sweep",
    "VLAD": "spem.codes.vlad",
    "Vocabulary": "spem.codes.vocabulary",
    "bulls_eye": "spem.retrieval.evaluation",
    "correlation_distance": "spem.retrieval.distances",
    "creatures": "spem.shapes.creatures",
    "encode": "spem.collections",
    "evaluate": "spem.collections",
    "field": "spem.api.fields",
    "fuse": "spem.retrieval.distances",
    "maps": "spem.api.fields",
    "parts": "spem.api.parts",
    "precision_recall": "spem.retrieval.evaluation",
    "read": "spem.shapes.read",
    "read_all": "spem.shapes.read",
    "search": "spem.collections",
    "signed_distance_shape": "spem.shapes.levels",
    "source_fields": "spem.api.parts",
    "sources": "spem.api.parts",
    "sweep": "spem.api.fields",
    "synthetic": "spem.shapes.synthetic",
}

# Type checkers read the imports above, and would take any name for one of this function's.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            msg = f"module 'spem' has no attribute {name!r}"
            raise AttributeError(msg)
        module = importlib.import_module(_HOME[name])
        value = module if name in ("creatures", "synthetic") else getattr(module, name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return __all__
