"""Help: every command has it, with examples, and it is quick."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from enum import StrEnum
from inspect import signature
from typing import get_args

import pytest
from typer.testing import Result

import spem as package
from spem.cli.options import BoundaryChoice, ComponentsChoice, SchemeChoice
from spem.codes.normalise import Scaling
from spem.codes.settings import Components, Settings
from spem.fields.operator import Boundary
from spem.fields.rho import Scheme

COMMANDS = (
    "info",
    "field",
    "maps",
    "parts",
    "encode",
    "search",
    "evaluate",
    "demo",
    "paper",
    "serve",
    "devices",
)
HEAVY = (
    "numba",
    "scipy",
    "sklearn",
    "skimage",
    "matplotlib",
    "trimesh",
    "igl",
    "nibabel",
    "joblib",
    "tifffile",
    "lancedb",
    "pyarrow",
    "pandas",
    "fastapi",
    "distributed",
    "cupy",
)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example(spem: Callable[..., Result], command: str) -> None:
    """The help of a command shows it in use."""
    result = spem(command, "--help")
    assert result.exit_code == 0
    assert "Examples:" in result.stdout
    assert f"  spem {command}" in result.stdout


def test_help_names_all_commands(spem: Callable[..., Result]) -> None:
    """`spem --help` lists the commands; without arguments the same is shown as wrong usage."""
    text = spem("--help").stdout
    assert all(command in text for command in COMMANDS)
    assert spem().exit_code == 2


@pytest.mark.parametrize(
    ("choice", "kind"), [(BoundaryChoice, Boundary), (SchemeChoice, Scheme), (ComponentsChoice, Components)]
)
def test_choices_are_those_of_the_library(choice: type[StrEnum], kind: object) -> None:
    """The command line, which loads no solver for its help, offers what the library takes."""
    assert tuple(choice) == get_args(kind)


def test_defaults_of_codes_are_shown(spem: Callable[..., Result]) -> None:
    """The help of `encode` has the defaults and choices of the settings."""
    text, default = " ".join(spem("encode", "--help").stdout.split()), Settings(features="spem")
    for name in ("n_maps", "power", "moments", "scaling"):
        assert f"[{getattr(default, name)}]" in text.split(f"--{name.replace('_', '-')} ")[1][:140]
    assert ", ".join(get_args(Scaling)[:-1]) in text


def test_defaults_of_parts_are_those_of_the_library(spem: Callable[..., Result]) -> None:
    """The help of `parts` has the default sparsity and number of parts of the facade."""
    text = " ".join(spem("parts", "--help").stdout.split())
    default = {name: option.default for name, option in signature(package.parts).parameters.items()}
    assert f"[default: {default['sparsity']}]" in text.split("--sparsity ")[1][:140]
    assert f"[{default['n_parts']}; 16]" in text.split("--n-parts ")[1][:140]
    assert f"[default: {default['n_patches']}]" in text.split("--patches ")[1][:140]
    assert f"[default: {default['boundary']}]" in text.split("--boundary ")[1][:140]


def test_version(spem: Callable[..., Result]) -> None:
    """`spem --version` is the package's."""
    assert spem("--version").stdout.strip() == f"spem {package.__version__}"


def test_help_loads_nothing_heavy() -> None:
    """The command line starts without the numerical libraries."""
    script = f"import sys, spem.cli.app; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_runs_as_a_module() -> None:
    """`python -m spem` is the command line, and a closed pipe ends it quietly."""
    script = f"{sys.executable} -m spem --help | head -n 1"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Usage:")
    assert done.stderr == ""
