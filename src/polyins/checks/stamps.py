"""Stamps that jitter about an even clock, and sampling that is too slow for the motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.stream_checks import GAP_INTERVALS, JITTER
from polyins.config.yaml_document import Setting
from polyins.formats.rows import intervals
from polyins.model.findings import Finding
from polyins.model.recording import Array, usual_interval

LEAST_ROWS = 100
EVEN = 2.0
"""times the std of the intervals, by which stamps of an even clock leave a line at most; of uneven samples they walk"""
TOO_FAST_RAD = 1.0
"""that it turns from one sample to the next, in 5 % of them: the error of taking the rates as constant is its cube"""
SMOOTH = 0.8
"""correlation of turn rates from sample to sample, below which the motion is not followed"""
SMOOTH_RAD_S = 0.3
"""rms of the rates, of which that is asked"""
SLOW_HZ = 50.0
"""from which on it is vibration that is not followed"""


def jitter(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say whose stamps vary by more than a fifth of the interval; rows that are even can be counted instead."""
    for one in evidence.imus:
        time = one.rows.time
        if len(time) < LEAST_ROWS:
            continue
        steps, usual = np.diff(time), usual_interval(time)
        whole = steps <= GAP_INTERVALS * usual
        spread = float(np.quantile(np.abs(steps[whole] - usual), 0.95)) / usual
        if spread <= JITTER:
            continue
        rate, first, even = _line(time)
        yield Diagnosis(
            Finding(
                "jitter",
                f"IMU {one.name}: 5 % of the intervals of its stamps are off by {100 * spread:.0f} % and more"
                + (f"; its rows are even, {rate:.6g} a second" if even else ""),
                "doubt",
                stream=one.name,
                size=spread,
                expected=JITTER,
                remedy="give rate_hz, so that rows are counted" if even else "stamp samples where they are taken",
            ),
            _counted(one, rate, first) if even and (whole.all() or even) else (),
        )


def _line(time: Array) -> tuple[float, float, bool]:
    """Return rows a second, the first stamp by that, and whether the stamps keep to it."""
    row = np.arange(len(time))
    slope, first = np.polyfit(row, time, 1)
    off = time - first - slope * row
    return float(1.0 / slope), float(first), float(np.std(off)) < EVEN * float(np.std(np.diff(time)))


def _counted(one: ImuEvidence, rate: float, first: float) -> tuple[Setting, ...]:
    offset = round(one.entry.clock_offset_s + first, 6)
    return one.setting("rate_hz", value=float(f"{rate:.8g}")), one.setting("clock_offset_s", value=offset)


def undersampled(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say whose samples are too far apart for how it turns; a wheel turns fast about its axle alone, which is none."""
    for one in evidence.body:
        rows = one.rows
        if len(rows.time) < LEAST_ROWS:
            continue
        turn = float(np.quantile(np.linalg.norm(rows.dtheta[1:], axis=1), 0.95))
        rates = rows.dtheta / intervals(rows.time)[:, None]
        rates = rates - rates.mean(axis=0)
        power = float(np.sum(rates**2))
        follows = float(np.sum(rates[1:] * rates[:-1])) / power if power > 0.0 else 1.0
        fast = np.sqrt(power / len(rates)) > SMOOTH_RAD_S and 1.0 / usual_interval(rows.time) < SLOW_HZ
        if turn <= TOO_FAST_RAD and (follows >= SMOOTH or not fast):
            continue
        yield Diagnosis(
            Finding(
                "undersampled",
                f"IMU {one.name}: {1.0 / usual_interval(rows.time):.3g} samples a second are too few for how it turns: "
                f"{np.degrees(turn):.2g} deg from one to the next, which are alike by {follows:.2f}",
                "doubt",
                stream=one.name,
                size=float(np.degrees(turn)),
                expected=float(np.degrees(TOO_FAST_RAD)),
                remedy="log the IMU faster, or increments that it sums itself",
            )
        )
