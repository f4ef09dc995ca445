"""search, evaluate: answers, scores, reports, and what is refused."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from spem.codes.collection import encode_collection
from spem.codes.container import read_container, write_container
from spem.codes.settings import Settings
from spem.codes.sources import find_files
from spem.collections import evaluate
from spem.errors import LabelError
from spem.fields.rho import squared
from spem.retrieval.evaluation import MEASURES

Spem = Callable[..., Result]
Start = Callable[..., subprocess.Popen[str]]

N_MANY = 80
QUICK = ("--own-grid", "--features", "spem", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")


def ellipse(a: float, b: float, half: int = 18) -> np.ndarray:
    """Return the mask of an ellipse with semi-axes `a` and `b`."""
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    return (x / a) ** 2 + (y / b) ** 2 < 1


def test_search_ranks(spem: Spem, folder: Path, codes: Path) -> None:
    """A file of the collection finds itself first, by path or by name, then its class."""
    answers = json.loads(spem("search", codes, folder / "long1.npy", "-k", "3", "--json").stdout)
    assert [answer["rank"] for answer in answers] == [1, 2, 3]
    assert answers[0]["name"] == "long1"
    assert answers[0]["distance"] == pytest.approx(0, abs=1e-9)
    assert set(answers[0]) == {"rank", "name", "path", "distance"}
    assert "long1" in spem("search", codes, "long1").stdout.splitlines()[1]


def test_search_by_a_new_file(spem: Spem, codes: Path, tmp_path: Path) -> None:
    """A file that is not of the collection is coded with its model."""
    np.save(tmp_path / "new.npy", ellipse(11, 11.5))
    result = spem("search", codes, tmp_path / "new.npy", "--json")
    assert json.loads(result.stdout)[0]["name"].startswith("round")


@pytest.mark.parametrize(("query", "word"), [("nobody", "no such file or coded shape"), ("", "folder")])
def test_search_refuses_bad_queries(spem: Spem, codes: Path, query: str, word: str, tmp_path: Path) -> None:
    """A query that is neither a file nor a name is refused."""
    result = spem("search", codes, query or tmp_path)
    assert result.exit_code == 2
    assert word in result.stderr or "no such" in result.stderr


def test_codes_of_another_version(spem: Spem, codes: Path) -> None:
    """Codes of another version of the method are refused, with what to do."""
    header, arrays = read_container(codes, "codes")
    header["settings"]["code_format"] += 1
    write_container(codes, "codes", header, arrays)
    result = spem("search", codes, "long1")
    assert result.exit_code == 2
    assert "upgrade spem" in result.stderr


def test_truncated_codes(spem: Spem, codes: Path) -> None:
    """Codes that are cut short are refused."""
    codes.write_bytes(codes.read_bytes()[:300])
    result = spem("search", codes, "long1")
    assert result.exit_code == 2
    assert "truncated" in result.stderr


def test_adding_with_another_vocabulary(spem: Spem, folder: Path, codes: Path, tmp_path: Path) -> None:
    """A vocabulary that is not the one of the codes there is refused."""
    other = tmp_path / "other.spem"
    assert spem("encode", folder, "-o", other, *QUICK, "--seed", "9").exit_code == 0
    result = spem("encode", folder, "-o", codes, "--vocabulary", other)
    assert result.exit_code == 2
    assert "another vocabulary" in result.stderr


def test_evaluate_scores(spem: Spem, folder: Path, codes: Path, tmp_path: Path) -> None:
    """Scores in percent, on stdout for people and as JSON in a file, and a report."""
    options = ("--json", tmp_path / "s.json", "--report", tmp_path / "report")
    result = spem("evaluate", codes, "--labels", folder / "labels.csv", *options)
    assert result.exit_code == 0, result.stderr
    facts = json.loads((tmp_path / "s.json").read_text())
    assert {"NN", "FT", "ST", "E", "DCG", "n_shapes", "n_classes", "per_class"} <= set(facts)
    assert (facts["n_shapes"], facts["n_classes"]) == (9, 3)
    assert facts["NN"] > 80
    assert 80 < facts["bulls_eye"] <= 100
    assert "9 shapes in 3 classes" in result.stdout
    assert result.stdout.splitlines()[1].split() == [*MEASURES, "bull's", "eye"]
    page = (tmp_path / "report" / "report.html").read_text()
    assert "round0" in page
    assert f"{facts['bulls_eye']:.1f}" in page
    assert "data:image/png" in page


def test_size_alone_is_a_control(spem: Spem, folder: Path, codes: Path) -> None:
    """What size alone would score stands beside the scores of codes, and sizes can be matched."""
    options = ("evaluate", codes, "--labels", folder / "labels.csv")
    facts = json.loads(spem(*options, "--json", "-").stdout)
    assert set(facts["size_alone"]) == {*MEASURES, "bulls_eye"}
    assert "size alone" in spem(*options).stdout
    matched = json.loads(spem(*options, "--matched-size", "1.6", "--json", "-").stdout)
    assert matched["matched_size"] == 1.6
    assert matched["n_skipped"] < 9
    refused = spem(*options, "--matched-size", "0.5")
    assert refused.exit_code == 2
    assert "at least 1" in refused.stderr
    page = spem(*options, "--matched-size", "1.6", "--report", codes.parent / "report")
    assert page.exit_code == 2
    assert "whole collection" in page.stderr


def test_evaluate_classifies_when_asked(spem: Spem, folder: Path, codes: Path) -> None:
    """With --split the accuracy over splits comes beside the scores; the seed decides what it is."""
    options = ("evaluate", codes, "--labels", folder / "labels.csv", "--split", "2", "--repeats", "3")
    told = spem(*options)
    assert told.exit_code == 0, told.stderr
    assert "2 of each class for training, 3 splits" in told.stdout.splitlines()[-1]
    first, again = (json.loads(spem(*options, "--json", "-", "--seed", "5").stdout) for _ in range(2))
    found = first["classification"]
    assert found == again["classification"]
    assert (found["n_train"], found["repeats"], set(found["per_class"])) == (2, 3, set(first["per_class"]))
    assert 0 <= found["accuracy"] <= 100
    refused = spem("evaluate", codes, "--labels", folder / "labels.csv", "--split", "3")
    assert refused.exit_code == 2
    assert "expected more than the 3 for training" in refused.stderr


def test_unlabelled_shapes_are_left_out_when_asked(
    spem: Spem, folder: Path, codes: Path, tmp_path: Path
) -> None:
    """Shapes without a label stop the scoring, unless they are left out, which is told."""
    table = folder / "labels.csv"
    rows = table.read_text().splitlines()
    table.write_text("\n".join(row for row in rows if not row.startswith("oval")))
    refused = spem("evaluate", codes, "--labels", table)
    assert refused.exit_code == 2
    assert "3 of 9 shapes have no label" in refused.stderr
    assert "--ignore-unlabelled" in refused.stderr
    options = ("--labels", table, "--ignore-unlabelled", "--json", tmp_path / "s.json")
    result = spem("evaluate", codes, *options)
    assert result.exit_code == 0, result.stderr
    assert result.stderr == "spem: 3 shapes without a label left out\n"
    assert result.stdout.startswith("6 shapes in 2 classes")
    assert result.stdout.endswith(f"wrote {tmp_path / 's.json'}\n")
    assert evaluate(codes, table, ignore_unlabelled=True).mean()["NN"] > 80
    with pytest.raises(LabelError, match="none of the 9 shapes has a label"):
        evaluate(codes, {"nobody": "cat"}, ignore_unlabelled=True)


def test_report_tells_of_shapes_that_are_gone(
    spem: Spem, folder: Path, codes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shapes are drawn from any working directory; those that are gone are counted in one line."""
    monkeypatch.chdir(tmp_path)
    assert spem("encode", "shapes", "-o", "relative.spem", *QUICK).exit_code == 0
    options = ("--labels", folder / "labels.csv", "--report", tmp_path / "report")
    monkeypatch.chdir("/")
    result = spem("evaluate", tmp_path / "relative.spem", *options)
    assert (result.exit_code, result.stderr) == (0, "")
    (folder / "long0.npy").unlink()
    result = spem("evaluate", tmp_path / "relative.spem", *options)
    [line] = result.stderr.splitlines()
    assert "1 of 9 shapes could not be drawn for the report: " in line
    assert line.endswith("long0.npy is not there")


def test_report_shows_the_maps_of_the_codes(
    spem: Spem, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The maps in a report are those of the first band, by the scheme and the centring of the settings."""
    settings = Settings(
        features="spem",
        voxels=None,
        rho_ranges=((0.05, 0.2), (0.2, 0.4)),
        n_maps=5,
        n_centers=4,
        n_rho=9,
        scheme="squared",
        centred=True,
    )
    shown, codes = [], tmp_path / "c.spem"
    encode_collection(find_files([folder / "*.npy"]), settings).save(codes)
    monkeypatch.setattr("spem.cli.report.map_picture", shown.append)
    result = spem("evaluate", codes, "--labels", folder / "labels.csv", "--report", tmp_path / "report")
    assert result.exit_code == 0, result.stderr
    assert len(shown) == 3
    for maps in shown:
        size = maps.shape.size
        np.testing.assert_allclose(maps.rho, squared(0.05 * size, 0.2 * size, 9))
        assert maps.values.shape[1] == 4
        np.testing.assert_allclose(maps.values.mean(axis=0), 0, atol=1e-6)


def test_evaluate_writes_json_to_stdout(spem: Spem, folder: Path, codes: Path) -> None:
    """--json - writes nothing but JSON to stdout."""
    result = spem("evaluate", codes, "--labels", folder / "labels.csv", "--json", "-")
    assert json.loads(result.stdout)["n_classes"] == 3


@pytest.mark.parametrize(
    ("edit", "status", "word"),
    [
        (lambda rows: rows[:-2], 2, "2 of 9 shapes have no label"),
        (lambda rows: [*rows, "ghost.npy,ghost"], 0, "such as ghost.npy"),
        (lambda rows: [*rows[:-1], "oval2.npy,lonely"], 0, "alone in a class of one"),
        (
            lambda rows: [f"{row.split(',')[0]},c{i}" if i else row for i, row in enumerate(rows)],
            2,
            "two shapes",
        ),
        (lambda _: [""], 2, "no label found"),
    ],
)
def test_labels_that_do_not_fit(
    spem: Spem, folder: Path, codes: Path, edit: Callable[[list[str]], list[str]], status: int, word: str
) -> None:
    """Missing labels are an error; labels without a shape and classes of one are told."""
    table = folder / "labels.csv"
    table.write_text("\n".join(edit(table.read_text().splitlines())) + "\n")
    result = spem("evaluate", codes, "--labels", table)
    assert result.exit_code == status
    assert word in result.stderr
