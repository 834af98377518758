"""Folders of the real recordings that several files read."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def logs(data_folder: Path) -> Path:
    """Logs in the formats of those who wrote them."""
    folder = data_folder / "logs"
    if not folder.is_dir():
        pytest.skip(f"no logs: {folder} is not a folder")
    return folder
