"""What a configuration says of mounts, clocks, heights and accuracies holds for live data too."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polyins.config.yaml_document import write_yaml
from polyins.errors import InputError
from polyins.formats.rows import ImuRows, RowSource
from polyins.live.conversion import Conversion
from polyins.live.source import RefusedError
from polyins.navigate.samples import GnssFix, ImuSample, SensorSample
from polyins.reading import loading
from polyins.reading.imu_stream import in_array_axes, mount_rotation

IMU = {"name": "a", "axes": ["x", "-y", "-z"], "mount_deg": [0.0, 0.0, 90.0], "clock_offset_s": -2.5}
FIX = GnssFix(7.0, np.array([0.8, 0.2, 500.0]), np.ones(3), np.ones(3), np.ones(3))


def conversion(folder: Path, **sections: Any) -> Conversion:
    path = folder / "live.yaml"
    path.write_text(write_yaml({"imus": [IMU, {"name": "b"}], **sections}))
    settings = loading.read_config(path)
    recording, _ = loading.without_data(settings.config, settings.document)
    return Conversion(settings.config, recording.geodetic)


def refusal(one: Conversion, sample: ImuSample | GnssFix) -> str:
    with pytest.raises(RefusedError) as refused:
        one.taken(sample)
    return str(refused.value)


def test_increments_are_turned_and_clocks_put_right(tmp_path: Path) -> None:
    one = conversion(tmp_path)
    turned = one.taken(ImuSample("a", 10.0, np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 9.8])))
    # x forward, y left, z up; then a quarter turn to the right
    np.testing.assert_allclose(turned.dtheta, [2.0, 1.0, -3.0], atol=1e-15)
    np.testing.assert_allclose(turned.dvel, [0.0, 0.0, -9.8], atol=1e-15)
    assert turned.time == 7.5
    same = one.taken(ImuSample("b", 10.0, np.array([1.0, 2.0, 3.0]), np.zeros(3)))
    np.testing.assert_array_equal(same.dtheta, [1.0, 2.0, 3.0])
    assert refusal(one, same._replace(imu="c")) == "unknown IMU"


def test_matrices_correct_as_in_a_recording_to_the_last_bit(tmp_path: Path) -> None:
    matrix = [[1.002, 0.003, -0.001], [-0.002, 0.999, 0.004], [0.001, 0.002, 1.001]]
    corrected = {**IMU, "mount_deg": [1.0, 2.0, 30.0], "gyro_matrix": matrix}
    one = conversion(tmp_path, imus=[corrected])
    entry = loading.read_config(tmp_path / "live.yaml").config.imus[0]
    dtheta, dvel = np.random.default_rng(1).normal(size=(2, 50, 3))
    rows = ImuRows(RowSource("live"), np.arange(50.0), dtheta, dvel)
    stream = in_array_axes(rows, entry)
    taken = [one.taken(ImuSample("a", *values)) for values in zip(rows.time, dtheta, dvel, strict=True)]
    np.testing.assert_array_equal([sample.dtheta for sample in taken], stream.dtheta)
    np.testing.assert_array_equal([sample.dvel for sample in taken], stream.dvel)
    expected = mount_rotation((1.0, 2.0, 30.0)) @ np.diag([1.0, -1.0, -1.0])
    np.testing.assert_allclose(stream.dtheta, dtheta @ (expected @ matrix).T, atol=1e-12)
    np.testing.assert_allclose(stream.dvel, dvel @ expected.T, atol=1e-12)


def test_clocks_that_drift_and_leap_give_the_bits_of_a_batch(tmp_path: Path) -> None:
    clock = {"clock_offset_s": -0.3, "clock_drift_ppm": 257.0, "clock_reference_s": 3.7, "clock_leaps_s": [[8.0, 0.2]]}
    drifting = {**IMU, "name": "b", **clock}
    path = tmp_path / "drifts.yaml"
    path.write_text(write_yaml({"imus": [drifting], "gnss": clock, "height": {"std_m": 1.0, **clock}}))
    settings = loading.read_config(path)
    one = Conversion(settings.config, True)
    rng = np.random.default_rng(1)
    rows = ImuRows(RowSource(""), np.arange(5.0, 12.0, 0.7), *rng.normal(0.0, 1.0, (2, 10, 3)))
    batch = in_array_axes(rows, settings.config.imus[0])
    for k, time in enumerate(rows.time.tolist()):
        live = one.taken(ImuSample("b", time, rows.dtheta[k], rows.dvel[k]))
        assert live.time == batch.time[k]
        np.testing.assert_array_equal(live.dtheta, batch.dtheta[k])
        np.testing.assert_array_equal(live.dvel, batch.dvel[k])
    expected = -0.3 + 257e-6 * (7.0 - 3.7)
    assert one.taken(FIX).time == pytest.approx(7.0 + expected, abs=1e-12)
    later = SensorSample("height", 8.0, 500.0, None)
    assert one.taken(later).time == pytest.approx(8.2 - 0.3 + 257e-6 * 4.3, abs=1e-12)


@pytest.mark.parametrize("section", ["gnss", "height", "heading", "odometer"])
def test_no_clock_is_estimated_live(section: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"{section}.time_offset: is found from a whole recording"):
        conversion(tmp_path, **{section: {"time_offset": "estimate"}})


def test_fixes_as_configured(tmp_path: Path) -> None:
    taken = conversion(tmp_path, gnss={"clock_offset_s": -18.0, "position_std_m": [1.0, 2.0, 3.0]}).taken(FIX)
    assert taken.time == -11.0
    np.testing.assert_array_equal(taken.position, FIX.position)
    np.testing.assert_array_equal(taken.position_std, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(taken.velocity, FIX.velocity)
    plain = conversion(tmp_path, gnss={})
    assert plain.taken(FIX._replace(velocity_std=None)).velocity is None
    assert refusal(plain, FIX._replace(position_std=None)) == "GNSS without std"
    assert refusal(plain, FIX._replace(above_sea=True)) == "height above the sea without geoid_height_m"
    assert refusal(plain, FIX._replace(geodetic=False)) == "position of another kind"
    assert refusal(conversion(tmp_path), FIX) == "GNSS without a gnss section"


def test_heights_above_the_sea(tmp_path: Path) -> None:
    one = conversion(tmp_path, gnss={"geoid_height_m": 47.0})
    assert one.taken(FIX._replace(above_sea=True)).position[2] == 547.0
    assert one.taken(FIX).position[2] == 500.0
    both = conversion(tmp_path, gnss={"geoid_height_m": 47.0, "height": "sea-level"})
    assert both.taken(FIX).position[2] == 547.0


def test_positions_on_a_plane(tmp_path: Path) -> None:
    origin = {"latitude_deg": float(np.degrees(0.8)), "longitude_deg": float(np.degrees(0.2)), "height_m": 480.0}
    taken = conversion(tmp_path, gnss={"plane_origin": origin}).taken(FIX)
    assert not taken.geodetic
    np.testing.assert_allclose(taken.position, [0.0, 0.0, 20.0], atol=1e-6)
    metres = FIX._replace(geodetic=False, position=np.array([3.0, 4.0, 5.0]))
    one = conversion(tmp_path, gnss={}, start={"position": {"north_m": 0.0, "east_m": 0.0}})
    np.testing.assert_array_equal(one.taken(metres).position, [3.0, 4.0, 5.0])
    assert refusal(one, FIX) == "position of another kind"


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"imus": [{"name": "a"}, {"name": "b", "time_offset": "estimate"}]}, r"imus\[1\].time_offset: is found from"),
        ({"start": {"heading_from": "reference"}}, "start.heading_from: is reference, which live data have not"),
    ],
)
def test_what_needs_a_recording(tmp_path: Path, sections: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        conversion(tmp_path, **sections)
