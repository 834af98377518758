"""The line format: what is written comes back to the last bit, what is not a line is refused by kind."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polyins.live import lines
from polyins.live.source import RefusedError
from polyins.navigate.samples import GnssFix, ImuSample

SMALL = st.floats(-6.0, 6.0)
VECTOR = st.tuples(SMALL, SMALL, SMALL).map(np.array)
SPREAD = st.tuples(*[st.floats(1e-3, 1e3)] * 3).map(np.array)
TIME = st.floats(-1e9, 2e9)


@given(time=TIME, dtheta=VECTOR, dvel=VECTOR)
def test_increments_come_back_to_the_bit(time, dtheta, dvel):
    back = lines.parse(lines.write(ImuSample("left 1", time, dtheta, dvel)).encode())
    assert isinstance(back, ImuSample)
    assert (back.imu, back.time) == ("left 1", time)
    np.testing.assert_array_equal(np.hstack([back.dtheta, back.dvel]), np.hstack([dtheta, dvel]))


@given(time=TIME, position=VECTOR, std=SPREAD, velocity=st.none() | VECTOR)
def test_fixes_on_a_plane_come_back_to_the_bit(time, position, std, velocity):
    fix = GnssFix(time, position, std, velocity, None if velocity is None else std, geodetic=False)
    back = lines.parse(lines.write(fix).encode())
    for sent, received in zip(fix, back, strict=True):
        np.testing.assert_array_equal(sent, received)


def test_latitude_and_longitude_are_degrees():
    fix = lines.parse(b"polyins1,gnss,12.5,30.5,-114.25,20.0,1,2,3,4,5,6,0.1,0.2,0.3\r\n")
    assert isinstance(fix, GnssFix)
    assert fix.geodetic
    np.testing.assert_allclose(fix.position, [np.radians(30.5), np.radians(-114.25), 20.0], rtol=1e-15)
    np.testing.assert_array_equal(fix.position_std, [1, 2, 3])
    np.testing.assert_array_equal(fix.velocity, [4, 5, 6])
    np.testing.assert_array_equal(fix.velocity_std, [0.1, 0.2, 0.3])


def test_rates_are_multiplied_by_their_interval():
    sample = lines.parse(b"polyins1,rates,imu1,7.0,0.02,1,2,3,-10,0,10")
    np.testing.assert_allclose(sample.dtheta, [0.02, 0.04, 0.06])
    np.testing.assert_allclose(sample.dvel, [-0.2, 0.0, 0.2])


GOOD = b"polyins1,increments,imu1,1.0,0,0,0,0,0,-0.1"


def test_a_checksum_is_looked_at_where_there_is_one():
    whole = GOOD + b"*%02X" % lines.checksum(GOOD)
    assert lines.parse(whole).time == 1.0
    with pytest.raises(RefusedError, match="checksum"):
        lines.parse(whole.replace(b",1.0,", b",1.1,"))


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (b"", "malformed"),
        (b"\xff\xfe\x00", "malformed"),
        (b"polyins1", "malformed"),
        (b"polyins1,pressure,1.0,2.0", "malformed"),
        (b"polyins1,increments,imu1,1.0,0,0,0,0,0", "malformed"),
        (GOOD + b",1", "malformed"),
        (GOOD.replace(b"1.0", b"one"), "malformed"),
        (GOOD + b"*ZZ", "malformed"),
        (GOOD.replace(b"polyins1", b"polyins2"), "other version"),
        (GOOD.replace(b"1.0", b"nan"), "non-finite"),
        (GOOD.replace(b"-0.1", b"inf"), "non-finite"),
        (GOOD.replace(b"-0.1", b"1e9"), "implausible"),
        (b"polyins1,rates,imu1,7.0,0,1,2,3,4,5,6", "implausible"),
        (b"polyins1,rates,imu1,7.0,60,1,2,3,4,5,6", "implausible"),
        (b"polyins1,gnss,1,91,0,0,1,1,1", "implausible"),
        (b"polyins1,gnss,1,0,0,1e6,1,1,1", "implausible"),
        (b"polyins1,gnss,1,0,0,0,1,0,1", "implausible"),
        (b"polyins1,gnss,1,0,0,0,1,1,1,4,5,6", "malformed"),
        (GOOD + b" " * 600, "oversized"),
    ],
)
def test_refused_by_kind(line, kind):
    with pytest.raises(RefusedError) as refused:
        lines.parse(line)
    assert str(refused.value) == kind


@given(st.binary(max_size=80) | st.builds(lambda a, b: GOOD[:a] + b + GOOD[a:], st.integers(0, 40), st.binary()))
def test_no_bytes_do_more_than_be_refused(line):
    try:
        sample = lines.parse(line)
    except RefusedError:
        return
    assert np.isfinite(sample.time)


@pytest.mark.parametrize(
    ("line", "value", "std"),
    [
        (b"polyins1,height,3.5,412.25,0.5", 412.25, [0.5]),
        (b"polyins1,heading,3.5,90.0,1.0", np.pi / 2.0, [np.pi / 180.0]),
        (b"polyins1,odometer,3.5,2.5,0.05,0.1,0.0", 2.5, [0.05, 0.1, 0.0]),
    ],
)
def test_sensors_come_in_their_units_and_go_back_to_the_bit(line, value, std):
    sample = lines.parse(line)
    assert (sample.time, sample.value) == (3.5, pytest.approx(value, rel=1e-15))
    np.testing.assert_allclose(sample.std, std, rtol=1e-15)
    again = lines.parse(lines.write(sample).encode())
    assert again[:2] == sample[:2]
    assert again.value == pytest.approx(sample.value, rel=1e-15)


@pytest.mark.parametrize(
    ("line", "kind"),
    [
        (b"polyins1,height,3.5,412.25", "malformed"),
        (b"polyins1,heading,3.5,90.0,-1.0", "implausible"),
        (b"polyins1,odometer,3.5,2.5,0.05,0.1", "malformed"),
        (b"polyins1,odometer,3.5,nan,0.05,0.1,0.1", "non-finite"),
    ],
)
def test_sensors_that_are_wrong_are_refused(line, kind):
    with pytest.raises(RefusedError, match=kind):
        lines.parse(line)
