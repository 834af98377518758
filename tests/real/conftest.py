"""Folders of the real recordings that several files read."""

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML


@pytest.fixture(scope="session")
def logs(data_folder: Path) -> Path:
    """Logs in the formats of those who wrote them."""
    folder = data_folder / "logs"
    if not folder.is_dir():
        pytest.skip(f"no logs: {folder} is not a folder")
    return folder


@pytest.fixture(scope="session")
def cases(logs: Path) -> Path:
    """Made inputs with their right answers."""
    return logs / "cases"


@pytest.fixture(scope="session")
def expected(cases: Path) -> dict[str, Any]:
    """The right answers."""
    found: dict[str, Any] = YAML(typ="safe").load(cases / "expected.yaml")
    return found
