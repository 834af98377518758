"""What `polyins allan` tells, where it is known: simulated noise, and real arrays at rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from polyins.calibration.array_gain import AT_S, ArrayGain, array_gain
from polyins.calibration.imu_noise import coefficients
from polyins.calibration.noise_model import fit
from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.reading import datasets
from polyins.studies.noise_cases import draw
from polyins.studies.progress import Steps

Document = dict[str, Any]

NAMES = ("random_walk", "bias_instability", "rate_random_walk")
SEEDS = 100
QUICK_SEEDS = 20
HOURS = (1.0, 6.0)
SAMPLES = 100_000
TEN_MINUTES = (1.0 / 6.0, 1.0 / 6.0)
MIMU, STREAMED = "mimu4444", "mimu4444_exp4.npz"
BOARD = "array-binary"


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> Document:
    """Fit simulated recordings of hours and of ten minutes, and compare real arrays with sqrt(N).

    What needs the data sets is null without them. Seeds are odd: what the fit leaves out was settled on even ones.
    """
    steps = Steps(progress, 3)
    count = QUICK_SEEDS if quick else SEEDS
    return {
        "target": "allan",
        "paper": {},
        "polyins": {
            "hours": covered(HOURS, count, steps.next()),
            "ten_minutes": covered(TEN_MINUTES, count, steps.next()),
            "gain": gains(steps.next()),
        },
        "settings": {
            "hours": f"1 to 6 h at rest in one piece, {SAMPLES} samples, {count} odd seeds",
            "ten_minutes": f"10 min of such noise, {count} odd seeds",
            "inside": "how often the stated 95 % interval holds the truth",
            "told": "how often it is told from zero; else the interval is what it is at most",
            "gain": "Allan deviation of one of 8 IMUs, rms, over that of their mean, at 1 s; sqrt(8) = 2.83",
        },
    }


def covered(hours: tuple[float, float], count: int, progress: Callable[[float], None]) -> Document:
    """Return how often intervals hold the truth, and by how much estimates are off, percent."""
    inside, told, off = np.zeros(3), np.zeros(3), np.full((count, 3), np.nan)
    for k in range(count):
        rng = np.random.default_rng([2 * k + 1, round(3600 * hours[0])])
        case = draw(rng, hours, SAMPLES)
        each = coefficients(fit([case.rates(rng)], case.interval))
        for i, (one, truth) in enumerate(zip(each, case.truth, strict=True)):
            inside[i] += one.low <= truth <= one.high
            told[i] += one.value is not None
            off[k, i] = np.nan if one.value is None else 100.0 * (one.value / truth - 1.0)
        progress((k + 1) / count)
    return {
        name: {
            "inside": int(inside[i]),
            "told": int(told[i]),
            "of": count,
            "rms_percent": _rms(off[:, i]),
            "worst_percent": _worst(off[:, i]),
        }
        for i, name in enumerate(NAMES)
    }


def _rms(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _worst(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.max(np.abs(known))) if known.size else None


def gains(progress: Callable[[float], None]) -> Document:
    """Return what the real arrays of eight gain; null where they are not at hand."""
    found: Document = {}
    for k, (name, read) in enumerate({MIMU: mimu4444, BOARD: array_binary}.items(), 1):
        try:
            found[name] = _told(array_gain(read()))
        except InputError:
            found[name] = None
        progress(k / 2)
    return found


def _told(gain: ArrayGain) -> Document:
    found: Document = {"rest_s": gain.rest_s}
    for name, of in (("gyro", gain.gyro), ("accel", gain.accel)):
        row = of.at(AT_S)
        figures = {"gain": of.gain, "low": of.low, "high": of.high, "common_share": of.common_share}
        found[name] = {key: float(values[row]) for key, values in figures.items()}
    return found


def mimu4444() -> tuple[ImuStream, ...]:
    """Return the eight IMUs of the data set; raises InputError where it is not at hand."""
    data = np.load(datasets.fetch(MIMU) / STREAMED)
    time = data["t"]
    steps = np.diff(time, prepend=time[0] - float(np.median(np.diff(time))))[:, None]
    return tuple(
        ImuStream(
            f"imu{i + 1}", time, data["gyro"][:, i].astype(float) * steps, data["acc"][:, i].astype(float) * steps
        )
        for i in range(data["gyro"].shape[1])
    )


def array_binary() -> tuple[ImuStream, ...]:
    """Return the eight IMUs of the log; raises InputError where it is not at hand."""
    from polyins.tools.noise import read_streams
    from polyins.tools.propose.proposal import settings_of

    return read_streams(settings_of((datasets.fetch("logs") / BOARD / "static-120s.bin",)))[0]
