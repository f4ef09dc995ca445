"""What of the paper is reproduced: one entry for each script in the folder of examples."""

from __future__ import annotations

import ast
import difflib
import importlib.util
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType

import spem
from spem.errors import ParameterError
from spem.paper.data import Data
from spem.paper.findings import Finding

ALL = "all"


@dataclass(frozen=True)
class Item:
    """A figure, table or claim of the paper, and the script that reproduces it.

    Parameters
    ----------
    name
        What it is called by: ``"fig13"``, ``"table1"``.
    place
        Section of the paper.
    needs
        Collections of real shapes that it is about; none where any shape will do.
    """

    name: str
    place: str
    needs: tuple[str, ...] = ()

    @property
    def script(self) -> Path:
        """The script, whose function ``make`` does the work."""
        return _folder() / f"{self.name}.py"

    @cached_property
    def words(self) -> tuple[str, str]:
        """Title and text of the page: the docstring of the script."""
        try:
            document = ast.get_docstring(ast.parse(self.script.read_text(encoding="utf-8"))) or ""
        except OSError as error:
            raise ParameterError(_unreadable(self)) from error
        title, _, rest = document.partition("\n")
        return title, rest.lstrip("=\n").strip()

    def make(self, data: Data) -> Finding:
        """Run the experiment."""
        make: Callable[[Data], Finding] = _load(self).make
        return make(data)


ITEMS: tuple[Item, ...] = (
    Item("fig1", "2.1"),
    Item("levels", "2.1"),
    Item("fig2", "2.2"),
    Item("fig3", "2.2"),
    Item("fig4", "2.3"),
    Item("fig5", "2.3"),
    Item("fig6", "2.4"),
    Item("walk", "3.1"),
    Item("transform", "3.1"),
    Item("transient", "3.1"),
    Item("distance", "3.2"),
    Item("geodesics", "3.2"),
    Item("spectra", "3.3", ("tari1000", "shrec11")),
    Item("fig7", "4.1"),
    Item("fig8", "4.1"),
    Item("pca", "4.2", ("horse_poses", "tosca_cats")),
    Item("variance", "4.2", ("horse_poses", "tosca_cats")),
    Item("correspondence", "4.2", ("horse_poses", "tosca_cats")),
    Item("fig9", "4.2"),
    Item("fig10", "4.2"),
    Item("speed", "5.1", ("tari1000",)),
    Item("fig11", "5.2"),
    Item("fig12", "5.2"),
    Item("fig13", "5.3"),
    Item("fig14", "5.3"),
    Item("fig15", "5.3", ("horse_poses",)),
    Item("fig16", "5.4"),
    Item("fig17", "5.4", ("tari1000",)),
    Item("fig18", "5.5", ("shrec11",)),
    Item("fig19", "5.5", ("shrec11",)),
    Item("table1", "5.5", ("shrec11",)),
    Item("ingredients", "5.5", ("shrec11",)),
    Item("ablation", "5.5", ("shrec11",)),
    Item("classification", "5.4, 5.5", ("tari1000", "shrec11")),
)


def choose(names: Sequence[str]) -> tuple[Item, ...]:
    """Return the items of these names, in the order of the paper.

    Parameters
    ----------
    names
        Names of items, or ``"all"``.

    Raises
    ------
    ParameterError
        If there is no item of a name; the nearest ones are told.

    Examples
    --------
    >>> [item.name for item in choose(["fig13", "fig2"])]
    ['fig2', 'fig13']
    >>> choose(["fig21"])
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: fig21: no such item of the paper; the nearest are fig2, fig1, fig19
    """
    known = [item.name for item in ITEMS]
    for name in names:
        if name not in (*known, ALL):
            near = difflib.get_close_matches(name.lower(), known, n=3, cutoff=0.4)
            advice = f"the nearest are {', '.join(near)}" if near else "spem paper lists them"
            msg = f"{name or 'an empty name'}: no such item of the paper; {advice}"
            raise ParameterError(msg)
    return tuple(item for item in ITEMS if item.name in names or ALL in names)


def _folder() -> Path:
    """Find the scripts: beside this module once installed, in the repository while it is worked on."""
    installed = Path(__file__).parent / "examples"
    return installed if installed.is_dir() else Path(spem.__file__).parents[2] / "examples"


def _load(item: Item) -> ModuleType:
    """Import a script under a name of its own."""
    name = f"spem_paper_{item.name}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, item.script)
        if spec is None or spec.loader is None or not item.script.is_file():
            raise ParameterError(_unreadable(item))
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[name] = module
    return sys.modules[name]


def _unreadable(item: Item) -> str:
    """Say that a script is missing."""
    return f"{item.script}: the script of {item.name} cannot be read; install spem again"
