"""What there is to know of noise figures: what was left out, what is doubtful, what could not be told."""

from __future__ import annotations

from collections.abc import Iterator

from polyins.calibration.imu_noise import FITS, SENSORS, SIX, ImuNoise, coefficients
from polyins.calibration.noise_model import FLICKER, WALK, RateNoise
from polyins.calibration.rest import Rest
from polyins.model.findings import LEFT_OUT, Finding

PICKED = 0.5
"""of what is taken for motion: an IMU whose own noise is larger has its quiet seconds picked"""
REPEATS = 0.5
"""share of samples that repeat the one before"""
NARROW = 0.5
"""of all frequencies: fewer have to fit, else it is said"""
LONG_S = 10_000.0
"""s in one piece: a longer one seldom tells more"""
KIND = "noise"

Each = list[tuple[str, RateNoise]]
"""the six axes by name"""


def findings(one: ImuNoise) -> tuple[Finding, ...]:
    """Return what there is to know of the figures of an IMU."""
    noises = [of.noise for sensor in SENSORS for of in one.axes[sensor]]
    each = list(zip(SIX, noises, strict=True))
    rest, nyquist = one.rest, 0.5 / one.rest.interval
    return (
        *_motion(rest),
        *_picked(rest),
        *_repeated(rest),
        *_filtered(rest.name, each, nyquist),
        *_lines(rest.name, each),
        *_unlike(rest.name, each),
        *_off(rest.name, each),
        *_untold(rest, each),
    )


def _motion(rest: Rest) -> Iterator[Finding]:
    left_out, count = rest.recorded_s - rest.used_s, len(rest.stretches)
    # the odd second at the end is none
    if left_out > count + 1.0:
        stretches = "one stretch" if count == 1 else f"{count} stretches"
        yield Finding(
            LEFT_OUT,
            f"IMU {rest.name}: {left_out:.1f} of {rest.recorded_s:.1f} s are left out, in which it moves or has just"
            f" moved; {rest.used_s:.1f} s in {stretches} at rest are used",
            stream=rest.name,
            from_s=rest.stretches[0].begin,
            to_s=rest.stretches[-1].end,
            size=left_out,
        )


def _picked(rest: Rest) -> Iterator[Finding]:
    if rest.closeness > PICKED:
        yield Finding(
            KIND,
            f"IMU {rest.name}: at rest it shakes by {100 * rest.closeness:.0f} % of what is taken for motion, so that"
            " only its quieter seconds are used and its figures are too small",
            "doubt",
            stream=rest.name,
            size=rest.closeness,
            expected=PICKED,
            remedy="measure it away from engines and fans",
        )


def _repeated(rest: Rest) -> Iterator[Finding]:
    for axis, share in zip(SIX, rest.repeated(), strict=True):
        if share > REPEATS:
            yield Finding(
                KIND,
                f"IMU {rest.name}: {100 * share:.0f} % of the samples of {axis} are as the one before: they are rounded"
                " to steps as large as the noise, or written more often than measured",
                "doubt",
                stream=rest.name,
                axis=axis,
                size=float(share),
                expected=REPEATS,
                remedy="log at the sensor's own rate and resolution",
            )


def _filtered(name: str, each: Each, nyquist: float) -> Iterator[Finding]:
    cut = {axis: noise.up_to_hz for axis, noise in each if noise.up_to_hz < NARROW * nyquist}
    if cut:
        least = min(cut.values())
        yield Finding(
            KIND,
            f"IMU {name}: beyond {least:.3g} Hz the noise of {', '.join(cut)} is not white, as behind a filter or"
            " beside a vibration: the figures are of what is below",
            stream=name,
            size=least,
            expected=nyquist,
        )


def _lines(name: str, each: Each) -> Iterator[Finding]:
    lines = [f"{noise.lines_hz[0]:.3g} Hz ({axis})" for axis, noise in each if noise.lines_hz]
    if lines:
        yield Finding(
            KIND,
            f"IMU {name}: lines stand out of the noise, as vibration, mains or gyros that disturb each other make, the"
            f" strongest at {', '.join(lines)}; they are left out of the fit",
            stream=name,
            size=len(lines),
        )


def _unlike(name: str, each: Each) -> Iterator[Finding]:
    unlike = {axis: noise.excess for axis, noise in each if noise.excess > FITS}
    if unlike:
        worst = max(unlike.values())
        yield Finding(
            KIND,
            f"IMU {name}: white noise, flicker and random walk do not describe {', '.join(unlike)}: what is left over"
            f" has up to {worst:.1f} times their variance, by whose root the intervals are wider",
            "doubt",
            stream=name,
            size=worst,
            expected=1.0,
            remedy="look at the plot for steps, or a ramp while it warms up",
        )


def _off(name: str, each: Each) -> Iterator[Finding]:
    for axis, noise in each:
        if noise.off is not None and noise.excess <= FITS:
            hz, times = noise.off
            yield Finding(
                KIND,
                f"IMU {name}: below {hz:.2g} Hz {axis} has {times:.2g} times the variance of what was fitted: its"
                " noise is not quite white noise, flicker and random walk",
                "note" if 1.0 / FITS < times < FITS else "doubt",
                stream=name,
                axis=axis,
                size=times,
                expected=1.0,
                remedy="look at the plot there",
            )


def _untold(rest: Rest, each: Each) -> Iterator[Finding]:
    told = {axis: coefficients(noise) for axis, noise in each}
    parts = []
    for word, index in (("bias instability", FLICKER), ("rate random walk", WALK)):
        axes = [axis for axis, of in told.items() if of[index].value is None]
        parts += [f"the {word} of {'all axes' if len(axes) == len(each) else ', '.join(axes)}"] if axes else []
    if parts:
        yield Finding(
            KIND,
            f"IMU {rest.name}: {rest.used_s:.0f} s at rest, {rest.longest_s:.0f} s in one piece, do not tell"
            f" {' and '.join(parts)} from zero: only what they are at most is known",
            stream=rest.name,
            size=rest.used_s,
            remedy="" if rest.longest_s > LONG_S else "record hours in one piece",
        )
