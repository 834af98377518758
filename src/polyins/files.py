"""Files on disk: found with or without `.gz`, read whole, written whole or not at all."""

from __future__ import annotations

import gzip
import os
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

from polyins.errors import InputError


def find(path: str | Path) -> Path:
    """Return the path, or the path with `.gz` added if only that exists.

    A folder is found too, and refused where it is read as a file. Raises InputError if nothing is there.
    """
    path = Path(path)
    packed = path.with_name(path.name + ".gz")
    for candidate in (path, packed):
        if candidate.is_file():
            return candidate
    if path.is_dir():
        return path
    raise InputError(f"{path}: no such file; expected it there, plain or as {packed.name}")


def find_named(name: str) -> Path:
    """Return the path of a file that a configuration names; raises InputError as `find` does, and for no name."""
    if not name:
        raise InputError("is missing; expected the name of a file")
    return find(name)


def _file(path: str | Path) -> Path:
    found = find(path)
    if found.is_dir():
        raise InputError(f"{found}: is a folder; expected a file")
    return found


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file, unpacked if its name ends in `.gz`.

    Raises InputError if it is missing, unreadable, empty, or named `.gz` without being gzip.
    """
    found = _file(path)
    try:
        content = found.read_bytes()
        if found.suffix == ".gz":
            content = gzip.decompress(content)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"{found}: cannot be unpacked ({error}); expected a whole gzip file") from error
    except OSError as error:
        raise InputError(f"{found}: cannot be read ({error.strerror})") from error
    if not content or content.isspace():
        raise InputError(f"{found}: is empty; expected data")
    return content


@contextmanager
def opened(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file to be read in order, unpacked if its name ends in `.gz`; raises InputError as `read_bytes` does."""
    found = _file(path)
    try:
        with gzip.open(found) if found.suffix == ".gz" else found.open("rb") as file:
            yield cast(IO[bytes], file)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"{found}: cannot be unpacked ({error}); expected a whole gzip file") from error
    except OSError as error:
        raise InputError(f"{found}: cannot be read ({error.strerror})") from error


def read_head(path: str | Path, count: int) -> bytes:
    """Return the first bytes of a file, unpacked if its name ends in `.gz`; raises InputError as `read_bytes` does."""
    with opened(path) as file:
        head = file.read(count)
    return head if head.strip() else read_bytes(path)[:count]


def read_text(path: str | Path) -> str:
    """Return the content of a text file (UTF-8, with or without byte order mark)."""
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{find(path)}: byte {error.start} is not text; expected a text file (UTF-8)") from error


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Give the path of a new file beside `path` that takes its name when the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        beside.chmod(0o644)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Give the path of a new folder beside `path` that takes its name when the block ends without an error."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as around:
        beside = Path(around) / path.name
        beside.mkdir()
        yield beside
        beside.rename(path)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file whole, packed if its name ends in `.gz`."""
    with whole(path) as beside:
        beside.write_bytes(gzip.compress(content, mtime=0) if Path(path).suffix == ".gz" else content)


def new_file(path: str | Path) -> Path:
    """Return the path of a file, or folder, that is to be made; raises InputError if there is one."""
    if Path(path).exists():
        raise InputError(f"{path}: exists; expected the name of a new one")
    return Path(path)


def plain_suffix(path: str | Path) -> str:
    """Return the suffix in lower case, that under `.gz` for a packed file: `.csv` for `a.csv.gz`."""
    path = Path(path)
    return (Path(path.stem) if path.suffix == ".gz" else path).suffix.lower()


def make_folder(folder: Path) -> None:
    """Make the folder of a command's files before any long work; raise InputError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be a folder ({error.strerror}); expected a place to write") from error
