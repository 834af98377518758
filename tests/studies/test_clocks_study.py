"""The study of how well clocks are found."""

from __future__ import annotations

from polyins.model.clock import Clock
from polyins.studies.clocks import Errors, clock, drawn, leap_errors, pair_errors, receiver_errors


def test_clocks_differ_by_seed_and_leap_where_told() -> None:
    assert clock(1) != clock(3)
    assert clock(1, (20.0, 0.5)) == Clock(clock(1).offset, clock(1).drift, clock(1).reference, ((20.0, 0.5),))


def assert_within(errors: Errors, offset_s: float, drift: float) -> None:
    assert abs(errors.offset) < min(4.0 * errors.offset_std, offset_s)
    assert abs(errors.drift) < min(4.0 * errors.drift_std, drift)


def test_a_flight_with_a_good_imu() -> None:
    assert_within(receiver_errors(drawn("flight of wings", "1 tactical", 2), 2), 1e-3, 20e-6)


def test_two_imus_in_a_drive() -> None:
    assert_within(pair_errors(drawn("drive", "1 consumer-mems", 2, count=2), 2), 2e-3, 50e-6)


def test_a_leap_in_a_drive() -> None:
    others, size, std, _ = leap_errors(drawn("drive", "1 consumer-mems", 6), 6)
    assert others == 0
    assert abs(size) < min(4.0 * std, 0.02)
