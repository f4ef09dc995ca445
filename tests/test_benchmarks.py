"""Each benchmark runs on small sizes, and says what it could not run."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from backends import needs_simulator
from simulator import SimulatedRuntime

FOLDER = Path(__file__).parents[1] / "benchmarks"
KEYS = {"benchmark", "quick", "machine", "facts", "tables", "targets", "skipped"}
WITHOUT_DATA = (
    "cluster",
    "convergence",
    "geodesics",
    "gpu_sweep",
    "index_kill",
    "parts_silhouettes",
    "patches",
    "server_load",
    "source_accuracy",
    "source_speed",
    "sources",
    "spectra",
    "startup",
    "sweep_accuracy",
    "sweep_scaling",
    "views",
)


def _run(name: str, out: Path, **environment: str) -> dict:
    command = [sys.executable, str(FOLDER / f"{name}.py"), "--quick", "--out", str(out)]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads((out / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", WITHOUT_DATA)
def test_benchmark_runs_without_data(name, tmp_path):
    """A quick run without real shapes writes its tables, and names what it skipped."""
    result = _run(name, tmp_path, SPEM_DATA=str(tmp_path / "absent"))
    assert set(result) == KEYS
    assert result["benchmark"] == name
    assert result["quick"] is True
    assert result["machine"]["cores"] >= 1
    assert result["tables"]
    assert all(rows for rows in result["tables"].values())
    assert not any("shrec11" in title or "tari1000" in title for title in result["tables"])


def test_candidates_solve_the_system_of_the_sweep(tmp_path):
    """All candidates come to the same fields, so that their times compare."""
    result = _run("solvers", tmp_path, SPEM_DATA=str(tmp_path / "absent"))
    errors = [row["error"] for rows in result["tables"].values() for row in rows if "error" in row]
    assert len(errors) >= 10
    assert max(errors) < 1e-3


def test_collections_are_skipped_without_data(tmp_path):
    """Without real collections there is no figure, only the reasons."""
    result = _run("collection", tmp_path, SPEM_DATA=str(tmp_path / "absent"))
    assert result["tables"] == {}
    assert result["targets"] == []
    assert [reason.split(":")[0] for reason in result["skipped"]] == ["tari1000", "shrec11"]


@pytest.mark.parametrize(
    "name",
    [
        "codes_study",
        "index_search",
        "pose_consistency",
        "retrieval",
        "rivals",
        "silhouettes",
        "sparse_coding",
    ],
)
def test_real_shapes_are_skipped_without_data(name, tmp_path):
    """Without the shapes that a benchmark is of there is no figure, only the reasons."""
    result = _run(name, tmp_path, SPEM_DATA=str(tmp_path / "absent"))
    assert result["tables"] == {}
    assert result["targets"] == []
    assert result["skipped"]


@pytest.mark.skipif(importlib.util.find_spec("fastapi") is None, reason="fastapi is not installed")
def test_explorer_without_a_browser(tmp_path):
    """Without a browser it is told what the first page loads, and that the rest was not run."""
    result = _run("explorer", tmp_path, PATH="", SPEM_BROWSER="")
    (rows,) = result["tables"].values()
    assert sum(row["kB sent"] for row in rows) < 100
    assert [reason.split(":")[0] for reason in result["skipped"]] == ["no browser"]


@pytest.mark.skipif(importlib.util.find_spec("pyamg") is None, reason="pyamg is not installed")
def test_speed_compares_with_every_hierarchy(tmp_path):
    """Each hierarchy of pyamg that is tried stands in the table, with the residual that it reached."""
    result = _run("sweep_speed", tmp_path, SPEM_DATA=str(tmp_path / "absent"))
    assert set(result) == KEYS
    assert any("shrec11" in reason for reason in result["skipped"])
    [rows] = result["tables"].values()
    peers = [row for row in rows if row["method"].startswith("pyamg")]
    assert len(peers) == 5
    assert all(row["residual"] < 1e-7 for row in peers)


def test_speed_without_a_peer_says_so(tmp_path):
    """Where pyamg is not installed the other methods are timed and no ratio to it is given."""
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'pyamg' else find(name, *rest)\n",
        encoding="utf-8",
    )
    paths = os.pathsep.join([str(hidden), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    result = _run("sweep_speed", tmp_path, SPEM_DATA=str(tmp_path / "absent"), PYTHONPATH=paths)
    assert any("pyamg" in reason for reason in result["skipped"])
    methods = {row["method"] for rows in result["tables"].values() for row in rows}
    assert not any("pyamg" in method for method in methods)


def test_sections_are_run_apart(tmp_path):
    """A section that is asked for alone writes a file of its own, and stands in it alone."""
    command = [
        sys.executable,
        str(FOLDER / "gpu_sweep.py"),
        "--quick",
        "--only",
        "host",
        "--out",
        str(tmp_path),
    ]
    subprocess.run(command, capture_output=True, text=True, check=True)
    [path] = tmp_path.glob("*.json")
    assert path.name == "gpu_sweep_host.json"
    [title] = json.loads(path.read_text(encoding="utf-8"))["tables"]
    assert title.startswith("small algebra")


def test_a_section_that_fails_ends_no_other(tmp_path, monkeypatch):
    """The failure of a section is told among what was skipped, and the rest is measured."""
    monkeypatch.syspath_prepend(str(FOLDER))
    from _table import Benchmark

    benchmark = Benchmark("b", "", ["--quick", "--out", str(tmp_path)], ("bad", "good"))
    benchmark.section("bad", lambda: {}["none"])
    benchmark.section("good", lambda: benchmark.table("good", [{"a": 1}]))
    assert benchmark.failed
    kept = json.loads((tmp_path / "b.json").read_text(encoding="utf-8"))
    assert kept["skipped"] == ["bad: FAILED with KeyError: 'none'"]
    assert list(kept["tables"]) == ["good"]


@needs_simulator
def test_gpu_side_is_measured_beside_the_processor(tmp_path, monkeypatch):
    """With a device, here a simulated one, each table has its rows, and kernels have one of their own."""
    monkeypatch.syspath_prepend(str(FOLDER))
    import _sides
    import gpu_sweep

    monkeypatch.setattr(gpu_sweep, "find_device", lambda: (_sides.Device(SimulatedRuntime()), ""))
    monkeypatch.setattr(gpu_sweep, "QUICK_SIZES", (300,))
    monkeypatch.setattr(gpu_sweep, "QUICK_BATCHES", {300: (2,)})
    monkeypatch.setattr(gpu_sweep, "RHOS", (8,))
    sections = [word for name in ("bandwidth", "nodes", "rho", "batch") for word in ("--only", name)]
    with pytest.raises(SystemExit) as stop:
        gpu_sweep.main(["--quick", *sections, "--out", str(tmp_path)])
    assert stop.value.code == 0
    [path] = tmp_path.glob("*.json")
    result = json.loads(path.read_text(encoding="utf-8"))
    assert result["skipped"] == []
    for title, rows in result["tables"].items():
        assert {row.get("side") for row in rows} <= {"CPU", "GPU (the simulator)", None}
        assert title.startswith("kernels") or len(rows) == 2
    assert {row["stage"] for row in result["tables"]["kernels of the GPU, alone"]} == set(gpu_sweep.KERNELS)
