"""Links from types as the code writes them to the pages of the public names."""

from __future__ import annotations

import re
from types import GenericAlias
from typing import Any

import numpy.typing
from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

import spem


class ArrayLike:
    """Anything that NumPy makes an array of."""


class NDArray:
    """An array, of a type of numbers."""

    __class_getitem__: Any = classmethod(GenericAlias)


# The aliases that they stand for are printed as what they mean, which is long; modules that use them are
# imported later.
for _kind in (ArrayLike, NDArray):
    setattr(numpy.typing, _kind.__name__, _kind)


def setup(app: Sphinx) -> dict[str, Any]:
    """Resolve what Sphinx cannot, and leave out what scikit-learn adds to its estimators."""
    app.connect("missing-reference", _resolve)
    app.connect("autodoc-skip-member", _skip)
    app.connect("doctree-read", _link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _resolve(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, content: nodes.TextElement
) -> nodes.Node | None:
    """Link a public name that is meant by its home or without its package; leave other types as text."""
    if node.get("refdomain") != "py":
        return None
    target = str(node.get("reftarget", ""))
    domain = env.domains.python_domain
    for name in _public(target):
        if name in domain.objects:
            role = domain.role_for_objtype(domain.objects[name].objtype)
            return domain.resolve_xref(env, node["refdoc"], app.builder, role or "obj", name, node, content)
    # Types of other packages, and those of ours that are not promised, have no page here.
    return content if node.get("reftype") in ("class", "data", "exc") else None


def _link(app: Sphinx, document: nodes.document) -> None:
    """Make links of public names that stand as code in the words of a page."""
    for code in list(document.findall(nodes.literal)):
        name = code.astext().partition("(")[0]
        inside = isinstance(code.parent, (pending_xref, nodes.reference, nodes.title))
        if not inside and name.removeprefix("spem.").partition(".")[0] in spem.__all__ and "." in name:
            link = pending_xref("", refdomain="py", reftype="obj", reftarget=name, refdoc=app.env.docname)
            code.replace_self(link)
            link += code


def _public(target: str) -> list[str]:
    """Return the public names that a dotted name may mean.

    Examples
    --------
    >>> _public("spem.shapes.shape.Shape"), _public("Shape.from_mask"), _public("inf")
    (['spem.Shape'], ['spem.Shape.from_mask'], [])
    """
    for name, module in spem._HOME.items():
        home = f"{module}.{name}"
        if target == home or target.startswith(f"{home}."):
            return [f"spem.{name}{target.removeprefix(home)}"]
    first = target.partition(".")[0]
    return [f"spem.{target}"] if first in spem.__all__ else []


def _skip(app: Sphinx, kind: str, name: str, member: Any, skip: bool, options: Any) -> bool | None:
    """Leave out methods that scikit-learn makes of the signatures of others."""
    return True if re.fullmatch(r"set_\w+_request", name) else None
