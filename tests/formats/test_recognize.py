"""Files are told apart by their content, and what is not read is refused by name."""

from __future__ import annotations

import re
import tomllib
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats import recognize
from polyins.formats.recognize import LOGS, NOT_READ, data_format

REPOSITORY = Path(__file__).parents[2]


def page_table(heading: str) -> list[list[str]]:
    text = (
        (REPOSITORY / "docs" / "formats.md").read_text(encoding="utf-8").split(f"## {heading}\n")[1].split("\n## ")[0]
    )
    rows = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in text.splitlines() if line[:1] == "|"]
    return rows[2:]


def test_the_page_has_the_table_of_logs() -> None:
    assert page_table("Logs of several streams") == [[log.title, log.name, log.library, log.extra] for log in LOGS]


def test_the_page_names_what_is_not_read() -> None:
    text = (REPOSITORY / "docs" / "formats.md").read_text(encoding="utf-8").split("## Not read yet")[1]
    assert re.findall(r"^- (.*)$", text, re.MULTILINE) == list(NOT_READ)


def test_every_format_has_its_reader_and_its_extra() -> None:
    extras = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for log in LOGS:
        assert find_spec(f"polyins.formats.{log.reader}") is not None
        assert bool(log.library) == bool(log.extra)
        if log.library:
            assert any(entry.startswith(log.library) for entry in extras[log.extra])
            assert log.extra in extras["logs"][0]
    assert "logs" in " ".join(extras["test"])


def random_bytes() -> bytes:
    return np.random.default_rng(2).bytes(56 * 300)


def test_random_bytes_are_no_rows_of_doubles(tmp_path: Path) -> None:
    path = tmp_path / "log.bin"
    path.write_bytes(random_bytes())
    with pytest.raises(InputError, match=r"no known binary format; expected PX4 ULog"):
        data_format(path)


def test_rows_of_doubles_are_known_without_their_first_and_last(tmp_path: Path) -> None:
    path = tmp_path / "log.bin"
    rows = np.column_stack([np.arange(50) / 100.0, np.random.default_rng(4).normal(0.0, 0.1, (50, 6))])
    path.write_bytes(rows.astype("<f8").tobytes()[:-20])
    assert data_format(path) == "kf-gins"


SIGNATURES = {"SQLite": b"SQLite format 3\0", "HDF5": b"\x89HDF\r\n\x1a\n"}


@pytest.mark.parametrize("name", SIGNATURES)
def test_known_signatures_are_refused_by_name(name: str, tmp_path: Path) -> None:
    path = tmp_path / "log.bin"
    path.write_bytes(SIGNATURES[name] + random_bytes())
    known = any(log.fits(path.read_bytes()) for log in LOGS)
    if known:
        pytest.skip(f"{name} is read")
    with pytest.raises(InputError, match=f"looks like .*{name}.*, which is not read"):
        data_format(path)


def test_an_archive_that_is_none_is_said_to_be_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "log.zip"
    path.write_bytes(b"PK\x03\x04" + random_bytes())
    with pytest.raises(InputError, match="is no whole zip archive"):
        data_format(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.007,0.003,0.99,0.18,0.19,-0.09,86024\n0.005,0.002,0.99,0.2,0.1,-0.1,86050\n", None),
        ("0.01 1e-5 2e-5 3e-5 0.1 0.2 -0.1\n0.02 1e-5 2e-5 3e-5 0.1 0.2 -0.1\n", "kf-gins"),
        ("1.0 30.5 114.4 20.0 0.1 0.1 0.2\n2.0 30.5 114.4 20.0 0.1 0.1 0.2\n", "kf-gins-gnss"),
        ("0.025,0.1,0,-1,0,0,0,16,-13,43,0\n0.05,0.1,0,-1,0,0,0,16,-13,43,0\n", None),
        ("2017 0.1 30.5 114.4 20 0 0 0 0 0 90\n2017 0.2 30.5 114.4 20 0 0 0 0 0 90\n", "kf-gins-nav"),
    ],
)
def test_rows_without_header(text: str, expected: str | None, tmp_path: Path) -> None:
    path = tmp_path / "rows.txt"
    path.write_text(text * 1 + text.splitlines()[1] + "\n" if expected else text * 3)
    assert data_format(path) == (expected or "table")


def test_mt_text_is_no_dot(tmp_path: Path) -> None:
    path = tmp_path / "mt.txt"
    path.write_text("// Start Time: Unknown\nAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n0\t0\t9\t0\t0\t0\n")
    assert data_format(path) == "xsens-mt"


def test_a_missing_library_is_named_with_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.ulg"
    path.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(40))
    monkeypatch.setattr("polyins.formats.library.import_module", lambda name: (_ for _ in ()).throw(ImportError(name)))
    with pytest.raises(InputError, match=r"is read with pyulog; expected pip install 'polyins\[px4\]'"):
        recognize.read_log(path)
