"""The public names: one list for people, for the loader and for type checkers."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import spem

SOURCE = ast.parse(Path(spem.__file__).read_text(encoding="utf-8"))


def imported() -> dict[str, str]:
    """Return name → module of the imports that type checkers read."""
    [block] = [node for node in SOURCE.body if isinstance(node, ast.If) and isinstance(node.test, ast.Name)]
    modules = {"spem.shapes": "spem.shapes.{}"}
    return {
        alias.name: modules.get(node.module, node.module).format(alias.name)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def test_lists_of_public_names_agree():
    """`__all__`, the table of lazy names and the imports of type checkers name the same, sorted."""
    assert list(spem.__all__) == sorted(spem.__all__) == list(spem._HOME) == dir(spem)
    assert imported() == spem._HOME


@pytest.mark.parametrize("name", spem.__all__)
def test_public_name_is_there_and_documented(name):
    """Every public name leads to what its module defines, with a docstring."""
    value = getattr(spem, name)
    assert value.__doc__
    home = value.__name__ if name in ("creatures", "synthetic") else value.__module__
    assert home == spem._HOME[name]


def test_unknown_name_is_an_attribute_error():
    """A name that is not public is refused as Python does."""
    with pytest.raises(AttributeError, match="module 'spem' has no attribute 'nope'"):
        _ = spem.nope


def test_type_checkers_see_the_types(tmp_path):
    """Mypy knows what public functions take and return, and which names there are."""
    pytest.importorskip("mypy")
    user = tmp_path / "user.py"
    user.write_text(
        "import spem\n"
        "reveal_type(spem.read('a.png'))\n"
        "reveal_type(spem.encode(['a.png']))\n"
        "reveal_type(spem.creatures.VOXELS)\n"
        "spem.nope\n"
    )
    command = [sys.executable, "-m", "mypy", "--no-incremental", "--cache-dir", str(tmp_path), str(user)]
    said = subprocess.run(
        [*command, "--follow-imports=silent"], capture_output=True, text=True, check=False, cwd=tmp_path
    ).stdout
    assert '"spem.shapes.shape.Shape"' in said
    assert '"spem.codes.codes.Codes"' in said
    assert '"dict[int, int]"' in said
    assert 'has no attribute "nope"' in said
