"""The table of kinds: every kind has its formulas, and its rows say what they are of."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.aiding import kinds
from polyins.model import states


def test_every_kind_is_named_once() -> None:
    names = [kind.name for kind in kinds.KINDS]
    assert len(set(names)) == len(names)
    assert kinds.KINDS[kinds.GNSS_POSITION].name == "GNSS position"
    assert kinds.KINDS[kinds.ODOMETER].name == "odometer"
    assert all(len(kind.axes) <= 3 for kind in kinds.KINDS)


@pytest.mark.parametrize(
    ("wanted", "mounting", "count"),
    [(set(), False, 24), ({kinds.GNSS_POSITION}, True, 24), ({kinds.HEIGHT}, False, 25), ({kinds.HEADING}, True, 26)],
)
def test_filters_have_the_states_that_their_measurements_ask_for(wanted: set[int], mounting: bool, count: int) -> None:
    assert kinds.states_for(wanted, mounting) == count


def test_states_stand_behind_each_other() -> None:
    places = [states.place(row.name) for row in states.TABLE]
    np.testing.assert_array_equal(np.diff([*places, states.STATES]), [row.size for row in states.TABLE])
    assert states.place("gyro_bias") == states.NAVIGATION
    with pytest.raises(KeyError):
        states.place("height")
