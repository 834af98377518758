"""A YAML 1.2 file as plain Python values that remember their line numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from polyins.errors import InputError
from polyins.files import find, read_text

Key = str | int


@dataclass(frozen=True)
class Setting:
    """A value for a key."""

    keys: tuple[Key, ...]
    value: Any
    """plain; None takes the key away"""

    @property
    def key(self) -> str:
        """The key as a user reads it."""
        return key_path(self.keys)

    @property
    def sentence(self) -> str:
        """Say it as a user writes it."""
        return f"{self.key}: {'left out' if self.value is None else flow(self.value)}"


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

    def changed(self, settings: Sequence[Setting]) -> Document:
        """Return the document with other values; comments and layout stay.

        What `settings` take out of lists goes last, so that all count places as they are now.
        """
        tree = deepcopy(self._tree)
        for one in settings:
            if one.value is not None:
                _put(tree, one.keys, one.value)
        for keys in sorted({one.keys for one in settings if one.value is None}, key=_order, reverse=True):
            parent = tree
            for key in keys[:-1]:
                parent = parent[key]
            del parent[keys[-1]]
        return Document(self.path, tree, self.duplicate)

    @property
    def text(self) -> str:
        """The YAML, with its comments."""
        return write_yaml(self._tree)

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


def quoted(text: object) -> str:
    """Write a text as YAML."""
    return "'" + str(text).replace("'", "''") + "'"


def flow(value: Any) -> str:
    """Write plain values as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(item) for item in value) + "]"
    return quoted(value) if isinstance(value, str) else str(value)


def key_path(keys: Sequence[Key]) -> str:
    """Write keys as a user reads them: `imus[0].noise`."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def _order(keys: tuple[Key, ...]) -> list[tuple[bool, str, int]]:
    """Return what keys are sorted by, indices by their size."""
    return [(isinstance(key, int), "", key) if isinstance(key, int) else (False, key, 0) for key in keys]


def _put(tree: Any, keys: Sequence[Key], value: Any) -> None:
    """Write a value under its key, making mappings as needed."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    for key in keys[:-1]:
        if isinstance(tree, dict) and not isinstance(tree.get(key), dict | list):
            tree[key] = CommentedMap()
        tree = tree[key]
    if isinstance(value, list | tuple):
        value = CommentedSeq(value)
        value.fa.set_flow_style()
    tree[keys[-1]] = value


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
