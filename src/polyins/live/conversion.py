"""The edge: from what a sensor says, in its axes and on its clock, to the array's axes and the recording's clock."""

from __future__ import annotations

import numpy as np

from polyins.config import Config
from polyins.live.source import RefusedError
from polyins.navigate.samples import Array, GnssFix, ImuSample, Sample, SensorSample
from polyins.reading import imu_stream, sensor_stream
from polyins.reading.position_stream import height_shift, on_plane


class Conversion:
    """What a configuration says of mounts, clocks, heights and accuracies, applied to one sample at a time."""

    def __init__(self, config: Config, geodetic: bool) -> None:
        self.matrices = {
            entry.name: tuple(map(_unless_identity, imu_stream.to_array_axes(entry))) for entry in config.imus
        }
        self.clocks = {entry.name: entry.clock for entry in config.imus}
        self.gnss = config.gnss
        self.sensors = dict(sensor_stream.entries(config))
        self.geodetic = geodetic

    def taken(self, sample: Sample) -> Sample:
        """Return the sample as the navigator wants it; raises RefusedError with the kind of what is wrong."""
        if isinstance(sample, SensorSample):
            return self._sensor(sample)
        return self._imu(sample) if isinstance(sample, ImuSample) else self._fix(sample)

    def _imu(self, sample: ImuSample) -> ImuSample:
        if sample.imu not in self.matrices:
            raise RefusedError("unknown IMU")
        (gyro, accel), time = self.matrices[sample.imu], self.clocks[sample.imu].common(sample.time)
        return ImuSample(sample.imu, time, _mapped(gyro, sample.dtheta), _mapped(accel, sample.dvel))

    def _sensor(self, sample: SensorSample) -> SensorSample:
        entry = self.sensors.get(sample.kind)
        if entry is None:
            raise RefusedError(f"{sample.kind} without a section {sample.kind}")
        given = sensor_stream.std_of(entry)
        std = sample.std
        if given is not None:
            std = sensor_stream.with_constraint(entry, np.array([given]))[0]
        return sample._replace(time=entry.clock.common(sample.time), std=std)

    def _fix(self, fix: GnssFix) -> GnssFix:
        entry = self.gnss
        if entry is None:
            raise RefusedError("GNSS without a gnss section")
        std = fix.position_std if entry.position_std_m is None else np.array(entry.position_std_m)
        if std is None:
            raise RefusedError("GNSS without std")
        time = entry.clock.common(fix.time)
        position = self._placed(self._above_ellipsoid(fix), fix.geodetic)
        has_velocity = fix.velocity is not None and fix.velocity_std is not None
        velocity = (fix.velocity, fix.velocity_std) if has_velocity else (None, None)
        return GnssFix(time, position, std, *velocity, geodetic=self.geodetic)

    def _above_ellipsoid(self, fix: GnssFix) -> Array:
        assert self.gnss is not None
        shift = height_shift(self.gnss, fix.position, fix.geodetic, fix.above_sea)
        if shift is None:
            raise RefusedError("height above the sea without geoid_height_m")
        return np.asarray(fix.position + np.array([0.0, 0.0, shift]))

    def _placed(self, position: Array, geodetic: bool) -> Array:
        """Return the position in the kind that the filter has."""
        origin = None if self.gnss is None else self.gnss.plane_origin
        if geodetic and origin is not None:
            return np.asarray(on_plane(position[None, :], origin)[0])
        if geodetic != self.geodetic:
            raise RefusedError("position of another kind")
        return position


def _mapped(matrix: Array | None, increment: Array) -> Array:
    # as a recording is read, to the last bit, which matrix @ increment is not
    return increment if matrix is None else np.einsum("ij,j->i", matrix, increment)


def _unless_identity(matrix: Array) -> Array | None:
    return None if np.array_equal(matrix, np.eye(3)) else matrix
