"""The drive of the format cases in the formats of loggers: one command makes the same result of each."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from scipy.io import savemat

from polyins import cli
from polyins.model.geodesy import displacement
from polyins.model.rig import DEG

Table = np.ndarray
TOW, WEEK = 300_000.0, 2300
UNIX_NS = 1_700_000_000_000_000_000
BEGINS = {"vectornav": TOW, "microstrain": TOW, "sensor_logger": UNIX_NS * 1e-9}
"""stamps of the drive's zero, s, where they are others"""


@pytest.fixture(scope="module")
def drive(data_folder: Path) -> tuple[Table, Table, Table]:
    """IMU: t, gyro, force; GNSS: t, place (deg), std, velocity, std; truth: t, place (deg)."""
    folder = data_folder / "logs" / "cases" / "common"
    if not folder.is_dir():
        pytest.skip(f"no logs: {folder} is not a folder")
    with gzip.open(folder / "imu.csv.gz", "rt") as file:
        imu = np.loadtxt(file, delimiter=",", skiprows=1)
    return (imu, *(np.loadtxt(folder / name, delimiter=",", skiprows=1) for name in ("gnss.csv", "truth.csv")))


def rows(lines: Table, mark: str = ",", first: str = "{:.9f}") -> str:
    return "".join(mark.join([first.format(row[0]), *(f"{value:.9f}" for value in row[1:])]) + "\n" for row in lines)


def vectornav(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    kinds = (("AngularRate", "rad/s"), ("Accel", "m/s^2"))
    names = [f"IMU::{kind}::{axis} [{unit}]" for kind, unit in kinds for axis in "XYZ"]
    (folder / "imu.csv").write_text(
        ",".join(["GpsTow [s]", *names]) + "\n" + rows(imu + np.array([TOW, 0, 0, 0, 0, 0, 0]))
    )
    place = [f"GNSS1::PosLla::{name}" for name in ("latitude [deg]", "longitude [deg]", "altitude [m]")]
    names = [f"GNSS1::{kind}::{axis} [{unit}]" for kind, unit in (("PosU", "m"), ("VelNed", "m/s")) for axis in "NED"]
    late = gnss[:, 0] + TOW + 0.07
    lines = np.column_stack([late, (gnss[:, 0] + TOW) * 1e9, np.full(len(gnss), 3), gnss[:, 1:11]])
    header = ["GpsTow [s]", "GNSS1::Tow [ns]", "GNSS1::Fix", *place, *names, "GNSS1::VelU [m/s]"]
    (folder / "gnss.csv").write_text(",".join(header) + "\n" + rows(lines))
    return [folder / "imu.csv", folder / "gnss.csv"]


def microstrain(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    names = [f"{axis} {name}" for name in ("Gyro [x8005]", "Accel [x8004]") for axis in "XYZ"]
    place = ["Lat [x8103]", "Long [x8103]", "Height [x8103]", "Horz Acc [x8103]", "Vert Acc [x8103]"]
    velocity = ["Vel N [x8105]", "Vel E [x8105]", "Vel D [x8105]", "Speed Acc [x8105]"]
    header = ["GPS Week", "GPS TOW", *names, *place, *velocity]
    texts = []
    for row in imu:
        values = [*row[1:4], *(row[4:7] / 9.80665)]
        texts.append((row[0], f"{WEEK},{TOW + row[0]:.6f}," + ",".join(f"{v:.9f}" for v in values) + "," * 9))
    for row in gnss:
        values = [*row[1:4], row[4], row[6], *row[7:10], row[10]]
        texts.append((row[0], f"{WEEK},{TOW + row[0]:.6f}," + "," * 6 + ",".join(f"{v:.9f}" for v in values)))
    lines = "\n".join(text for _, text in sorted(texts))
    (folder / "log.csv").write_text("FILE_INFO\n\nDATA_START\n" + ",".join(header) + "\n" + lines + "\n")
    return [folder / "log.csv"]


def sbg(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    log = folder / "log"
    log.mkdir()
    values = np.column_stack([imu[:, 0] * 1e6, imu[:, 0] * 0, imu[:, 4:7], imu[:, 1:4] / DEG])
    header = "timestamp\tstatus\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgyroZ\n(us)\t(na)" + "\t(m.s^-2)" * 3
    (log / "imuShort.txt").write_text(header + "\t(deg.s^-1)" * 3 + "\n" + rows(values, "\t", "{:10.0f}"))
    header = "timestamp\tgpsTow\tlatitude\tlongitude\taltitude\tundulation\tlatitudeStd\tlongitudeStd\taltitudeStd\n"
    stamps = [gnss[:, 0] * 1e6, gnss[:, 0] * 1e3]
    values = np.column_stack([*stamps, gnss[:, 1:3], gnss[:, 3] - 46.5, np.full(len(gnss), 46.5), gnss[:, 4:7]])
    units = "(us)\t(ms)\t(deg)\t(deg)\t(m)\t(m)\t(m)\t(m)\t(m)\n"
    (log / "gnss1Pos.txt").write_text(header + units + rows(values, "\t", "{:10.0f}"))
    header = "timestamp\tgpsTow\tvelN\tvelE\tvelD\tvelStdN\tvelStdE\tvelStdD\n(us)\t(ms)" + "\t(m.s^-1)" * 6 + "\n"
    (log / "gnss1Vel.txt").write_text(header + rows(np.column_stack([*stamps, gnss[:, 7:13]]), "\t", "{:10.0f}"))
    return [log]


def navego(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    place = dict(zip(("lat", "lon", "h"), (gnss[:, 1:4] * [DEG, DEG, 1.0]).T, strict=True))
    receiver = {"t": gnss[:, 0], **place, "vel": gnss[:, 7:10], "stdm": gnss[0, 4:7], "stdv": gnss[0, 10:13]}
    savemat(folder / "a.mat", {"imu1": {"t": imu[:, 0], "wb": imu[:, 1:4], "fb": imu[:, 4:7]}, "gnss": receiver})
    return [folder / "a.mat"]


def phyphox(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    log = folder / "log"
    log.mkdir()
    for name, unit, columns in (("Gyroscope", "rad/s", slice(1, 4)), ("Accelerometer", "m/s^2", slice(4, 7))):
        header = '"Time (s)",' + ",".join(f'"{axis} ({unit})"' for axis in "XYZ") + "\n"
        (log / f"{name}.csv").write_text(header + rows(np.column_stack([imu[:, 0], imu[:, columns]])))
    names = ["Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)"]
    names += ["Horizontal Accuracy (m)", "Vertical Accuracy (m)"]
    values = np.column_stack([gnss[:, :4], gnss[:, 4], gnss[:, 6]])
    (log / "Location.csv").write_text(",".join(f'"{name}"' for name in names) + "\n" + rows(values))
    return [log]


def sensor_logger(folder: Path, imu: Table, gnss: Table) -> list[Path]:
    log = folder / "log"
    log.mkdir()
    for name, columns in (("Gyroscope", [3, 2, 1]), ("TotalAcceleration", [6, 5, 4])):
        values = np.column_stack([UNIX_NS + imu[:, 0] * 1e9, imu[:, 0], imu[:, columns]])
        (log / f"{name}.csv").write_text("time,seconds_elapsed,z,y,x\n" + rows(values, first="{:.0f}"))
    header = "time,verticalAccuracy,horizontalAccuracy,altitude,longitude,latitude\n"
    values = np.column_stack([UNIX_NS + gnss[:, 0] * 1e9, gnss[:, [6, 4, 3, 2, 1]]])
    (log / "Location.csv").write_text(header + rows(values, first="{:.0f}"))
    return [log]


@pytest.mark.parametrize("write", [vectornav, microstrain, sbg, navego, phyphox, sensor_logger])
def test_one_command_makes_the_same_result_of_each(
    write: Callable[[Path, Table, Table], list[Path]], drive: tuple[Table, Table, Table], tmp_path: Path
) -> None:
    imu, gnss, truth = drive
    logs = [str(path) for path in write(tmp_path, imu, gnss)]
    done = CliRunner().invoke(cli.cli, ["run", *logs, "--json", "--no-report", "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert summary["coverage"]["of_recording"] > 0.7
    assert summary["verdict"]["level"] in ("trust", "doubt")
    names = ("latitude_deg", "longitude_deg", "height_m")
    table = pq.read_table(tmp_path / "out" / "solution.parquet")
    time = table["time_s"].to_numpy() - BEGINS.get(write.__name__, 0.0)
    inside = (truth[:, 0] >= time[0]) & (truth[:, 0] <= time[-1])
    place = np.column_stack([np.interp(truth[inside, 0], time, table[name].to_numpy()) for name in names])
    scale = [DEG, DEG, 1.0]
    origin, wanted = truth[0, 1:4] * scale, truth[inside, 1:4] * scale
    off = displacement(place * scale, origin, True) - displacement(wanted, origin, True)
    assert np.sqrt(np.mean(np.sum(off[:, :2] ** 2, axis=1))) < 0.08
    assert np.sqrt(np.mean(off[:, 2] ** 2)) < 0.1
