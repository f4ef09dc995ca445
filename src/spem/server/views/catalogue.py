"""The views by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

from spem.server.views.downloads import view_download
from spem.server.views.field import view_field
from spem.server.views.geometry import view_geometry
from spem.server.views.options import Options, Reply
from spem.server.views.parts import view_parts
from spem.server.views.source import view_source
from spem.shapes.shape import Shape

View: TypeAlias = Callable[[Shape, Options], Reply]

#: What is shown of a shape: each takes it and options, and returns a header for JSON and arrays.
VIEWS: Mapping[str, View] = MappingProxyType(
    {
        "geometry": view_geometry,
        "field": view_field,
        "parts": view_parts,
        "source": view_source,
        "download": view_download,
    }
)
