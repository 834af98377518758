"""A YAML 1.2 file as plain Python values that remember their line numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import Any

from polyins.errors import InputError
from polyins.files import find, read_text

Key = str | int


class Document:
    """The mapping that a YAML file holds, and where its keys stand."""

    def __init__(self, path: Path, tree: Any, duplicate: str = "") -> None:
        self.path = path
        self.values: dict[str, Any] = _plain(tree)
        self.duplicate = duplicate
        """says which key is given twice, if one is; the first one counts"""
        self._tree = tree

    def place(self, keys: Sequence[Key]) -> str:
        """Name a value as `file, line 3: imus[0].axes`; a key that is not in the file has the line of its parent."""
        line = self._line(keys)
        where = f"{self.path}, line {line}" if line else str(self.path)
        return f"{where}: {key_path(keys)}" if keys else where

    def error(self, keys: Sequence[Key], problem: str) -> InputError:
        """Return the error to raise for a value, which says where it stands."""
        return InputError(f"{self.place(keys)}: {problem}")

    @contextmanager
    def at(self, keys: Sequence[Key]) -> Iterator[None]:
        """Put the place of a value before the message of an InputError from the block."""
        try:
            yield
        except InputError as error:
            raise self.error(keys, str(error)) from error

    def _line(self, keys: Sequence[Key]) -> int | None:
        node: Any = self._tree
        line = None
        for key in keys:
            try:
                line = (node.lc.item if isinstance(key, int) else node.lc.key)(key)[0] + 1
                node = node[key]
            except (KeyError, IndexError, TypeError, AttributeError):
                break
        return line


def read_yaml(path: str | Path) -> Document:
    """Read a YAML file whose top level is a mapping.

    Raises InputError with the line for anything else, except for a key that is given twice: `Document.duplicate`
    says so and the reader of the configuration decides.
    """
    return as_document(find(path), read_text(path))


def as_document(found: Path, text: str) -> Document:
    """Return what a text of YAML holds, whose names count from the folder of `found`; raises as `read_yaml` does."""
    from ruamel.yaml import YAML
    from ruamel.yaml.constructor import DuplicateKeyError
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    duplicate = ""
    try:
        try:
            tree = YAML().load(text)
        except DuplicateKeyError as error:
            line = error.problem_mark.line + 1
            duplicate = f"{found}, line {line}: {error.problem.split(' with value')[0].strip()}"
            reader = YAML()
            reader.allow_duplicate_keys = True
            tree = reader.load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f", line {mark.line + 1}" if mark else ""
        raise InputError(f"{found}{line}: {error.problem or error.context}; expected YAML") from error
    except YAMLError as error:
        raise InputError(f"{found}: {str(error).splitlines()[0]}; expected YAML") from error
    if not isinstance(tree, dict):
        raise InputError(f"{found}: is not a configuration; expected YAML with keys such as imus")
    return Document(found, tree, duplicate)


def write_yaml(values: dict[str, Any]) -> str:
    """Return plain values as YAML text, short lists on one line."""
    from ruamel.yaml import YAML

    writer = YAML()
    writer.default_flow_style = None
    writer.width = 120
    writer.representer.ignore_aliases = lambda value: True
    text = StringIO()
    writer.dump(values, text)
    return text.getvalue()


def key_path(keys: Sequence[Key]) -> str:
    """Write keys as a user reads them: `imus[0].noise`."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def _plain(node: Any) -> Any:
    """Turn the parser's own types, which carry comments and layout, into Python's."""
    if isinstance(node, dict):
        return {str(key): _plain(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_plain(value) for value in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
