"""The files of a log that is a folder, or a zip archive, by their names in it."""

from __future__ import annotations

import gzip
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from zipfile import ZipFile

from polyins.errors import InputError
from polyins.files import find, read_bytes, read_head

ZIP_MAGIC = b"PK\x03\x04"
LISTING = b"files:\n"
"""what the head of a folder or an archive begins with; the names follow, a line each"""
DEEPEST = 4
MOST_NAMES = 4096
MOST_OF_A_FOLDER = 64
"""of files whose names are looked at: recordings with pictures have very many"""


@dataclass(frozen=True)
class Bundle:
    """A folder, or a zip archive that is read as one."""

    path: Path

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of files in it, with `/` between folders and without `.gz`; of a folder with very many, some."""
        if self.path.is_dir():
            return tuple(islice(_names(self.path, "", DEEPEST), MOST_NAMES))
        with _archive(self.path) as archive:
            return tuple(name for name in archive.namelist() if not name.endswith("/"))

    def found(self, pattern: str) -> dict[str, str]:
        """Return the names that end in what a regular expression says, by what its group says.

        Raises InputError if they stand in several folders: those are several recordings.
        """
        fitting = re.compile(rf"((?:.*?/)??){pattern}")
        matches = [match for name in self.names if "__MACOSX/" not in name and (match := fitting.fullmatch(name))]
        folders = sorted({match[1] for match in matches})
        if len(folders) > 1:
            each = ", ".join(folder.rstrip("/") or "itself" for folder in folders)
            raise InputError(f"{self.path}: holds several recordings; expected one of {each}")
        return {match[2]: match[0] for match in matches}

    def inside(self, folder: str) -> list[str]:
        """Return the names of all files directly in a folder, in order."""
        if self.path.is_dir():
            return [f"{folder}/{entry.name}" for entry in sorted((self.path / folder).iterdir()) if entry.is_file()]
        return sorted(name for name in self.names if name.rpartition("/")[0] == folder)

    def read(self, name: str) -> bytes:
        """Return the content of a file; raises InputError if it is damaged or empty."""
        return self.read_all([name])[0]

    def read_all(self, names: Sequence[str]) -> list[bytes]:
        """Return the contents of files; raises InputError as `read` does."""
        if self.path.is_dir():
            return [read_bytes(self.path / name) for name in names]
        with _archive(self.path) as archive:
            return [self._unpacked(archive, name) for name in names]

    def _unpacked(self, archive: ZipFile, name: str) -> bytes:
        try:
            content = archive.read(name)
        except Exception as error:  # damage makes it raise whatever it stumbles over
            raise InputError(f"{self.path}, {name}: cannot be unpacked ({error}); is it damaged?") from error
        if not content.strip():
            raise InputError(f"{self.path}, {name}: is empty; expected data")
        return gzip.decompress(content) if name.endswith(".gz") else content


def is_bundle(path: str | Path) -> bool:
    """Whether it is a folder or a zip archive."""
    found = find(path)
    return found.is_dir() or (found.suffix != ".gz" and read_head(found, 4) == ZIP_MAGIC)


def head(path: str | Path, count: int) -> bytes:
    """Return what a log is recognised by: the first bytes of a file, the names in a folder or an archive.

    A folder that all of them are in is left out.
    """
    if not is_bundle(path):
        return read_head(path, count)
    names = [name for name in Bundle(find(path)).names if "__MACOSX/" not in name]
    while names and len({name.partition("/")[0] for name in names}) == 1 and all("/" in name for name in names):
        names = [name.partition("/")[2] for name in names]
    return LISTING + "\n".join(names).encode()


def state(path: Path) -> tuple[int, int]:
    """Return when a file, or the last of those in a folder, changed, ns, and the size of all."""
    files = [path / name for name in Bundle(path).names] if path.is_dir() else [path]
    known = [find(file).stat() for file in files]
    return max((one.st_mtime_ns for one in known), default=0), sum(one.st_size for one in known)


def _archive(path: Path) -> ZipFile:
    try:
        return ZipFile(path)
    except Exception as error:  # damage makes it raise whatever it stumbles over
        raise InputError(f"{path}: is no whole zip archive ({error}); is it cut off?") from error


def _names(folder: Path, prefix: str, deep: int) -> Iterator[str]:
    try:
        with os.scandir(folder) as listed:
            entries = sorted(listed, key=lambda entry: entry.name)
    except OSError as error:
        raise InputError(f"{folder}: cannot be listed ({error.strerror})") from error
    files = [entry for entry in entries if entry.is_file()]
    for entry in files[:MOST_OF_A_FOLDER]:
        yield prefix + entry.name.removesuffix(".gz")
    folders = [entry for entry in entries if entry.is_dir() and not entry.is_symlink()] if deep > 1 else []
    for entry in folders[:MOST_OF_A_FOLDER]:
        yield from _names(Path(entry), f"{prefix}{entry.name}/", deep - 1)
