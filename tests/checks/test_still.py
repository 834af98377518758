from pathlib import Path

import pytest
from turning_board import board, evidence_of

from polyins.checks import still


def test_where_it_rests_is_noted(tmp_path: Path) -> None:
    (told,) = still.rest(evidence_of(board(), tmp_path))
    assert told.finding.severity == "note"
    assert (told.finding.from_s, told.finding.to_s) == pytest.approx((0.0, 5.0), abs=1.1)
