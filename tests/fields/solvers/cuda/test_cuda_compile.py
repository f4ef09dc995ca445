"""Every CUDA source compiles as CuPy compiles it, for several generations, within a device's means."""

from __future__ import annotations

import re
from collections import Counter
from itertools import product
from pathlib import Path

import nvrtc
import pytest

import spem
from spem.fields.solvers.cuda.programs import PACKAGE, kernels, options, read_source
from spem.fields.solvers.cuda.runtime import THREADS

DIMENSIONS = [{"DIM": 2}, {"DIM": 3}]
SETS: dict[str, list[dict[str, int]]] = {
    "cycle.cu": DIMENSIONS,
    "krylov.cu": DIMENSIONS,
    "levels.cu": DIMENSIONS,
    "blocks.cu": [{"DIM": dim, "WIDE": wide} for dim, wide in product((2, 3), (0, 1))],
    "spem.codes.cuda/vlad.cu": [
        {"N_MAPS": 6, "N_CENTERS": 32, "N_CUTS": 0},
        {"N_MAPS": 6, "N_CENTERS": 32, "N_CUTS": 3},
    ],
}
CASES = [(source, macros) for source, sets in SETS.items() for macros in sets]
ROOT = Path(spem.__file__).parent

compiles = pytest.mark.skipif(
    nvrtc.load() is None, reason="CUDA's run-time compiler is absent; it comes with nvidia-cuda-nvrtc"
)


def test_every_source_is_compiled_here_with_its_macros() -> None:
    """The table above has all sources of the package, with the macros that the package sets."""
    found = {}
    for path in sorted(ROOT.rglob("*.cu")):
        package = ".".join(("spem", *path.parent.relative_to(ROOT).parts))
        found[path.name if package == PACKAGE else f"{package}/{path.name}"] = path
    assert sorted(found) == sorted(SETS)
    python = "\n".join(path.read_text() for path in ROOT.rglob("*.py"))
    for source, sets in SETS.items():
        calls = re.findall(rf'\.program\(\s*(?:"{re.escape(source)}"|_SOURCE)\s*,([^)]*)', python)
        assert any(set(re.findall(r"\b([A-Z_]+)=", call)) == set(sets[0]) for call in calls), source


def test_names_of_kernels_are_unique() -> None:
    """No two sources have a kernel of one name."""
    names = Counter(name for source in SETS for name in kernels(read_source(source)))
    assert [name for name, count in names.items() if count > 1] == []


@compiles
@pytest.mark.parametrize(("source", "macros"), CASES)
def test_sources_fit_a_hopper(source: str, macros: dict[str, int]) -> None:
    """No kernel spills, registers are enough for four blocks a multiprocessor, and all kernels are parsed."""
    text = read_source(source)
    usage = nvrtc.compile_kernels(text, options(macros), 90)
    assert sorted(usage) == sorted(kernels(text))
    for name, used in usage.items():
        assert (used.spilled, used.stack) == (0, 0), name
        assert used.registers * THREADS * 4 <= 65536, name
        assert used.shared <= 48 << 10, name


@compiles
@pytest.mark.parametrize("architecture", [75, 80])
@pytest.mark.parametrize("source", SETS)
def test_sources_compile_for_other_devices(source: str, architecture: int) -> None:
    """The sources need nothing of one generation."""
    text = read_source(source)
    assert sorted(nvrtc.compile_kernels(text, options(SETS[source][-1]), architecture)) == sorted(
        kernels(text)
    )


@compiles
def test_the_planted_kernels_are_cuda() -> None:
    """What the simulator is tested with compiles for a device too, and its kernels are parsed."""
    text = read_source("common.cuh") + Path(__file__).with_name("planted.cu").read_text()
    assert sorted(nvrtc.compile_kernels(text, (), 90)) == sorted(kernels(text))


@compiles
def test_what_is_refused_is_told() -> None:
    """The compiler's words, with the line of the file that is included, are in the error."""
    wrong = '#line 7 "wrong.cu"\nextern "C" __global__ void wrong(float* v) { v = 1; }'
    with pytest.raises(nvrtc.CompilationError, match=r"wrong\.cu\(7\): error"):
        nvrtc.compile_kernels(read_source("common.cuh") + wrong, (), 90)
