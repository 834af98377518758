"""A few seconds at rest before the real ones: whatever is compiled or imported at first use is there when data come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from polyins.live.replay import Replay
from polyins.live.session import Session
from polyins.live.sinks import Outlet, ParquetLog
from polyins.model.recording import GnssStream, ImuStream, Recording, StartOptions
from polyins.navigate.starter import Starter
from polyins.prepare.alignment import Start

if TYPE_CHECKING:
    from polyins.navigate.navigator import Navigator

SECONDS = 8.0
RATE_HZ = 50.0
GRAVITY = 9.8  # m/s^2


def preload(recording: Recording, method: str, delay: float, begin: Callable[[Start], Navigator]) -> None:
    """Navigate at rest with the rig of a recording, and throw away what comes out."""
    still = _at_rest(recording)
    with TemporaryDirectory() as folder:
        outlet = Outlet(ParquetLog(Path(folder) / "log.parquet", {}), RATE_HZ)
        session = Session(Starter(replace(still, imus=(), gnss=None), delay, True, method), begin, [outlet])
        for chunk in Replay(still).chunks():
            for sample in chunk:
                session.take(sample)
        session.finish()
        session.report()
        outlet.sink.close()


def _at_rest(recording: Recording) -> Recording:
    time = np.arange(1.0, SECONDS * RATE_HZ) / RATE_HZ
    dvel = np.tile([0.0, 0.0, -GRAVITY / RATE_HZ], (len(time), 1))
    imus = tuple(ImuStream(imu.name, time, np.zeros_like(dvel), dvel) for imu in recording.rig.imus)
    fixes = np.arange(0.5, SECONDS)
    zeros, ones = np.zeros((len(fixes), 3)), np.ones((len(fixes), 3))
    gnss = GnssStream(fixes, zeros, ones, zeros, ones)
    start = StartOptions(
        position=np.zeros(3), velocity=np.zeros(3), roll_pitch=np.zeros(2), heading=0.0, estimate_gyro_bias=False
    )
    return replace(recording, imus=imus, gnss=gnss, reference=None, start=start, outages=())
