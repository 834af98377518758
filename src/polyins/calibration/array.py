"""Calibration of an array, or of one IMU: mounts, places, scale factors, cross-axis errors and biases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polyins.calibration import poses
from polyins.calibration.estimates import Agreement, Calibration, Estimate, nearest_axes
from polyins.calibration.poses import Common, Triad
from polyins.calibration.relative import (
    CLEAR_DELAY,
    CLEAR_MATRIX,
    CLEAR_PLACE,
    Differences,
    differences,
    jackknife_std,
)
from polyins.config import ImuEntry
from polyins.errors import InputError
from polyins.kernels.earth import gravity as gravity_at
from polyins.model.recording import Array, FilterOptions, Recording
from polyins.model.rig import DEG, PPM, Imu, ImuErrors

PLAIN = {"gyro_matrix": np.eye(3), "accel_matrix": np.eye(3)}
SAME_AXES = 0.9
"""cosine by which axes as configured are kept"""


def calibrate(recording: Recording, entries: Sequence[ImuEntry]) -> Calibration:
    """Estimate how the IMUs of a rigid array differ, and from attitudes that were held what they have in common.

    `entries`: as configured; they hold the matrices that the streams are corrected by already. All streams must be on
    one clock. Raises InputError without motion, and for a single IMU that was not held in enough attitudes; where
    clocks were found, they are what there is then.
    """
    try:
        return _errors(recording, entries)
    except InputError as error:
        if not recording.clock_offsets:
            raise
        return Calibration({}, recording.clock_offsets, (f"clocks only: {error}",))


def _errors(recording: Recording, entries: Sequence[ImuEntry]) -> Calibration:
    by_name = {entry.name: entry for entry in entries}
    imus, streams = recording.rig.imus, recording.imus
    found = differences(streams, np.array([imu.position for imu in imus]))
    gravity, warnings = _gravity(recording)
    common = poses.common(found.motion, found.rate(), found.force(), gravity)
    if len(imus) == 1 and common.accel is None:
        raise InputError(
            f"calibrate: one IMU alone, held in {len(common.poses)} attitudes that tell too little; expected a second "
            f"one, or at least {9 + poses.SPARE} attitudes, spread evenly, still for {poses.WINDOW:g} s or more each"
        )
    rate = _rate(found, common)
    if common.gyro_bias is not None and len(imus) > 1:
        found = found.with_places(rate, _times(common.accel, np.eye(3)))
    warnings += [*_untold(found), *_without(common)]
    whole = _Whole(found, common, np.cov(found.motion.smoothed(rate, found.motion.instants).T))
    return Calibration(
        {imu.name: whole.estimates(i, imu, by_name[imu.name], imus) for i, imu in enumerate(imus)},
        recording.clock_offsets,
        tuple(warnings if common.accel is not None else [text for text in warnings if "gravity" not in text]),
        poses=len(common.poses),
        agreement={
            "configured": Agreement(found.gyros.before, found.accels.before),
            "calibrated": Agreement(found.gyros.after, found.accels.after),
        },
    )


def _rate(found: Differences, common: Common) -> Array:
    """Return the array's rate on the grid as far as it is known, rad/s, shape (T, 3)."""
    bias = np.zeros(3) if common.gyro_bias is None else common.gyro_bias[0]
    return (found.rate() - bias) @ _times(common.gyro, np.eye(3)).T


def _gravity(recording: Recording) -> tuple[float, list[str]]:
    """Return gravity, m/s^2, where the recording was made, and a warning if that is not known."""
    if recording.gnss is not None and recording.geodetic:
        latitude, _, height = recording.gnss.position[0].tolist()
        return float(gravity_at(latitude, height)), []
    given = recording.options.gravity
    if given != FilterOptions.gravity:
        return given, []
    return given, [
        f"gravity is taken as {given:g} m/s^2; the accelerometers' scale factors are wrong by as much as it is, up to "
        "0.3 %: give filter.gravity_m_s2, or GNSS"
    ]


def _untold(found: Differences) -> list[str]:
    """Say what the motion does not tell, and is left as configured."""
    if len(found.motion.rate[0]) == 1:
        return []
    kinds = (
        ("gyros: matrices and mounts along", found.gyros.told, f"{CLEAR_MATRIX / PPM:.0f} ppm; turn it about them"),
        ("accelerometers: matrices along", found.accels.told, f"{CLEAR_MATRIX / PPM:.0f} ppm; turn it upside down"),
        ("places along", found.accels.extra_told, f"{CLEAR_PLACE * 1e3:.0f} mm; turn it faster about other axes"),
    )
    texts = [
        f"{what} {', '.join(_direction(one) for one in _missing(told))} stay as configured: the motion tells less than "
        f"{needed}"
        for what, told, needed in kinds
        if told.shape[1] < 3
    ]
    if not found.gyros.extra_told.size:
        texts.append(f"clocks stay as configured: the motion tells less than {CLEAR_DELAY * 1e3:.0f} ms")
    return texts


def _missing(told: Array) -> Array:
    """Return the directions across those that are told, rows."""
    left, _, _ = np.linalg.svd(np.hstack([told, np.zeros((3, 3))]))
    return np.asarray(left[:, told.shape[1] :].T)


def _direction(vector: Array) -> str:
    sign = np.sign(vector[np.argmax(np.abs(vector))])
    return "(" + ", ".join(f"{value:.2f}" for value in np.round(sign * vector, 2) + 0.0) + ")"


def _without(common: Common) -> list[str]:
    """Say what the attitudes do not tell."""
    count = len(common.poses)
    if common.accel is None:
        what = "what the IMUs have in common stays as configured"
        if common.gyro_bias is not None:
            what += " but for the gyros' biases"
        return [
            f"{what}: held in {count} attitude(s) that tell too little; expected at least {9 + poses.SPARE}, spread "
            f"evenly, still for {poses.WINDOW:g} s or more each"
        ]
    if common.gyro is None:
        return [
            f"what the gyros have in common stays as configured: the turns between {count} attitudes tell too little"
        ]
    return []


@dataclass(frozen=True)
class _Whole:
    """What IMUs differ by and what they have in common."""

    found: Differences
    common: Common
    turning: Array
    """how the array turned: covariance of its rates, shape (3, 3)"""

    def estimates(self, i: int, imu: Imu, entry: ImuEntry, imus: Sequence[Imu]) -> tuple[Estimate, ...]:
        """Return the settings of the IMU of that index."""
        several = len(imus) > 1
        return (
            *self._mounting(i, imu, entry),
            *(self._place(i, imu, imus) if several and self.found.accels.extra_told.size else ()),
            *(self._clock(i, entry) if several and self.found.gyros.extra_told.size else ()),
            *self._biases(i, imu, imus),
            *self._scales(i, imu, entry),
        )

    def _mounting(self, i: int, imu: Imu, entry: ImuEntry) -> tuple[Estimate, ...]:
        """Return axes, mount and the matrices in the sensor's axes."""
        gyros, accels = self.found.gyros, self.found.accels
        known = {key: np.array(getattr(entry, key)) for key in PLAIN}
        gyro = _times(self.common.gyro, gyros.matrix[i]) @ imu.rotation @ known["gyro_matrix"]
        accel = _times(self.common.accel, accels.matrix[i]) @ imu.rotation @ known["accel_matrix"]
        rotation = fitting_rotation(gyro, self.turning)
        before, after = nearest_axes(imu.rotation), nearest_axes(rotation)
        if np.trace(rotation @ imu.rotation.T) > 3.0 * SAME_AXES:
            after = before
        turns = _rotations(gyros.errors[:, i, :9], self.turning)
        turned = _cross(turns).reshape(-1, 9)
        std = [jackknife_std(one.errors[:, i, :9] - turned).reshape(3, 3) for one in (gyros, accels)]
        gyro_std, accel_std = np.hypot(std[0], _std_of(self.common.gyro)), np.hypot(std[1], _std_of(self.common.accel))
        across = gyro @ rotation.T
        # turned evenly about all axes, the same chip would seem mounted otherwise by this
        uneven = 0.5 * np.array([across[k, j] - across[j, k] for j, k in ((1, 2), (2, 0), (0, 1))])
        parts = [jackknife_std(turns), _turned_by(_std_of(self.common.gyro), self.turning), uneven]
        angles = np.linalg.norm(parts, axis=0) / DEG
        names = [", ".join(_axis(row) for row in axes) for axes in (after, before)]
        mounts = [euler_deg(one @ axes.T) for one, axes in ((rotation, after), (imu.rotation, after))]
        axes = () if names[0] == names[1] else (Estimate("axes", names[0], None, names[1]),)
        return (
            *axes,
            Estimate("mount_deg", mounts[0], _plain(angles), mounts[1]),
            _matrix("gyro_matrix", rotation.T @ gyro, _permuted(after, gyro_std), known["gyro_matrix"]),
            _matrix("accel_matrix", rotation.T @ accel, _permuted(after, accel_std), known["accel_matrix"]),
        )

    def _place(self, i: int, imu: Imu, imus: Sequence[Imu]) -> tuple[Estimate, ...]:
        accels = self.found.accels
        middle = np.mean([one.position for one, alike in zip(imus, self.found.alike, strict=True) if alike], axis=0)
        arm = accels.extra[i]
        # a rate that is shown too large by s makes the arm too short by 2 s
        scale = imu.noise.gyro_scale_std if self.common.gyro is None else np.diag(self.common.gyro.matrix_std)
        std = np.hypot(accels.std[i, 12:], 2.0 * scale.max() * np.abs(arm))
        return (Estimate("position_m", _plain(middle + arm), _plain(std), _plain(imu.position)),)

    def _clock(self, i: int, entry: ImuEntry) -> tuple[Estimate, ...]:
        gyros = self.found.gyros
        late = entry.clock_offset_s + float(gyros.extra[i, 0])
        return (Estimate("clock_offset_s", (late,), (float(gyros.std[i, 12]),), (entry.clock_offset_s,)),)

    def _biases(self, i: int, imu: Imu, imus: Sequence[Imu]) -> tuple[Estimate, ...]:
        """Return biases and how sure they are when the IMUs are switched on another time and have drifted."""
        accel = self.common.accel
        accel_bias = None if accel is None else (accel.bias, accel.bias_std)
        kinds = (
            ("gyro_bias_deg_s", self.found.gyros, self.common.gyro, self.common.gyro_bias, DEG),
            ("accel_bias_m_s2", self.found.accels, accel, accel_bias, 1.0),
        )
        estimates = []
        for key, fitted, triad, shared, unit in kinds:
            name = key.rsplit("_bias", 1)[0] + "_bias"
            configured = np.array([getattr(one.initial_errors, name) for one in imus])
            own = configured[i] / unit
            bias, std = fitted.bias[i] + configured[self.found.alike].mean(axis=0), fitted.std[i, 9:12]
            if shared is not None:
                bias = _times(triad, np.eye(3)) @ (fitted.bias[i] + shared[0])
                std = np.hypot(std, shared[1])
            estimates.append(Estimate(f"initial_errors.{key}", _plain(bias / unit), _plain(std / unit), _plain(own)))
            if shared is not None:
                drifted = np.hypot(std, getattr(imu.noise, f"{name}_std"))
                estimates.append(_std_estimate(key, drifted / unit, getattr(_start_std(imu), name) / unit))
        return tuple(estimates)

    def _scales(self, i: int, imu: Imu, entry: ImuEntry) -> tuple[Estimate, ...]:
        """Return that the matrices hold the scale factors, and how sure they are, where those are told."""
        estimates = []
        for kind, fitted, triad in (
            ("gyro", self.found.gyros, self.common.gyro),
            ("accel", self.found.accels, self.common.accel),
        ):
            if triad is None:
                continue
            key, name = f"{kind}_scale_ppm", f"{kind}_scale"
            own = getattr(imu.initial_errors, name) / PPM
            if own.any():
                estimates.append(Estimate(f"initial_errors.{key}", (0.0, 0.0, 0.0), None, _plain(own)))
            std = np.hypot(fitted.std[i, [0, 4, 8]], np.diag(triad.matrix_std))
            estimates.append(_std_estimate(key, std / PPM, getattr(_start_std(imu), name) / PPM))
        return tuple(estimates)


def _start_std(imu: Imu) -> ImuErrors:
    return imu.initial_std or imu.noise.slow_std()


def _std_estimate(key: str, std: Array, configured: Array) -> Estimate:
    return Estimate(f"initial_std.{key}", _plain(std), None, _plain(configured))


def _times(triad: Triad | None, matrix: Array) -> Array:
    return matrix if triad is None else triad.matrix @ matrix


def _std_of(triad: Triad | None) -> Array:
    return np.zeros((3, 3)) if triad is None else triad.matrix_std


def fitting_rotation(matrix: Array, turning: Array) -> Array:
    """Return the rotation that makes of what a sensor shows the array's rates best, as it was turned.

    `matrix`: makes them of it wholly; `turning`: covariance of the rates, (rad/s)^2.
    """
    left, _, right = np.linalg.svd(turning @ np.linalg.inv(matrix).T)
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


def _rotations(errors: Array, turning: Array) -> Array:
    """Return the rotations that fit error matrices best, as in `fitting_rotation`, rad, shapes (B, 9) to (B, 3)."""
    product = errors.reshape(-1, 3, 3) @ turning
    around = np.array([product[:, k, j] - product[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))])
    return np.asarray(np.linalg.solve(np.trace(turning) * np.eye(3) - turning, around).T)


def _turned_by(std: Array, turning: Array) -> Array:
    """Return by what the fitting rotation errs for a symmetric matrix that errs by `std`, shape (3, 3), rad."""
    elements = [np.zeros((3, 3)) for _ in poses.UPPER]
    for element, (i, j) in zip(elements, poses.UPPER, strict=True):
        element[i, j] = element[j, i] = std[i, j]
    return np.asarray(np.linalg.norm(_rotations(np.array(elements).reshape(-1, 9), turning), axis=0))


def _cross(vectors: Array) -> Array:
    x, y, z = vectors.T
    none = np.zeros_like(x)
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]]).transpose(2, 0, 1)


def _permuted(axes: Array, std: Array) -> Array:
    """Return the std of a matrix in the array's axes for one in the sensor's."""
    return np.abs(axes).T @ std @ np.abs(axes)


def _matrix(key: str, value: Array, std: Array, configured: Array) -> Estimate:
    return Estimate(key, _plain(value.ravel()), _plain(std.ravel()), _plain(configured.ravel()))


def _axis(row: Array) -> str:
    k = int(np.argmax(np.abs(row)))
    return ("-" if row[k] < 0.0 else "") + "xyz"[k]


def euler_deg(rotation: Array) -> tuple[float, ...]:
    """Return roll, pitch, yaw of a rotation, deg."""
    from scipy.spatial.transform import Rotation

    return _plain(Rotation.from_matrix(rotation).as_euler("ZYX", degrees=True)[::-1])


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
