"""Files: found with or without `.gz`, written whole or not at all."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from polyins.errors import InputError
from polyins.files import find, new_file, plain_suffix, read_bytes, read_text, whole, whole_folder, write_bytes


def test_plain_goes_before_packed(tmp_path: Path) -> None:
    (tmp_path / "a.txt.gz").write_bytes(gzip.compress(b"packed"))
    assert read_bytes(tmp_path / "a.txt") == b"packed"
    (tmp_path / "a.txt").write_bytes(b"plain")
    assert read_bytes(tmp_path / "a.txt") == b"plain"
    assert read_bytes(tmp_path / "a.txt.gz") == b"packed"


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.txt: no such file; expected it there, plain or as a\.txt\.gz"):
        find(tmp_path / "a.txt")


def test_byte_order_mark_is_not_text(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_bytes(b"\xef\xbb\xbfname: x")
    assert read_text(tmp_path / "a.yaml") == "name: x"
    (tmp_path / "b.yaml").write_bytes(b"name: \xff")
    with pytest.raises(InputError, match="byte 6 is not text"):
        read_text(tmp_path / "b.yaml")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_bytes(path, b"old")

    def fail() -> None:
        with whole(path) as beside:
            beside.write_bytes(b"half")
            raise RuntimeError("disk")

    with pytest.raises(RuntimeError):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_written_in_a_new_folder_and_packed_by_name(tmp_path: Path) -> None:
    write_bytes(tmp_path / "new" / "a.csv.gz", b"text")
    assert gzip.decompress((tmp_path / "new" / "a.csv.gz").read_bytes()) == b"text"
    assert plain_suffix("a.CSV.gz") == ".csv"
    assert plain_suffix("a.parquet") == ".parquet"


def test_a_folder_is_whole_or_absent(tmp_path: Path) -> None:
    target = tmp_path / "out"

    def fails() -> None:
        with whole_folder(target) as beside:
            (beside / "half").write_text("half")
            raise ValueError("on the way")

    with pytest.raises(ValueError, match="on the way"):
        fails()
    assert not list(tmp_path.iterdir())
    with whole_folder(target) as beside:
        (beside / "whole").write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert (target / "whole").read_text() == "whole"


def test_what_exists_is_no_new_file(tmp_path: Path) -> None:
    assert new_file(str(tmp_path / "a")) == tmp_path / "a"
    with pytest.raises(InputError, match="exists; expected the name of a new one"):
        new_file(tmp_path)
