"""One hostile file."""

from __future__ import annotations

from dataclasses import dataclass

# A file that no reader may open; named in materials, buffers and includes.
CANARY = "canary.txt"


@dataclass(frozen=True)
class Case:
    """A hostile file.

    Parameters
    ----------
    kind
        What it pretends to be.
    how
        What is wrong with it.
    name
        Name that a client would send it under.
    content
        Its bytes.
    """

    kind: str
    how: str
    name: str
    content: bytes

    @property
    def suffix(self) -> str:
        """Ending of the name under which a reader gets it."""
        return ".nii.gz" if self.name.lower().endswith(".nii.gz") else "." + self.name.rpartition(".")[2]
