"""What libraries say and what they lack reaches the user as polyins's own words."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from polyins.errors import InputError
from polyins.formats.library import damage_named, heard, needed


def test_what_a_library_prints_is_a_note_and_no_output(capfd: pytest.CaptureFixture[str]) -> None:
    with heard() as notes:
        print("from Python")
        print("and again", file=sys.stderr)
        sys.stdout.flush()
        os.write(2, b"from C\n")
    print("afterwards")
    assert notes == ["its library says: from Python (and 2 more)"]
    said = capfd.readouterr()
    assert (said.out, said.err) == ("afterwards\n", "")


def test_output_is_there_again_after_an_error(capfd: pytest.CaptureFixture[str]) -> None:
    refused = pytest.raises(InputError, match=r"cannot be read as a log \(odd\)")
    with refused, damage_named(Path("a.log"), "a log"), heard():
        raise ValueError("odd")
    print("afterwards")
    assert capfd.readouterr().out == "afterwards\n"


def test_a_library_that_is_missing_is_named_with_its_extra() -> None:
    with pytest.raises(InputError, match=r"a.log: is read with missing_one; expected pip install 'polyins\[px4\]'"):
        needed("missing_one.reader", "px4", "a.log")
