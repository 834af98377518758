"""Folders and zip archives read as one log."""

from __future__ import annotations

import gzip
import zipfile
from pathlib import Path

import pytest

from polyins.errors import InputError
from polyins.formats.bundle import Bundle, head, is_bundle, state
from polyins.formats.recognize import data_format


def folder_with(tmp_path: Path, *names: str) -> Path:
    for name in names:
        (tmp_path / "log" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "log" / name).write_text(f"this is {name}")
    return tmp_path / "log"


def test_names_and_contents(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a/imu.csv", "b.csv")
    (folder / "a" / "packed.csv.gz").write_bytes(gzip.compress(b"packed"))
    archive = tmp_path / "log.zip"
    with zipfile.ZipFile(archive, "w") as file:
        for name in ("a/imu.csv", "b.csv"):
            file.write(folder / name, name)
    assert is_bundle(folder)
    assert is_bundle(archive)
    assert not is_bundle(folder / "b.csv")
    assert head(archive, 10) == b"files:\na/imu.csv\nb.csv"
    assert Bundle(folder).names == ("b.csv", "a/imu.csv", "a/packed.csv")
    assert Bundle(folder).read("a/packed.csv") == b"packed"
    for bundle in (Bundle(folder), Bundle(archive)):
        assert bundle.found(r"a/(\w+)\.csv")["imu"] == "a/imu.csv"
        assert bundle.read("a/imu.csv") == b"this is a/imu.csv"


def test_files_of_several_recordings_are_not_mixed(tmp_path: Path) -> None:
    bundle = Bundle(folder_with(tmp_path, "one/Gyroscope.csv", "two/Location.csv", "two/meta/time.csv"))
    with pytest.raises(InputError, match="holds several recordings; expected one of one, two"):
        bundle.found(r"(Gyroscope|Location)\.csv")
    assert bundle.found(r"(?:meta/)?(Location|time)\.csv") == {
        "Location": "two/Location.csv",
        "time": "two/meta/time.csv",
    }


def test_of_pictures_not_all_names_are_taken(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, *(f"{k:03}.png" for k in range(100)), "imu0/data.csv")
    assert "imu0/data.csv" in Bundle(folder).names
    assert len(Bundle(folder).names) == 65


def test_an_archive_that_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("imu0/data.csv", "x" * 1000)
    whole = path.read_bytes()
    path.write_bytes(whole[:500])
    with pytest.raises(InputError, match="is no whole zip archive"):
        head(path, 10)
    central = whole.index(b"PK\x01\x02")
    path.write_bytes(whole[: central + 6] + b"\xcd" + whole[central + 7 :])  # a version that there is not
    with pytest.raises(InputError, match="is no whole zip archive"):
        head(path, 10)
    path.write_bytes(whole.replace(b"xxxx", b"xyxx", 1))
    with pytest.raises(InputError, match="cannot be unpacked"):
        Bundle(path).read("imu0/data.csv")


def test_a_change_of_a_file_in_a_folder_is_seen(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, "a/imu.csv")
    before = state(folder)
    (folder / "a" / "imu.csv").write_text("more than before")
    assert state(folder) != before


@pytest.mark.parametrize("name", ["Gyroscope.csv", "imu0/data.csv", "oxts/timestamps.txt", "imuShort.txt"])
def test_a_folder_of_many_things_is_not_taken_for_a_log_in_it(name: str, tmp_path: Path) -> None:
    folder = folder_with(tmp_path, f"a/b/{name}", "a/b/x/other.txt")
    assert data_format(folder) in ("phone", "euroc", "kitti-oxts", "sbg")
    with pytest.raises(InputError, match="is a folder of no known log"):
        data_format(folder_with(tmp_path, "notes.txt"))


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder of no known log; expected a file, or ROS 2 bag, EuRoC"):
        data_format(folder_with(tmp_path, "notes.txt"))
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("notes.txt", "x")
    with pytest.raises(InputError, match="looks like a zip archive, which is not read"):
        data_format(path)
