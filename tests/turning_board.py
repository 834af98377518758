"""A board that is turned to and fro in one place, as tables with a configuration: what checks of IMUs are tried on."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.checks import clipping, stamps, stuck, twins, wraps
from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.config.yaml_document import read_yaml
from polyins.reading.loading import gather, located
from polyins.studies.data_faults.bundle import ACCEL, GYRO, IMU_COLUMNS, Bundle

Array = NDArray[np.float64]
RATE_HZ = 100.0
GRAVITY = 9.8


def motion(length_s: float = 60.0, speed: float = 1.0) -> tuple[Array, Array, Array]:
    """Return stamps, rates and forces, forward, right, down; the first five seconds are at rest."""
    time = np.arange(1, round(length_s * RATE_HZ) + 1) / RATE_HZ
    grow = np.clip((time - 5.0) / 2.0, 0.0, 1.0)
    roll, pitch = (0.4 * grow * np.sin(speed * w * time) for w in (1.9, 1.3))
    yaw = 0.8 * grow * np.sin(speed * 0.7 * time)
    rates = np.column_stack([np.gradient(roll, time), np.gradient(pitch, time), np.gradient(yaw, time)])
    r, p, y = roll, pitch, rates
    body = np.column_stack(
        [
            y[:, 0] - y[:, 2] * np.sin(p),
            y[:, 1] * np.cos(r) + y[:, 2] * np.cos(p) * np.sin(r),
            -y[:, 1] * np.sin(r) + y[:, 2] * np.cos(p) * np.cos(r),
        ]
    )
    up = np.column_stack([-np.sin(p), np.cos(p) * np.sin(r), np.cos(p) * np.cos(r)])
    return time, body, -GRAVITY * up


def board(count: int = 1, **kinds: Any) -> Bundle:
    """Return so many IMUs on it, with noise; `kinds` as for `motion`."""
    time, rates, forces = motion(**kinds)
    rng = np.random.default_rng(2)
    tables, entries = [], []
    for number in range(1, count + 1):
        gyro = rates + 0.003 * rng.normal(size=rates.shape)
        accel = forces + 0.03 * rng.normal(size=forces.shape)
        tables.append({"t": time, **dict(zip([*GYRO, *ACCEL], np.hstack([gyro, accel]).T, strict=True))})
        entries.append({"name": f"imu{number}", "columns": deepcopy(IMU_COLUMNS), "noise": "consumer-mems"})
    return Bundle("board", {"imus": entries, "start": {"heading_deg": 0.0}}, tuple(tables))


def evidence_of(bundle: Bundle, folder: Path) -> Evidence:
    """Write a recording and read it again as checks see it, whatever would be refused."""
    document = read_yaml(bundle.write(folder))
    return gather(located(document), document)


def turned(bundle: Bundle, index: int, turn: Array) -> Bundle:
    """Return the board with one IMU turned: its axes into those of the board by `turn`, (3, 3)."""
    both = [bundle.vectors(index, names) @ turn for names in (GYRO, ACCEL)]
    return bundle.with_imu(index, **dict(zip([*GYRO, *ACCEL], np.hstack(both).T, strict=True)))


def told_of_samples(bundle: Bundle, folder: Path) -> list[Diagnosis]:
    """Return what all checks of single samples say of a recording."""
    evidence = evidence_of(bundle, folder)
    finders = (wraps.find, stuck.find, clipping.find, stamps.jitter, stamps.undersampled, twins.find)
    return [one for find in finders for one in find(evidence)]


def some_rows(bundle: Bundle, rows: slice | NDArray[np.intp]) -> Bundle:
    """Return the board with some rows of its first IMU."""
    return bundle.with_imu(0, **{name: values[rows] for name, values in bundle.imus[0].items()})
