"""JSON documents: what commands print and leave as summaries."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from polyins.files import write_bytes

Document = Mapping[str, Any]


def plain(value: object) -> Any:
    """Return `value` as JSON knows it: arrays as lists, NumPy's numbers as Python's, None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def as_json(document: Document) -> str:
    """Return a document as JSON; NaN is an error."""
    return json.dumps(document, indent=2, allow_nan=False)


def write_document(path: Path, document: Document) -> None:
    """Write a document as a JSON file."""
    write_bytes(path, (as_json(document) + "\n").encode())
