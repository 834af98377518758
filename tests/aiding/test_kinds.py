"""The table of kinds: every kind has its formulas, and its rows say what they are of."""

from __future__ import annotations

import numpy as np
import pytest
from array_recordings import NOISE

from polyins.aiding import kinds
from polyins.model import states
from polyins.model.rig import AidingSensor, Imu, Rig
from polyins.navigate.layout import states_of


def test_every_kind_is_named_once() -> None:
    names = [kind.name for kind in kinds.KINDS]
    assert len(set(names)) == len(names)
    assert kinds.KINDS[kinds.GNSS_POSITION].name == "GNSS position"
    assert kinds.KINDS[kinds.ODOMETER].name == "odometer"
    assert all(len(kind.axes) <= 3 for kind in kinds.KINDS)


@pytest.mark.parametrize(
    ("estimated", "count"),
    [({}, 24), ({"odometer": 0.1}, 24), ({"height": 0.0}, 24), ({"height": 1.0}, 25), ({"heading": 0.1}, 26)],
)
def test_filters_have_the_states_that_are_estimated(estimated: dict[str, float], count: int) -> None:
    sensors = tuple(AidingSensor(kind, offset_std=std) for kind, std in estimated.items())
    assert states_of(Rig((Imu("imu", NOISE),), sensors=sensors)) == count


def test_states_stand_behind_each_other() -> None:
    places = [states.place(row.name) for row in states.TABLE]
    np.testing.assert_array_equal(np.diff([*places, states.STATES]), [row.size for row in states.TABLE])
    assert states.place("gyro_bias") == states.NAVIGATION
    with pytest.raises(KeyError):
        states.place("height")
