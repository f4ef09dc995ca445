"""The hashed file of models and codes."""

from __future__ import annotations

import contextlib
import io
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spem.codes import container
from spem.codes.container import content_hash, read_container, write_container
from spem.errors import ModelError, ParameterError, ReadError

ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b.0": np.array([], np.float32)}


@pytest.fixture
def file(tmp_path):
    """Return a container on disk."""
    write_container(tmp_path / "thing", "things", {"n": 1, "é": [None, "x"]}, ARRAYS)
    return tmp_path / "thing"


def test_what_was_written_is_read(file):
    """Header and arrays come back, with types and shapes."""
    header, arrays = read_container(file, "things")
    assert header == {"n": 1, "é": [None, "x"]}
    assert {name: (a.dtype, a.tolist()) for name, a in arrays.items()} == {
        name: (a.dtype, a.tolist()) for name, a in ARRAYS.items()
    }


def test_equal_contents_make_equal_files(file, tmp_path):
    """Files depend on the contents alone, not on the time."""
    write_container(tmp_path / "again", "things", {"é": [None, "x"], "n": 1}, ARRAYS)
    assert (tmp_path / "again").read_bytes() == file.read_bytes()


def test_hash_sees_values_types_shapes_and_names():
    """Any of them changes the hash; memory layout does not."""
    base = np.arange(6.0).reshape(2, 3)
    variants = [{"a": base}, {"b": base}, {"a": base.T}, {"a": base.astype(np.float32)}, {"a": base + 1}]
    assert len({content_hash({}, arrays) for arrays in variants}) == len(variants)
    assert content_hash({}, {"a": np.asfortranarray(base)}) == content_hash({}, {"a": base})


def test_missing_file_other_kind_and_no_container(file, tmp_path):
    """Each is refused with the file's name and what was expected."""
    with pytest.raises(ReadError, match="absent: no such file; expected spem things"):
        read_container(tmp_path / "absent", "things")
    with pytest.raises(ReadError, match="is a file of spem things, expected spem codes"):
        read_container(file, "codes")
    (tmp_path / "text").write_text("hello")
    with pytest.raises(ReadError, match="text: not a whole file of spem things"):
        read_container(tmp_path / "text", "things")
    (tmp_path / "empty").touch()
    with pytest.raises(ReadError, match="empty: not a whole file"):
        read_container(tmp_path / "empty", "things")


def test_every_truncation_is_refused(file):
    """A file cut at any place is no whole file."""
    whole = file.read_bytes()
    for length in range(0, len(whole), 7):
        file.write_bytes(whole[:length])
        with pytest.raises(ReadError, match=r"not a whole file|do not match"):
            read_container(file, "things")


@given(st.data())
def test_no_changed_byte_passes_unseen(tmp_path_factory, data):
    """With one byte changed, the file is refused or gives the very same contents."""
    path = tmp_path_factory.mktemp("flip") / "thing"
    write_container(path, "things", {"n": 1}, ARRAYS)
    raw = bytearray(path.read_bytes())
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw)
    with contextlib.suppress(ReadError, ModelError):
        header, arrays = read_container(path, "things")
        assert content_hash(header, arrays) == content_hash({"n": 1}, ARRAYS)


def test_value_replaced_by_a_well_formed_one_is_refused(file):
    """An archive that is whole but holds other numbers does not match its hash."""
    with np.load(file) as members:
        changed = {name: members[name] for name in members.files}
    changed["a"] = changed["a"] + 1
    with file.open("wb") as out:
        np.savez(out, **changed)
    with pytest.raises(ReadError, match="do not match their SHA-256"):
        read_container(file, "things")


def test_pickles_and_compressed_members_are_refused(file):
    """Neither code nor zip bombs are unpacked."""
    pickled = io.BytesIO()
    np.save(pickled, np.array([{}], object), allow_pickle=True)
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("header.npy", pickled.getvalue())
    with pytest.raises(ReadError, match="not a whole file"):
        read_container(file, "things")
    with file.open("wb") as out:
        np.savez_compressed(out, header=np.zeros(10**6))
    with pytest.raises(ReadError, match="not a whole file"):
        read_container(file, "things")


def test_later_format_asks_for_an_upgrade(file, monkeypatch):
    """A file of a later layout is told from a damaged one."""
    monkeypatch.setattr(container, "CONTAINER_FORMAT", 2)
    write_container(file, "things", {}, ARRAYS)
    monkeypatch.undo()
    with pytest.raises(ModelError, match="file format 2 is later than 1; upgrade spem"):
        read_container(file, "things")


def test_failed_write_leaves_the_old_file_and_no_other(file):
    """A write that fails half way changes nothing on disk."""
    before = file.read_bytes()
    with pytest.raises(ValueError, match="Object arrays"):
        write_container(file, "things", {}, {"a": ARRAYS["a"], "bad": np.array([{}], object)})
    assert file.read_bytes() == before
    assert [entry.name for entry in file.parent.iterdir()] == ["thing"]


def test_missing_folder_is_named(tmp_path):
    """Writing where there is no folder says so."""
    with pytest.raises(ParameterError, match="cannot be written"):
        write_container(tmp_path / "no" / "thing", "things", {}, {})
