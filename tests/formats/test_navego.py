"""NaveGo's structs in MATLAB files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from polyins.errors import InputError
from polyins.formats.navego import read
from polyins.formats.recognize import data_format, read_log
from polyins.tools.inspect import inspect
from polyins.tools.propose.proposal import propose


def imu(rows: int = 200) -> dict[str, Any]:
    return {
        "t": 0.01 * np.arange(rows)[:, None],
        "fb": np.tile([0.1, 0.2, -9.8], (rows, 1)),
        "wb": np.tile([0.01, 0.02, 0.03], (rows, 1)),
        "arw": [[5.8e-4, 5.8e-4, 6e-4]],
        "vrw": [[3.3e-3, 3.3e-3, 3.3e-3]],
        "freq": 100.0,
        "name": "an ADIS",
    }


def gnss(rows: int = 10) -> dict[str, Any]:
    ones = np.ones((rows, 1))
    return {
        "t": 0.2 * np.arange(rows)[:, None],
        "lat": 0.8 * ones,
        "lon": 0.2 * ones,
        "h": 300.0 * ones,
        "vel": np.tile([1.0, 2.0, 3.0], (rows, 1)),
        "std": [[1e-7, 1e-7, 10.0]],
        "stdm": [[5.0, 5.0, 10.0]],
        "stdv": [[0.05, 0.05, 0.06]],
        "larm": [[0.1], [0.2], [-1.5]],
    }


def reference(rows: int = 200) -> dict[str, Any]:
    ones = np.ones((rows, 1))
    moved = {"t": 0.01 * np.arange(rows)[:, None], "roll": 0.01 * ones, "pitch": 0.02 * ones, "yaw": 0.5 * ones}
    return {**gnss(rows), **moved}


def hdf5(path: Path, structs: dict[str, dict[str, Any]]) -> None:
    """Write as MATLAB does: axes the other way round, after a block of text."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, struct in structs.items():
            for key, value in struct.items():
                if not isinstance(value, str):
                    file.create_dataset(f"{name}/{key}", data=np.atleast_2d(np.asarray(value, dtype=float)).T)
        file.create_group("#refs#")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_imus_receiver_and_reference(version: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.mat"
    structs = {"imu1": imu(), "imu2": imu(), "gnss": gnss(), "ref": reference()}
    if version == "5":
        savemat(path, {**structs, "R2D": 57.3})
    else:
        hdf5(path, structs)
    assert data_format(path) == ("navego" if version == "5" else "navego-hdf5")
    log = read_log(path)
    assert list(log.imus) == ["imu1", "imu2"]
    np.testing.assert_allclose(log.imus["imu2"].dtheta[3], np.array([0.01, 0.02, 0.03]) * 0.01)
    np.testing.assert_allclose(log.imus["imu2"].dvel[3], np.array([0.1, 0.2, -9.8]) * 0.01)
    track = log.tracks["gnss"]
    np.testing.assert_array_equal(track.position[0], [0.8, 0.2, 300.0])
    np.testing.assert_array_equal(track.velocity[4], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(track.position_std[9], [5.0, 5.0, 10.0])
    np.testing.assert_array_equal(track.velocity_std[9], [0.05, 0.05, 0.06])
    np.testing.assert_array_equal(log.tracks["ref"].attitude[0], [0.01, 0.02, 0.5])
    assert log.references == {"ref"}
    assert log.antenna == (0.1, 0.2, -1.5)
    assert log.noise["imu1"] == (6e-4, 3.3e-3)
    assert not track.datum_known


def test_the_proposal(tmp_path: Path) -> None:
    path = tmp_path / "drive.mat"
    savemat(path, {"imu1": imu(), "gnss": gnss(), "ref": reference()})
    text = propose([path]).text
    assert "axes: [x, y, z]  # forward, right, down, as the format has them" in text
    assert "angle_random_walk_deg_sqrt_h: 2.06, velocity_random_walk_m_s_sqrt_h: 0.198" in text
    assert "antenna_position_m: [0.1, 0.2, -1.5]" in text
    assert text.count("height: ellipsoidal  # CHECK: the log does not tell what heights are above") == 2
    assert [one["heights"] for one in inspect(path)["streams"] if one["kind"] == "positions"] == ["unknown"] * 2
    assert "stream: 'ref'" in text.split("reference:")[1]


def test_a_gap_in_the_stamps_stays(tmp_path: Path) -> None:
    path, one = tmp_path / "imu.mat", imu()
    one["t"][100:] += 2.0
    savemat(path, {"imu": one})
    assert np.diff(read(path).imus["imu"].time).max() == pytest.approx(2.01)


def test_what_is_none_of_it_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"x": np.ones(3), "struct": {"a": 1.0}})
    with pytest.raises(InputError, match="holds no struct of NaveGo; expected an IMU with t, fb, wb"):
        read(path)
    one = imu()
    one["wb"] = one["wb"][:-1]
    savemat(path, {"imu": one})
    with pytest.raises(InputError, match=r"imu\.wb is 199 by 3; expected 200 by 3, as imu\.t"):
        read(path)


def test_random_bytes_after_the_signature(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(b"MATLAB 5.0 MAT-file" + np.random.default_rng(2).bytes(16800))
    assert data_format(path) == "navego"
    with pytest.raises(InputError, match="cannot be read as MATLAB"):
        read(path)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_files_that_are_cut_off(version: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    if version == "5":
        savemat(path, {"imu": imu()})
    else:
        hdf5(path, {"imu": imu()})
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(InputError, match="is it damaged"):
        read(path)
