"""The method table and the banks that it makes."""

from __future__ import annotations

import numpy as np
import pytest
from array_recordings import shaken_recording

from polyins.errors import InputError
from polyins.model.methods import ARRAY_METHODS, METHODS, find_method
from polyins.navigate import batch
from polyins.navigate.state import SHARED_MECHANIZATION, VIRTUAL


def test_the_table_has_the_published_array_methods() -> None:
    assert list(ARRAY_METHODS) == [
        "single",
        "imu-fusion",
        "nav-fusion",
        "enav-fusion",
        "enav-fusion-shared-mechanization",
    ]
    assert all(find_method(name).name == name for name in METHODS)


def test_a_slip_of_the_pen_is_answered_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match=r"method: 'enav_fusion' is unknown; did you mean 'enav-fusion'\?"):
        find_method("enav_fusion")
    with pytest.raises(InputError, match="known: single, imu-fusion"):
        find_method("zzz")


@pytest.mark.parametrize(
    ("method", "members", "shares"),
    [
        ("single", 1, [[0, 1]]),
        ("imu-fusion", 1, [[0, 1]]),
        ("nav-fusion", 9, [[i, i + 1] for i in range(9)]),
        ("enav-fusion", 9, [[0, 9]]),
        ("enav-fusion-shared-mechanization", 9, [[0, 9]]),
    ],
)
def test_who_is_in_the_bank_and_who_shares_a_covariance(method: str, members: int, shares: list[list[int]]) -> None:
    run = batch.prepare(shaken_recording(9, 2.1), method)
    assert len(run.bank.members) == members
    np.testing.assert_array_equal(run.plan.spans, shares)
    assert run.plan.settings[VIRTUAL] == (method == "imu-fusion")
    assert run.plan.settings[SHARED_MECHANIZATION] == (method == "enav-fusion-shared-mechanization")
