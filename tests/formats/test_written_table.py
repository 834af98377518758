"""Tables that polyins writes come back as they were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pyarrow import parquet

from polyins.formats.table import read_imu, read_track
from polyins.formats.written_table import write_gnss, write_imu
from polyins.model.recording import GnssStream, ImuStream
from polyins.model.rig import DEG


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet"])
@settings(deadline=None, max_examples=20)
@given(values=arrays(float, (4, 6), elements=st.floats(-1e3, 1e3)))
def test_imu_written_and_read_is_the_same_bit_for_bit(
    name: str, values: np.ndarray, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("table") / name
    stream = ImuStream("a", 456300.0 + np.arange(4) / 3, values[:, :3], values[:, 3:])
    write_imu(path, stream)
    read = read_imu(path)
    np.testing.assert_array_equal(read.time, stream.time)
    np.testing.assert_array_equal(read.dtheta, stream.dtheta)
    np.testing.assert_array_equal(read.dvel, stream.dvel)


@pytest.mark.parametrize("geodetic", [True, False])
@pytest.mark.parametrize("name", ["g.csv", "g.parquet"])
def test_gnss_written_and_read(geodetic: bool, name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    position = rng.normal(size=(5, 3)) * ([0.3, 0.3, 10.0] if geodetic else 10.0)
    velocity, std = rng.normal(size=(5, 3)), rng.uniform(0.01, 1.0, (5, 3))
    write_gnss(tmp_path / name, GnssStream(np.arange(5.0), position, std, velocity, 2 * std), geodetic=geodetic)
    track = read_track(tmp_path / name)
    assert track.geodetic is geodetic
    np.testing.assert_allclose(track.position, position, rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(track.position_std, std)
    np.testing.assert_array_equal(track.velocity, velocity)
    np.testing.assert_array_equal(track.velocity_std, 2 * std)


def test_a_solution_on_a_local_plane_is_a_track(tmp_path: Path) -> None:
    nothing = pa.nulls(3, pa.float64())
    columns: dict[str, object] = {"time_s": [0.0, 1.0, 2.0], "latitude_deg": nothing, "longitude_deg": nothing}
    columns |= {"height_m": [5.0] * 3, "north_m": [1.0, 2.0, 3.0], "east_m": [0.0] * 3, "down_m": [-5.0] * 3}
    columns |= {"roll_deg": [1.0] * 3, "pitch_deg": [2.0] * 3, "heading_deg": [3.0] * 3}
    parquet.write_table(pa.table(columns), tmp_path / "solution.parquet")
    track = read_track(tmp_path / "solution.parquet")
    assert not track.geodetic
    np.testing.assert_array_equal(track.position[1], [2.0, 0.0, 5.0])
    np.testing.assert_allclose(track.attitude, np.tile(np.array([1.0, 2.0, 3.0]) * DEG, (3, 1)))
