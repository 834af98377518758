"""Calibration from a drive: what a recording with wheels tells of how its sensors are mounted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polyins.calibration.body import mount
from polyins.calibration.estimates import ASIDE, Calibration, Estimate, nearest_axes
from polyins.calibration.motion import Motion, RunningSums, motion
from polyins.calibration.radius import rolling_radius
from polyins.calibration.wheels import SpinAxis, lever_arm, spin_axis, turns
from polyins.config import WheelEntry
from polyins.config.wheel_mount import wheel_rotation
from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, Recording
from polyins.model.rig import DEG, Imu

CLEAR_SENSE = 0.5
"""Correlation of wheel and body acceleration above which it says which way is forward."""
SENSE_WINDOW = 1.0  # s


@dataclass(frozen=True)
class _WheelMotion:
    """A wheel IMU and its way of rolling; the axis has the sense of the net rotation until forward is known."""

    imu: Imu
    motion: Motion
    spin: SpinAxis
    turns: RunningSums

    def facing(self, sense: float) -> _WheelMotion:
        """Return it with the axis about which it rolls forward; `sense`: 1 if the net rotation is forward, else -1."""
        spin = replace(self.spin, axis=self.spin.axis * sense)
        return replace(self, spin=spin, turns=RunningSums(self.turns.edges, self.turns.sums * [sense, 1.0]))


def calibrate(recording: Recording) -> Calibration:
    """Estimate radius, spin axis, its sense and lever arm of each wheel IMU, and the mounting angles of body IMUs.

    All streams must be on one clock. Without GNSS radii stay as configured. Raises InputError without an IMU on a
    wheel, a standstill or a drive.
    """
    mounted = list(zip(recording.rig.imus, recording.imus, strict=True))
    wheels = [_rolling(imu, motion(stream)) for imu, stream in mounted if imu.wheel is not None]
    if not wheels:
        raise InputError("calibrate: no IMU on a wheel; expected at least one with a wheel section")
    bodies = [(imu, motion(stream)) for imu, stream in mounted if imu.wheel is None]
    warnings: list[str] = []
    sense, forward_from = _sense(wheels, bodies)
    wheels = [wheel.facing(sense) for wheel in wheels]
    track = _track(recording, warnings)
    imus: dict[str, tuple[Estimate, ...]] = {}
    radii: dict[str, float] = {}
    for wheel in wheels:
        estimates = _wheel_estimates(wheel, track, recording.rig.antenna)
        imus[wheel.imu.name] = estimates
        radii[wheel.imu.name] = _number(estimates, "wheel.radius_m", _nominal_radius(wheel.imu))
    rolled = _axle(wheels, radii)
    height = None if track is None else RunningSums(track.edges, -track.sums[:, 2:])
    for imu, moved in bodies:
        imus[imu.name] = _body_estimates(imu, moved, rolled, height)
    warnings += [text for name, estimates in imus.items() for text in _surprises(name, estimates)]
    in_order = {imu.name: imus[imu.name] for imu, _ in mounted}
    return Calibration(in_order, recording.clock_offsets, tuple(warnings), forward_from)


def _rolling(imu: Imu, moved: Motion) -> _WheelMotion:
    found = spin_axis(moved, imu.name)
    return _WheelMotion(imu, moved, found, turns(moved, found))


def _nominal_radius(imu: Imu) -> float:
    assert imu.wheel is not None
    return imu.wheel.radius


def _number(estimates: Sequence[Estimate], key: str, otherwise: float) -> float:
    for one in estimates:
        if one.key == key and not isinstance(one.value, str):
            return one.value[0]
    return otherwise


def _track(recording: Recording, warnings: list[str]) -> RunningSums | None:
    """Return the antenna's positions, m north, east, down of the first one."""
    gnss = recording.gnss
    if gnss is None:
        warnings.append("no GNSS: radii stay as configured, and the road counts as level for the body's pitch")
        return None
    return RunningSums(gnss.time, displacement(gnss.position, gnss.position[0], recording.geodetic))


def _sense(wheels: Sequence[_WheelMotion], bodies: Sequence[tuple[Imu, Motion]]) -> tuple[float, str]:
    """Return 1 if the net rotation of the wheels is forward, else -1, and how that is known.

    Where a body IMU feels the wheels' acceleration along its forward axis, the axis says it; else most of a drive is
    taken to be forward.
    """
    rolled = wheels[0].turns
    for imu, moved in bodies:
        felt = moved.running(moved.force[:, :1])
        begin, end = max(rolled.span[0], felt.span[0]), min(rolled.span[1], felt.span[1])
        middle = np.arange(begin + 1.5 * SENSE_WINDOW, end - 1.5 * SENSE_WINDOW, 0.25 * SENSE_WINDOW)
        if len(middle) < 8:
            continue
        half = 0.5 * SENSE_WINDOW
        change = np.diff([rolled.between(middle + s - half, middle + s + half)[:, 0] for s in (-half, half)], axis=0)[0]
        correlation = float(np.corrcoef(change, felt.between(middle - half, middle + half)[:, 0])[0, 1])
        if abs(correlation) > CLEAR_SENSE:
            return float(np.sign(correlation)), f"acceleration of {imu.name} along its forward axis"
    return 1.0, "most of the way is taken to be forward"


def _wheel_estimates(wheel: _WheelMotion, track: RunningSums | None, antenna: Array) -> tuple[Estimate, ...]:
    imu = wheel.imu
    assert imu.wheel is not None
    rightward = -imu.rotation.T @ wheel.spin.axis  # rolling forward turns about the axle to the left
    spin_name, tilt = _named(rightward)
    std = np.abs(imu.rotation.T) @ wheel.spin.std
    configured_name, configured_tilt = _named(imu.rotation[0])
    k = "xyz".index(spin_name[-1])
    tilt_std = (float(std[(k + 1) % 3] / DEG), float(std[(k + 2) % 3] / DEG))
    mounting = (
        Estimate("wheel.spin_axis", spin_name, None, configured_name),
        Estimate("wheel.tilt_deg", tilt, tilt_std, configured_tilt),
        _lever_arm(wheel, spin_name, tilt),
    )
    return mounting if track is None else (*_by_track(wheel, track, antenna), *mounting)


def _by_track(wheel: _WheelMotion, track: RunningSums, antenna: Array) -> tuple[Estimate, ...]:
    """Return the rolling radius, and of a wheel that is not steered its place beside the antenna."""
    imu = wheel.imu
    assert imu.wheel is not None
    found = rolling_radius(wheel.turns, track.edges, track.sums, imu.name)
    value, std = found.values.tolist(), found.std.tolist()
    radius = Estimate("wheel.radius_m", (value[0],), (std[0],), (imu.wheel.radius,))
    if imu.wheel.steering:
        return (radius,)
    lateral = float(imu.position[1] - antenna[1])
    return radius, Estimate(f"{ASIDE}right_of_antenna_m", (-value[1],), (std[1],), (lateral,))


def _named(axis: Array) -> tuple[str, tuple[float, float]]:
    """Return the sensor axis nearest to a direction, like `-z`, and the tilt of the direction from it, deg."""
    k = int(np.argmax(np.abs(axis)))
    name = ("-" if axis[k] < 0.0 else "") + "xyz"[k]
    return name, (float(axis[(k + 1) % 3] / axis[k] / DEG), float(axis[(k + 2) % 3] / axis[k] / DEG))


def _lever_arm(wheel: _WheelMotion, spin_name: str, tilt: tuple[float, float]) -> Estimate:
    """Return the lever arm from the IMU to the wheel's centre in the module's axes; along the axle as configured."""
    imu = wheel.imu
    assert imu.wheel is not None
    entry = WheelEntry.model_validate({"radius_m": imu.wheel.radius, "spin_axis": spin_name, "tilt_deg": tilt})
    module = wheel_rotation(entry) @ imu.rotation.T  # rows: the module's axes in those of the stream
    rightward = replace(wheel.spin, axis=module[0])
    place = lever_arm(wheel.motion, rightward, module[1:])
    y, z = (-place.values).tolist()
    # a gyro that shows a rate too large by s makes the arm too short by 2 s
    std = np.hypot(place.std, 2.0 * imu.noise.gyro_scale_std[0] * place.values)
    configured = tuple(imu.wheel.lever_arm.tolist())
    return Estimate("wheel.lever_arm_m", (float(imu.wheel.lever_arm[0]), y, z), (0.0, *std.tolist()), configured)


def _axle(wheels: Sequence[_WheelMotion], radii: dict[str, float]) -> RunningSums:
    """Return way and upward yaw of the middle of the axle, from the wheels that are not steered, if there are any."""
    used = [wheel for wheel in wheels if wheel.imu.wheel and not wheel.imu.wheel.steering] or wheels
    begin = max(wheel.turns.span[0] for wheel in used)
    end = min(wheel.turns.span[1] for wheel in used)
    edges = used[0].turns.edges
    edges = edges[(edges >= begin) & (edges <= end)]
    if len(edges) < 2:
        raise InputError("calibrate: the wheels' recordings have no common time; expected streams on one clock")
    sums = []
    for wheel in used:
        spin, yaw = wheel.turns.between(np.full(len(edges), begin), edges).T
        sums.append(np.column_stack([radii[wheel.imu.name] * spin - wheel.imu.position[1] * yaw, yaw]))
    return RunningSums(edges, np.mean(sums, axis=0))


def _body_estimates(imu: Imu, moved: Motion, rolled: RunningSums, height: RunningSums | None) -> tuple[Estimate, ...]:
    from scipy.spatial.transform import Rotation

    found = mount(moved, rolled, height, imu.name)
    axes = nearest_axes(imu.rotation)
    nominal = Rotation.from_matrix(imu.rotation @ axes.T)
    true = Rotation.from_euler("ZYX", found.angles[::-1]) * nominal
    degrees = [rotation.as_euler("ZYX", degrees=True)[::-1].tolist() for rotation in (true, nominal)]
    std = tuple((found.std / DEG).tolist())
    names = ", ".join(_named(row)[0] for row in axes)
    return (
        Estimate("axes", names, None, names),
        Estimate("mount_deg", tuple(degrees[0]), std, tuple(degrees[1])),
    )


def _surprises(name: str, estimates: Sequence[Estimate]) -> list[str]:
    """Say what contradicts the configuration in kind, not in degree."""
    return [
        f"IMU {name}: {one.key} is {one.value}, configured {one.configured}"
        for one in estimates
        if isinstance(one.value, str) and one.value != one.configured
    ]
