"""What a drive says of mounts, sides, lever arms and GNSS's clock, where the configuration says something else.

All streams are on one clock, IMUs on wheels in module axes. Everything here is a doubt, so it is a warning.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polyins.calibration.motion import motion
from polyins.calibration.offsets import gnss_offset
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.model.recording import GnssStream, ImuStream
from polyins.model.rig import Imu

Array = NDArray[np.float64]

WINDOW_S = 1.0
LEAST_WINDOWS = 20
LIKE = 0.7
"""Two signals with this correlation show the same motion."""
OFF_DEG = 45.0
"""more than that about down, and the axes are named wrongly"""
ARM_M = 0.02
ARM_BIAS_M_S2 = 0.5
"""of an accelerometer: what it says of a lever arm is not better than this over the spin squared"""
CLOCK_S = 0.5


def check_drive(
    document: Document,
    imus: Sequence[Imu],
    streams: Sequence[ImuStream],
    gnss: GnssStream | None,
    geodetic: bool,
) -> list[str]:
    """Return warnings of what does not fit a drive in which wheels turn."""
    texts = [text for index, imu in enumerate(imus) for text in _lever_arm(index, imu, streams[index], document)]
    texts += _body(imus, streams, document)
    if gnss is not None:
        texts += _gnss_clock(imus, streams, gnss, geodetic, document)
    return texts


def _lever_arm(index: int, imu: Imu, stream: ImuStream, document: Document) -> list[str]:
    """Compare the lever arm with the centripetal acceleration, whose mean turns with the wheel as gravity does not."""
    if imu.wheel is None:
        return []
    moved = motion(stream)
    square = moved.rate[:, 0] ** 2
    weight = float(square @ square)
    if weight == 0.0:
        return []
    arm = square @ moved.force[:, 1:] / weight
    allowed = ARM_M + ARM_BIAS_M_S2 * float(square.sum()) / weight
    if np.linalg.norm(arm - imu.wheel.lever_arm[1:]) <= allowed:
        return []
    place = document.place(["imus", index, "wheel", "lever_arm_m"])
    said = ", ".join(f"{x:g}" for x in imu.wheel.lever_arm)
    return [f"{place}: is [{said}]; centripetal acceleration says about [0, {arm[0]:.3f}, {arm[1]:.3f}]"]


def _body(imus: Sequence[Imu], streams: Sequence[ImuStream], document: Document) -> list[str]:
    """Compare an IMU on the body with what the wheels say of the vehicle's motion."""
    rolling = [i for i, imu in enumerate(imus) if imu.wheel is not None and not imu.wheel.steering]
    edges = _windows(streams)
    if not rolling or len(edges) <= LEAST_WINDOWS:
        return []
    speeds = np.array([_speed(imus[i], streams[i], edges) for i in rolling])
    right = np.array([imus[i].position[1] for i in rolling])
    texts = []
    for index, (imu, stream) in enumerate(zip(imus, streams, strict=True)):
        if imu.wheel is None:
            rate, force = _means(stream, edges)
            texts += _about_down(index, imu, rate, force, speeds.mean(axis=0), document)
            if np.ptp(right) > 0.0:
                texts += _yaw(index, imu, rate, -np.polyfit(right, speeds, 1)[0], document)
    return texts


def _windows(streams: Sequence[ImuStream]) -> Array:
    begin, end = max(stream.time[0] for stream in streams), min(stream.time[-1] for stream in streams)
    return np.arange(begin, end, WINDOW_S)


def _means(stream: ImuStream, edges: Array) -> tuple[Array, Array]:
    """Return the mean rates, rad/s, and specific forces, m/s^2, in each window, shape (M, 3) each."""
    moved = motion(stream)
    both = moved.running(np.hstack([moved.rate, moved.force])).between(edges[:-1], edges[1:]) / WINDOW_S
    return both[:, :3], both[:, 3:]


def _speed(imu: Imu, stream: ImuStream, edges: Array) -> Array:
    """Return the mean speed of a wheel in each window, m/s, shape (M,)."""
    assert imu.wheel is not None
    return np.asarray(-imu.wheel.radius * _means(stream, edges)[0][:, 0])


def _about_down(index: int, imu: Imu, rate: Array, force: Array, speed: Array, document: Document) -> list[str]:
    """Compare the direction of horizontal forces with that of speeding up and of turning."""
    expected = np.gradient(speed, WINDOW_S) + 1j * speed * rate[:, 2]
    shown = force[:, 0] + 1j * force[:, 1]
    shown, expected = shown - shown.mean(), expected - expected.mean()
    common = np.vdot(shown, expected)
    size = float(np.linalg.norm(shown) * np.linalg.norm(expected))
    off_deg = float(np.degrees(np.angle(common)))
    if abs(common) < LIKE * size or abs(off_deg) < OFF_DEG:
        return []
    return [
        f"{document.place(['imus', index])}: IMU {imu.name} looks turned by {off_deg:.0f} deg about down: its forces "
        "do not point as speed and turns of the wheels do; are axes and mount_deg right?"
    ]


def _yaw(index: int, imu: Imu, rate: Array, yaw: Array, document: Document) -> list[str]:
    """Compare a body's rates with the yaw rate that the wheels' speeds make, by its correlation with each axis."""
    centred, wheels = rate - rate.mean(axis=0), yaw - yaw.mean()
    size = np.linalg.norm(centred, axis=0) * np.linalg.norm(wheels)
    likeness = centred.T @ wheels / np.maximum(size, np.finfo(float).tiny)
    axis = int(np.argmax(np.abs(likeness)))
    if abs(likeness[axis]) < LIKE or likeness[2] > LIKE:
        return []
    if axis == 2:
        return [
            f"{document.place(['imus'])}: by the wheels' speeds the vehicle turns the other way than IMU {imu.name} "
            "says; are left and right swapped?"
        ]
    return [
        f"{document.place(['imus', index, 'axes'])}: IMU {imu.name} turns about its {('forward', 'right')[axis]} axis "
        "when the wheels turn the vehicle; expected about down"
    ]


def _gnss_clock(
    imus: Sequence[Imu], streams: Sequence[ImuStream], gnss: GnssStream, geodetic: bool, document: Document
) -> list[str]:
    """Look whether wheels and fixes move at the same time; a drive that does not tell raises no doubt."""
    try:
        late = gnss_offset(imus, streams, gnss, geodetic)
    except InputError:
        return []
    if abs(late.offset_s) <= CLOCK_S:
        return []
    return [
        f"{document.place(['gnss'])}: fits the wheels with {late.offset_s:+.2f} s added to its stamps; expected one "
        "clock (clock_offset_s, or time_offset: estimate)"
    ]
