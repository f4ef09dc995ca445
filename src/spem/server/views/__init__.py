"""What the explorer shows of one shape: fields, maps, parts, sources and words, as arrays."""

from spem.server.views.catalogue import VIEWS

__all__ = ["VIEWS"]
