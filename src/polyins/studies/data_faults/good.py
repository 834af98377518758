"""Good recordings of every data set with IMU data, in parts of two minutes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from polyins.config.yaml_document import Document, as_document, read_yaml
from polyins.reading import datasets, wid
from polyins.reading.loading import read_config
from polyins.simulation.files import write
from polyins.simulation.run import record, true_run
from polyins.simulation.scenario import Board
from polyins.studies import flights
from polyins.studies.data_faults.bundle import ACCEL, GYRO, IMU_COLUMNS, Bundle, bundle_of
from polyins.studies.rigid_array import base_scenario, group_chips
from polyins.tools.propose.proposal import propose

LENGTH_S, DRIVE_S = 120.0, 180.0
FLIGHTS = ("Horizontal/path_2", "Horizontal/path_9", "Horizontal/path_23", "RAW_1111")
TRIALS = ("06", "08")
CASES = ("start-traffic-light", "start-rtk-end", "walk", "two-grades", "start-accelerating", "gap-37")
LOGS = ("dataflash/log0036.bin", "rosbag/husky.bag", "ulog/small.ulg")
TURN_ON = {"gyro_bias_deg_s": 2.0, "accel_bias_m_s2": 0.8}
"""std, of chips of an array that nobody calibrated"""


def _flight(name: str) -> Bundle:
    folder = datasets.fetch("quadrotor")
    row = next(row for row in flights.list_flights(folder) if row["flight"] == name)
    return bundle_of(f"quadrotor {name}", flights.document(folder, row), LENGTH_S)


def _trial(number: str) -> Bundle:
    folder = datasets.fetch("wid")
    values = wid.configuration(folder, number, gnss=True)
    return bundle_of(f"wid {number}", Document(folder / "calibration.yaml", values), LENGTH_S)


def _configured(name: str, place: tuple[str, ...], begin_s: float = 0.0) -> Bundle:
    document = read_config(root().joinpath(*place)).document
    return bundle_of(name, document, LENGTH_S, begin_s)


def _log(name: str) -> Bundle:
    path = root() / "logs" / name
    document = as_document(path, propose([path.resolve()]).text)
    return bundle_of(f"logs {name}", document, LENGTH_S)


def _bytes(name: str) -> Bundle:
    return _uncalibrated(_log(name))


def _uncalibrated(bundle: Bundle) -> Bundle:
    """Return a recording whose configuration says that nobody calibrated its chips."""
    imus = [{**imu, "initial_std": TURN_ON} for imu in bundle.values["imus"]]
    return replace(bundle, values={**bundle.values, "imus": imus})


def _poses() -> Bundle:
    """Return still poses of eight chips and the turns between them."""
    with np.load(root() / "mimu4444" / "mimu4444_exp4.npz") as file:
        time, gyro, accel = (np.asarray(file[name], dtype=float) for name in ("t", "gyro", "acc"))
    inside = time < LENGTH_S
    tables = tuple(
        {"t": time[inside], **dict(zip([*GYRO, *ACCEL], np.hstack([gyro[inside, i], accel[inside, i]]).T, strict=True))}
        for i in range(gyro.shape[1])
    )
    # as the first pose has it
    entry: dict[str, Any] = {"axes": ["x", "-z", "y"], "columns": IMU_COLUMNS, "initial_std": TURN_ON}
    imus = [{"name": f"chip{i + 1}", **deepcopy(entry)} for i in range(len(tables))]
    return Bundle("mimu4444", {"imus": imus, "start": {"heading_deg": 0.0}}, tables)


def _drive() -> Bundle:
    """Return a drive of the real track of `whu-array` with four of its chips."""
    scenario = base_scenario(quick=True).model_copy(
        update={"duration_s": DRIVE_S, "rate_hz": 50.0, "imus": Board(count=4), "outages": ()}
    )
    errors = scenario.errors.model_copy(update={"chips": group_chips(1, 4)})
    run = true_run(scenario.model_copy(update={"errors": errors}))
    with tempfile.TemporaryDirectory() as folder:
        config = write(record(run, seed=1).recording, Path(folder))
        return _uncalibrated(bundle_of("whu-array, simulated", read_yaml(config), DRIVE_S))


def root() -> Path:
    """Return the folder of the data."""
    return datasets.fetch("quadrotor").parent


Maker = Callable[[], Bundle]
GOOD: dict[str, Maker] = {
    **{name: partial(_flight, name) for name in FLIGHTS},
    **{f"wid {number}": partial(_trial, number) for number in TRIALS},
    "kfgins-parity": partial(_configured, "kfgins-parity", ("kfgins-parity", "kf-gins.yaml")),
    "wheelins-parity": partial(_configured, "wheelins-parity", ("wheelins-parity", "wheel-ins.yaml")),
    **{name: partial(_configured, f"case {name}", ("logs", "cases", name, "config.yaml")) for name in CASES},
    **{name: partial(_log, name) for name in LOGS},
    "array-binary": partial(_bytes, "array-binary/static-120s.bin"),
    "mimu4444": _poses,
    "whu-array": _drive,
}


@cache
def good(name: str) -> Bundle:
    """Return a recording without a fault."""
    return GOOD[name]()
