"""Data sets by name: found, downloaded, checked."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from polyins.errors import InputError
from polyins.reading import catalogue, datasets


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        pass


@pytest.fixture
def public(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A data set `small` of two files at an address on this machine."""
    folder = tmp_path / "public"
    (folder / "deep").mkdir(parents=True)
    (folder / "deep" / "a.csv").write_text("1,2\n")
    (folder / "b.csv").write_text("3,4\n")
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    registry = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in ("deep/a.csv", "b.csv")}
    known = catalogue.Dataset("two files", "none", "here", f"http://127.0.0.1:{server.server_port}/")
    monkeypatch.setitem(catalogue.DATASETS, "small", known)
    monkeypatch.setattr(catalogue, "_registry", lambda name: registry)
    monkeypatch.setattr(catalogue, "_cache_folder", lambda name: tmp_path / "cache" / name)
    monkeypatch.setattr(catalogue, "RETRIES", 0)
    monkeypatch.delenv("POLYINS_DATA", raising=False)
    yield folder
    server.shutdown()
    server.server_close()


def test_fetched_once_and_then_kept(public: Path) -> None:
    assert datasets.info("small")["folder"] is None
    folder = datasets.fetch("small")
    assert (folder / "deep" / "a.csv").read_text() == "1,2\n"
    (public / "b.csv").unlink()
    assert datasets.fetch("small") == folder
    assert datasets.info("small")["folder"] == str(folder)


def test_a_file_that_is_not_what_it_was_is_refused(public: Path, tmp_path: Path) -> None:
    (public / "b.csv").write_text("3,5\n")
    with pytest.raises(InputError, match=r"data set small: .*b\.csv cannot be had \(SHA256"):
        datasets.fetch("small")
    assert not (tmp_path / "cache" / "small" / "b.csv").exists()


def test_a_file_that_is_gone_is_named(public: Path) -> None:
    (public / "deep" / "a.csv").unlink()
    with pytest.raises(
        InputError, match=r"deep/a\.csv cannot be had \(404.*; expected it there, or the data set as small"
    ):
        datasets.fetch("small")


def test_the_data_folder_goes_before_the_cache(public: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data" / "small").mkdir(parents=True)
    monkeypatch.setenv("POLYINS_DATA", str(tmp_path / "data"))
    assert datasets.fetch("small") == tmp_path / "data" / "small"


def test_what_is_not_public_is_only_in_the_data_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("POLYINS_DATA", raising=False)
    with pytest.raises(InputError, match="kfgins-parity: is not public; expected it as kfgins-parity in the folder"):
        datasets.fetch("kfgins-parity")


def test_unknown_names_are_told_the_nearest() -> None:
    with pytest.raises(InputError, match="'quadrotors': is unknown; did you mean quadrotor"):
        datasets.info("quadrotors")
    with pytest.raises(InputError, match="expected one of quadrotor, kfgins-parity"):
        datasets.fetch("moon")


def test_known_names() -> None:
    assert {"quadrotor", "kfgins-parity"} <= set(datasets.names())
    assert datasets.info("quadrotor")["files"] == 145
    assert datasets.info("quadrotor")["downloadable"]


def test_a_recording_of_a_data_set_is_described(data_folder: Path) -> None:
    facts = datasets.info("wid/trial08")
    assert facts == datasets.info("wid/08")
    assert facts["name"] == "wid/trial08"
    assert facts["folder"] == str((data_folder / "wid" / "trial08").resolve())
    assert facts["imus"][-1] == "CAR"  # type: ignore[index]
    assert (facts["start_s"], facts["end_s"]) == (12.7, 123.3)
    with pytest.raises(InputError, match="no trial 'trial99'; expected one of trial02"):
        datasets.info("wid/trial99")
    with pytest.raises(InputError, match="data set quadrotor: has no recordings by name"):
        datasets.info("quadrotor/path_1")


def test_checksums_are_those_of_the_files(data_folder: Path) -> None:
    import gzip

    registry = catalogue._registry("quadrotor")
    for path in ("Horizontal/path_9/IMU_1.csv", "Horizontal/path_27/GT.csv", "Vertical/path_8/IMU_4.csv"):
        content = gzip.decompress((data_folder / "quadrotor" / f"{path}.gz").read_bytes())
        assert registry[path] == f"sha256:{hashlib.sha256(content).hexdigest()}"
