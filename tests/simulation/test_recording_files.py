from dataclasses import replace

import numpy as np
import pytest

from polyins.formats.table import read_track
from polyins.model.recording import FilterOptions, Reference, StartOptions
from polyins.model.rig import ImuErrors
from polyins.reading.loading import load
from polyins.simulation.files import write, write_reference
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Fixes, Scenario

SCENARIO = Scenario(
    name="round trip",
    duration_s=60.0,
    static_s=10.0,
    rate_hz=50.0,
    imus=Board(count=2, mounts=(("x", "y", "z"), ("x", "-y", "-z"))),
    gnss=Fixes(velocity_std_m_s=(0.1, 0.2, 0.3)),
    outages=((30.0, 40.0),),
)


@pytest.fixture(scope="module")
def recording():
    return simulate(SCENARIO)


def test_streams_read_back_as_they_were(recording, tmp_path):
    back = load(write(recording, tmp_path / "drive"))
    for before, after in zip(recording.imus, back.imus, strict=True):
        assert before.name == after.name
        for name in ("time", "dtheta", "dvel"):
            np.testing.assert_array_equal(getattr(before, name), getattr(after, name))
    # degrees and back cost the last digit
    for name in ("time", "position", "position_std", "velocity", "velocity_std"):
        np.testing.assert_allclose(getattr(back.gnss, name), getattr(recording.gnss, name), rtol=1e-15)
    for name in ("time", "position", "velocity", "attitude"):
        np.testing.assert_allclose(
            getattr(back.reference, name), getattr(recording.reference, name), rtol=1e-15, atol=1e-15
        )
    assert back.warnings == ()


def test_rig_and_options_read_back_as_they_were(recording, tmp_path):
    errors = ImuErrors(np.array([1e-3, 0.0, -2e-3]), np.array([0.1, 0.2, 0.3]), np.full(3, 1e-4), np.full(3, -2e-4))
    imus = (replace(recording.rig.imus[0], initial_errors=errors, initial_std=errors_std()), recording.rig.imus[1])
    changed = replace(
        recording,
        rig=replace(recording.rig, imus=imus),
        reference=replace(recording.reference, lever_arm=np.array([0.1, 0.2, 0.3])),
        start=StartOptions(
            time=11.0,
            end_time=55.0,
            position=recording.reference.position[110],
            velocity=np.array([1.0, 2.0, 0.1]),
            roll_pitch=np.array([0.01, -0.02]),
            heading=2.5,
            heading_from="value",
            static_interval=(1.0, 9.0),
            position_std=np.array([1.0, 2.0, 3.0]),
            velocity_std=np.array([0.1, 0.2, 0.3]),
            attitude_std=np.array([0.01, 0.02, 0.05]),
            estimate_gyro_bias=False,
        ),
        options=FilterOptions(gate_limit=None, gnss_snap=1e-3, gravity=9.81),
    )
    back = load(write(changed, tmp_path))
    assert (back.name, back.outages) == ("round trip", changed.outages)
    for name in ("gate_limit", "gnss_snap", "gravity"):
        assert getattr(back.options, name) == getattr(changed.options, name)
    np.testing.assert_array_equal(back.rig.antenna, changed.rig.antenna)
    np.testing.assert_array_equal(back.reference.lever_arm, changed.reference.lever_arm)
    for before, after in zip(changed.rig.imus, back.rig.imus, strict=True):
        np.testing.assert_allclose(after.position, before.position, rtol=1e-14)
        np.testing.assert_allclose(after.initial_errors.as_array(), before.initial_errors.as_array(), rtol=1e-14)
        np.testing.assert_allclose(after.start_std(), before.start_std(), rtol=1e-14)
        assert after.noise.correlation_time == before.noise.correlation_time
        for name in ("angle_random_walk", "velocity_random_walk", "gyro_bias_std", "accel_scale_std"):
            np.testing.assert_allclose(getattr(after.noise, name), getattr(before.noise, name), rtol=1e-14)
    for name, value in vars(changed.start).items():
        if isinstance(value, np.ndarray | float):
            np.testing.assert_allclose(getattr(back.start, name), value, rtol=1e-15)
        else:
            assert getattr(back.start, name) == value


def errors_std():
    return ImuErrors(np.full(3, 1e-5), np.full(3, 1e-2), np.full(3, 1e-3), np.full(3, 2e-3))


def test_a_local_recording_reads_back_on_its_plane(recording, tmp_path):
    def local(stream):
        return replace(stream, position=np.cumsum(np.ones_like(stream.position), axis=0) * [1.0, 2.0, 0.5])

    plane = replace(
        recording,
        gnss=local(recording.gnss),
        reference=local(recording.reference),
        geodetic=False,
        start=StartOptions(position=np.array([3.0, 4.0, 5.0])),
    )
    back = load(write(plane, tmp_path))
    assert not back.geodetic
    np.testing.assert_allclose(back.gnss.position, plane.gnss.position, rtol=1e-15)
    np.testing.assert_allclose(back.reference.position, plane.reference.position, rtol=1e-15)
    np.testing.assert_array_equal(back.start.position, plane.start.position)


def test_a_reference_of_positions_alone(tmp_path):
    reference = Reference(np.arange(3.0), np.array([[0.5, 1.0, 10.0]] * 3))
    write_reference(tmp_path / "r.parquet", reference, geodetic=True)
    track = read_track(tmp_path / "r.parquet")
    assert track.velocity is None
    assert track.attitude is None
    np.testing.assert_allclose(track.position, reference.position, rtol=1e-15)


def test_without_gnss_and_reference_only_imus_are_written(recording, tmp_path):
    bare = replace(recording, gnss=None, reference=None, outages=())
    config = write(bare, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["imu1.parquet", "imu2.parquet", config.name]
    assert load(config).gnss is None
