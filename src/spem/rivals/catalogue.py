"""The other systems of Table 1 by name."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import Any

from spem.errors import ParameterError
from spem.rivals.extra import EXTRA, has
from spem.rivals.protocol import Rival

_OPENCV, _POTPOURRI = ("cv2", "opencv-python-headless"), ("potpourri3d", "potpourri3d")
_DEVIATIONS = "Deviations: "


@dataclass(frozen=True)
class Entry:
    """Where a rival is, and what it needs.

    Parameters
    ----------
    module
        Module of `spem.rivals`.
    kind
        Name of its class there.
    needs
        Packages of the extra: the name each is imported by, and the name it is installed by.
    parameters
        Those that differ from its defaults.
    """

    module: str
    kind: str
    needs: tuple[tuple[str, str], ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict)

    @property
    def type(self) -> type:
        """The class."""
        return getattr(import_module(f"spem.rivals.{self.module}"), self.kind)  # type: ignore[no-any-return]


RIVALS: Mapping[str, Entry] = MappingProxyType(
    {
        "SD-GDM": Entry("sd_gdm", "SDGDM", (_POTPOURRI,)),
        "iHKS": Entry("ihks", "IHKS"),
        "MDS-CM-BOF": Entry("mds_cm_bof", "MdsCmBof", (_OPENCV,)),
        "Shape-DNA": Entry("shape_dna", "ShapeDNA"),
        "Shape-DNA (solid)": Entry("shape_dna", "ShapeDNA", parameters={"solid": True}),
        "Shape-DNA (reweighted)": Entry("shape_dna", "ShapeDNA", parameters={"reweighted": True}),
        "WESD": Entry("wesd", "WESD"),
        "meshSIFT": Entry("mesh_sift", "MeshSIFT"),
    }
)


def make_rival(name: str, **parameters: Any) -> Rival:
    """Make the system of a name, at its defaults but for `parameters`.

    Parameters
    ----------
    name
        As Table 1 has it.
    **parameters
        Parameters of the system.

    Raises
    ------
    ParameterError
        When there is none of this name.

    Examples
    --------
    >>> make_rival("SD-GDM", n_values=19).name
    'SD-GDM'
    """
    if name not in RIVALS:
        msg = f"rival {name!r} must be one of {', '.join(RIVALS)}"
        raise ParameterError(msg)
    made: Rival = RIVALS[name].type(**(RIVALS[name].parameters | parameters))
    return made


def missing(name: str) -> str:
    """Say what a system needs that is not installed; nothing where all is there.

    Examples
    --------
    >>> missing("Shape-DNA")
    ''
    """
    absent = ", ".join(distribution for module, distribution in RIVALS[name].needs if not has(module))
    return f"needs {absent}; install {EXTRA}" if absent else ""


def deviations(name: str) -> str:
    """Return how a system differs from its publication, as the docstring of its class says.

    Examples
    --------
    >>> deviations("SD-GDM").partition(" (")[0]
    'distances by the heat method'
    """
    for paragraph in (inspect.getdoc(RIVALS[name].type) or "").split("\n\n"):
        words = " ".join(paragraph.split())
        if words.startswith(_DEVIATIONS):
            return words.removeprefix(_DEVIATIONS)
    return ""
