"""Stamps that cannot be yet are refused, whatever comes first, and time lost on the way is no fault."""

from collections import Counter

import numpy as np

from polyins.live import stamp_check
from polyins.navigate.samples import ImuSample, Sample


def sample(time: float) -> Sample:
    return ImuSample("imu1", time, np.zeros(3), np.zeros(3))


def started(offset: float = 0.0) -> stamp_check.StampCheck:
    """A check whose stamps are ahead of arrival by an offset."""
    one = stamp_check.StampCheck(Counter())
    for k in range(stamp_check.FIRST_EPOCHS):
        one.admit([sample(k / 100 + offset)], k / 100)
    return one


def test_nothing_is_lost_at_the_beginning():
    one, admitted = stamp_check.StampCheck(Counter()), []
    for k in range(3 * stamp_check.FIRST_EPOCHS):
        admitted += one.admit([sample(k / 100 + 1e9)], k / 100)
    assert [e.time for e in admitted] == [k / 100 + 1e9 for k in range(3 * stamp_check.FIRST_EPOCHS)]
    assert not one.counts


def test_a_few_epochs_wait_a_second_at_most():
    one = stamp_check.StampCheck(Counter())
    assert one.admit([sample(5.0)], 100.0) == []
    assert [e.time for e in one.admit([], 101.0)] == [5.0]
    one = stamp_check.StampCheck(Counter())
    one.admit([sample(5.0)], 100.0)
    assert [e.time for e in one.release(100.1)] == [5.0]


def test_the_future_is_refused_even_where_it_comes_first():
    one = stamp_check.StampCheck(Counter())
    one.admit([sample(1e6)] * 20, 0.0)
    admitted = []
    for k in range(500):
        admitted += one.admit([sample(k / 100), sample(k / 100 + 5.0 + k)][: 1 + k % 2], k / 100)
    assert [e.time for e in admitted] == [k / 100 for k in range(500)]
    assert one.counts["future-stamped"] == 20 + 250


def test_a_silence_moves_nothing():
    one = started()
    assert len(one.admit([sample(61.0)], 61.0)) == 1
    assert one.admit([sample(62.0)], 61.2) == []
    assert len(one.admit([sample(61.5)], 61.5)) == 1


def test_a_stall_on_the_way_moves_nothing():
    one = started()
    burst = [sample(1.0 + k / 100) for k in range(300)]
    assert len(one.admit(burst, 4.0)) == 300
    assert len(one.admit([sample(4.01)], 4.01)) == 1


def test_a_recording_sent_ten_times_faster_passes():
    one = stamp_check.StampCheck(Counter())
    admitted = [e for k in range(2000) for e in one.admit([sample(k / 100)], k / 1000)]
    assert len(admitted) == 2000


def test_a_stamp_slightly_ahead_does_not_open_the_gate_for_good():
    one, seconds = started(), 60
    for k in range(100 * seconds):
        now = 1.0 + k / 100
        wrong = [sample(now + 0.3)] if k % 100 == 0 else []
        assert len(one.admit([sample(now), *wrong], now)) == 1 + len(wrong)
    assert one.admit([sample(now + 1.0)], now) == []
