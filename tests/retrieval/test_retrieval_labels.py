"""Labels of a collection."""

from __future__ import annotations

import pytest

from spem.errors import LabelError, ReadError
from spem.retrieval.labels import match_labels, read_labels, unused_labels

CLA = "PSB 1\n3 3\n\nanimal 0 0\n\ncat animal 2\n12\n7\n\ndog animal 1\n3\n"


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a labels file."""

    def write(text, name="labels.csv"):
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        "file,label\na.png,cat\nb.png,dog\n",
        "a.png,cat\nb.png,dog\n",
        "\ufefffile,label\r\na.png,cat\r\n\r\nb.png,dog\r\n",
        "Label,size,File\ncat,3,a.png\ndog,,b.png\n",
        'file,label\n"a.png", cat\nb.png,dog',
    ],
)
def test_tables_are_read_in_all_their_forms(write, text):
    """With and without header, any order of columns, byte order marks, blank lines and quotes."""
    assert read_labels(write(text)) == {"a.png": "cat", "b.png": "dog"}


def test_princeton_classifications_are_read(write):
    """The label is the class that lists the model, not the class above it."""
    assert read_labels(write(CLA, "test.cla")) == {"12": "cat", "7": "cat", "3": "dog"}
    assert read_labels(write(CLA, "test.txt")) == read_labels(write(CLA, "test.cla"))


def test_classes_of_one_name_are_told_apart_by_their_parents(write):
    """Other animals and other cars are two classes; a name that one parent has stays as it is."""
    classes = "animal 0 0\ncar 0 0\nother animal 1\n1\nother car 2\n2\n3\nother 0 1\n4\ncat animal 1\n5\n"
    text = f"PSB 1\n6 5\n{classes}"
    assert read_labels(write(text, "test.cla")) == {
        "1": "animal/other", "2": "car/other", "3": "car/other", "4": "other", "5": "cat"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            'a.png,"cat' + 140_000 * "\nb.png,dog",
            r"not a table of 'file,label' \(field larger .*a quote that",
        ),
        ("file,label\na.png,cat\nb.png\n", r"labels.csv, line 3: expected 'file,label', got 'b.png'"),
        ("a.png,cat\nb.png,\n", r"line 2: expected 'file,label', got 'b.png,'"),
        ("name,label\na.png,cat\n", r"line 1: expected columns 'file' and 'label', got 'name,label'"),
        ("a.png,cat\nb.png,dog\na.png,dog\n", r"line 3: a.png is labelled 'dog' here and 'cat' before"),
        ("file,label\n", r"no label found"),
        ("", r"no label found"),
        ("PSB 1\nnine\n", r"line 1: expected 'PSB 1' and then"),
        ("PSB 1\n1 2\ncat 0 2\n12\n7 8\n", r"line 5: expected one of 1 more models of cat, got '7 8'"),
        ("PSB 1\n1 2\ncat two\n", r"line 3: expected 'class parent number', got 'cat two'"),
        ("PSB 1\n1 2\ncat 0 2\n12\n", r"1 classes and 1 models found, 1 and 2 announced"),
    ],
)
def test_malformed_files_are_refused_with_their_line(write, text, message):
    """File, line number and line are in the message."""
    with pytest.raises(LabelError, match=message):
        read_labels(write(text))


def test_unreadable_files_are_refused(write, tmp_path):
    """A missing file and a file that is not text are read errors."""
    with pytest.raises(ReadError, match=r"none.csv: no such file; expected labels"):
        read_labels(tmp_path / "none.csv")
    with pytest.raises(ReadError, match="is not UTF-8 text"):
        read_labels(write(b"\xff\xfe\x00\x01"))


def test_shapes_are_matched_by_name_stem_and_number(tmp_path):
    """Full name, file name, name without ending, and the number at the end of a name."""
    labels = {"x/a.png": "cat", "b.png": "dog", "c": "ant", "12": "man", "007": "bird"}
    names = ["x/a.png", tmp_path / "a.png", "y/b.png", "b", "c.obj", "T12.obj", "m12", "12.off", "m7"]
    with pytest.raises(LabelError, match="label 12 fits both T12 and m12"):
        match_labels(names, labels)
    names.remove("m12")
    names[-2:] = ["T7"]
    assert match_labels(names, labels) == ["cat", "cat", "dog", "dog", "ant", "man", "bird"]


def test_shapes_of_one_file_name_are_matched_by_their_folders(tmp_path):
    """The longest end of a path that fits decides, with or without the ending of the name."""
    names = ["dup/a/x.png", tmp_path / "dup" / "b" / "x.png", "dup/c/x.png"]
    labels = {"a/x.png": "A", "b/x": "B", "x.png": "C"}
    assert match_labels(names, labels) == ["A", "B", "C"]
    assert unused_labels(names[:2], labels) == ["x.png"]
    assert match_labels(["x.png"], labels) == ["C"]
    assert match_labels(["a/x.png", "b/x.png"], {"up/a/x.png": "A", "./up/b/x.png": "B"}) == ["A", "B"]
    with pytest.raises(LabelError, match=r"c/x\.png: several labels fit this name"):
        match_labels(["c/x.png"], {"a/x.png": "A", "b/x.png": "B"})


def test_a_name_that_several_labels_fit_is_refused():
    """Files that differ in their ending alone must agree in their label."""
    assert match_labels(["a"], {"a.png": "cat", "a.obj": "cat"}) == ["cat"]
    assert match_labels(["a.png"], {"a.png": "cat", "a.obj": "dog"}) == ["cat"]
    with pytest.raises(LabelError, match="a: several labels fit this name"):
        match_labels(["a"], {"a.png": "cat", "a.obj": "dog"})


def test_shapes_without_a_label_are_named_and_counted():
    """The first few and their number, and what to do."""
    names = [f"{c}.png" for c in "abcdef"]
    with pytest.raises(LabelError, match=r"5 of 6 shapes have no label: b.png, c.png, d.png, ...; add lines"):
        match_labels(names, {"a.png": "cat"})


def test_labels_of_absent_files_are_reported():
    """Labels that fit no shape are listed in their order."""
    labels = {"z.png": "cat", "a.png": "dog", "m": "ant"}
    assert unused_labels(["a.png"], labels) == ["z.png", "m"]
    assert unused_labels(["a", "z", "m.off"], labels) == []


@pytest.mark.data
def test_the_two_label_files_of_shrec11_agree(data_dir):
    """The classification and the table label the same 600 meshes alike, up to the names of classes."""
    folder = data_dir / "shrec11"
    names = sorted(path.name for path in folder.glob("*.obj"))
    classes = match_labels(names, read_labels(folder / "test.cla"))
    table = match_labels(names, read_labels(folder / "labels.csv"))
    assert len(names) == 600
    assert len(set(classes)) == len(set(table)) == len(set(zip(classes, table, strict=True))) == 30
    assert unused_labels(names, read_labels(folder / "test.cla")) == []
