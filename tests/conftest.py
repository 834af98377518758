"""Where the tests find the data sets, and which compiled code they share."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of real recordings; tests that need it skip when there is none."""
    folder = Path(os.environ.get("POLYINS_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no data sets: {folder} is not a folder (set POLYINS_DATA)")
    os.environ["POLYINS_DATA"] = str(folder)
    return folder
