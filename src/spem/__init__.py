"""Screened Poisson hyperfields: shapes in; fields, SPEM maps, codes and ranked answers out."""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

# Public name -> module that defines it; each is imported when it is first used.
_HOME = {
    "Answer": "spem.retrieval.ranking",
    "Codes": "spem.codes.codes",
    "ConvergenceError": "spem.errors",
    "Cuts": "spem.shapes.shape",
    "Failure": "spem.codes.codes",
    "Hyperfield": "spem.fields.hyperfield",
    "LabelError": "spem.errors",
    "Maps": "spem.embedding.maps",
    "Model": "spem.codes.model",
    "ModelError": "spem.errors",
    "ParameterError": "spem.errors",
    "ReadError": "spem.errors",
    "Report": "spem.shapes.shape",
    "Scores": "spem.retrieval.evaluation",
    "Settings": "spem.codes.settings",
    "Shape": "spem.shapes.shape",
    "ShapeError": "spem.errors",
    "SizeError": "spem.errors",
    "SpemError": "spem.errors",
    "encode": "spem.collections",
    "evaluate": "spem.collections",
    "field": "spem.api",
    "maps": "spem.api",
    "read": "spem.shapes.read",
    "read_all": "spem.shapes.read",
    "search": "spem.collections",
    "sweep": "spem.api",
    "synthetic": "spem.shapes.synthetic",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module 'spem' has no attribute {name!r}"
        raise AttributeError(msg)
    module = importlib.import_module(_HOME[name])
    value = module if name == "synthetic" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
