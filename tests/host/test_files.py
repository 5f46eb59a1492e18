"""A written file is complete or absent."""

import os
from pathlib import Path

import pytest

from tauperp import files


def test_the_content_is_written_and_folders_are_made(tmp_path: Path) -> None:
    files.write_atomically(tmp_path / "a" / "b.txt", "Nm\u00b2")
    assert (tmp_path / "a" / "b.txt").read_bytes() == "Nm\u00b2".encode()


def test_an_old_file_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    files.write_atomically(tmp_path / "x", b"old")
    files.write_atomically(tmp_path / "x", b"new")
    assert os.listdir(tmp_path) == ["x"]
    assert (tmp_path / "x").read_bytes() == b"new"


def test_an_open_reader_keeps_the_old_content(tmp_path: Path) -> None:
    files.write_atomically(tmp_path / "x", b"old")
    with open(tmp_path / "x", "rb") as reader:
        files.write_atomically(tmp_path / "x", b"new")
        assert reader.read() == b"old"


def test_a_failure_half_way_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files.write_atomically(tmp_path / "x", b"old")

    def full_disk(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full_disk)
    with pytest.raises(OSError, match="No space"):
        files.write_atomically(tmp_path / "x", b"new")
    assert os.listdir(tmp_path) == ["x"]
    assert (tmp_path / "x").read_bytes() == b"old"


def test_a_folder_of_the_same_name_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError) as error:
        files.write_atomically(tmp_path, b"data")
    assert error.value.filename == str(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_repository_root_holds_the_wire() -> None:
    assert files.dbc_path().is_file()
