"""Starts of every kind tell a heading that is inside its std, or say why there is none."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.model.rig import DEG
from polyins.studies import starts
from polyins.studies.start_cases import KINDS, SHOWN, StartOutcome, case


@pytest.fixture(scope="module")
def outcomes() -> list[StartOutcome]:
    return starts.outcomes_of(range(1, 2 * len(KINDS), 2))


def test_every_kind_is_there_and_a_number_is_one_case() -> None:
    one, again = case(7), case(7)
    assert [case(number).kind for number in range(1, 2 * len(KINDS), 2)] == list(KINDS)
    np.testing.assert_array_equal(one.recording.imus[0].dvel, again.recording.imus[0].dvel)
    assert one.method == again.method


def test_what_moves_starts_inside_its_std(outcomes: list[StartOutcome]) -> None:
    table = starts.table(outcomes)
    assert all(table[kind]["started"] == 1 for kind in SHOWN)
    assert table["all"]["heading_inside"] == 1.0
    assert table["all"]["wrong"] == 0
    assert 0.0 < table["all"]["tilt_over_std_worst"] < 4.5


def test_a_refusal_says_what_is_missing(outcomes: list[StartOutcome]) -> None:
    refused = [one for one in outcomes if one.refused]
    assert all("heading" in one.refused and "expected start.heading_deg" in one.refused for one in refused)
    assert len(refused) < len(outcomes) - len(SHOWN) + 1


def test_wrong_is_far_off_and_sure_at_once() -> None:
    heading, std = np.array([20.0, 5.0]) * DEG, np.array([8.0, 1.0]) * DEG
    assert not starts.is_wrong(heading, std)
    assert starts.is_wrong(heading, std[::-1])
