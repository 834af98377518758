"""A stand-in for the navigator: dead simple, but of the same interface."""

import pickle
import sys
import types
from collections import Counter
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NavigatorState:
    time: float
    position: np.ndarray
    velocity: np.ndarray
    attitude: np.ndarray
    position_std: np.ndarray
    velocity_std: np.ndarray
    attitude_std: np.ndarray


@dataclass(frozen=True)
class ImuHealth:
    name: str
    last_time: float
    rate_hz: float
    gyro_residual: np.ndarray
    accel_residual: np.ndarray
    silent: bool


class Navigator:
    """Holds epochs back by the delay, sorts them, and adds them up: any difference in what is fed shows."""

    def __init__(self, rig, start, *, method="enav-fusion", options=None, geodetic=True, delay=0.5):
        self.names = [imu.name for imu in rig.imus]
        self.start, self.delay = start, delay
        self.time = start.time
        self.newest = start.time
        self.waiting = {}
        self.sums = np.zeros((len(self.names), 6))
        self.position = np.array(start.position)
        self.rows = Counter()
        self.counts = Counter()

    def _take(self, key, time, values):
        if time <= self.time:
            self.counts["reordered beyond the delay"] += 1
        elif (time, key) in self.waiting:
            self.counts["duplicated"] += 1
        else:
            self.waiting[(time, key)] = values
            self.newest = max(self.newest, time)
            self._advance(self.newest - self.delay)

    def _advance(self, until):
        for time, key in sorted(k for k in self.waiting if k[0] <= until):
            values = self.waiting.pop((time, key))
            if key < 0:
                self.position = values
            else:
                self.sums[key] += values
                self.rows[self.names[key]] += 1
            self.time = time

    def imu(self, time, dtheta, dvel, imu=0):
        self._take(imu, time, np.concatenate([dtheta, dvel]))

    def gnss(self, time, position, position_std, velocity=None, velocity_std=None):
        self._take(-1, time, np.array(position))

    @property
    def state(self):
        velocity = self.sums[:, 3:].mean(axis=0) * 1e-3
        q = np.array([1.0, *(0.5 * self.sums[:, :3].mean(axis=0))])
        three = np.full(3, 0.1)
        return NavigatorState(self.time, self.position, velocity, q / np.linalg.norm(q), three, three, three)

    @property
    def health(self):
        mean = self.sums.mean(axis=0)
        return tuple(
            ImuHealth(n, self.time, 100.0, s[:3] - mean[:3], s[3:] - mean[3:], False)
            for n, s in zip(self.names, self.sums, strict=True)
        )

    def flush(self):
        self._advance(np.inf)

    def save(self, path):
        path.write_bytes(pickle.dumps(self.__dict__))

    @classmethod
    def resume(cls, path):
        one = cls.__new__(cls)
        one.__dict__ = pickle.loads(path.read_bytes())
        return one


def install() -> None:
    module = types.ModuleType("polyins.navigator")
    module.Navigator, module.NavigatorState, module.ImuHealth = Navigator, NavigatorState, ImuHealth
    sys.modules["polyins.navigator"] = module
