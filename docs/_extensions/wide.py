"""Pictures with several panels side by side are marked, so that they can scroll on a narrow screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from docutils import nodes
from PIL import Image
from sphinx.application import Sphinx

# Width over height from which a picture would be too small on a phone.
_WIDE = 2.2


def setup(app: Sphinx) -> dict[str, Any]:
    """Mark pictures once a page is read."""
    app.connect("doctree-read", _mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _mark(app: Sphinx, document: nodes.document) -> None:
    """Give what holds a wide picture the class of what scrolls, but for those of cards."""
    for image in document.findall(nodes.image):
        path = Path(app.srcdir, image["uri"])
        if "sd-card-img-top" in image["classes"] or not path.is_file():
            continue
        with Image.open(path) as picture:
            width, height = picture.size
        if width > _WIDE * height and image.parent is not None:
            _block(image)["classes"].append("scrolls")


def _block(image: nodes.image) -> nodes.Element:
    """Return the figure that a picture stands in, else a block of its own."""
    holder = image.parent
    if isinstance(holder, nodes.figure):
        return holder
    block = nodes.inline()
    holder.replace(image, block)
    block += image
    return block
