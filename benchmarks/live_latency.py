"""How long a `Navigator` takes for an epoch of sixteen IMUs at 1 kHz: `python benchmarks/live_latency.py`.

The samples are paced by the clock, as from sensors; a fix comes every second, 0.3 s late. What is timed is the call
with the samples of one epoch, of all IMUs at once or (`--one-by-one`) of each in turn, with everything that it sets
off. Run it on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np
from numpy.typing import NDArray

import polyins as pi

IMUS, RATE_HZ, LATE_S = 16, 1000, 0.3
GRAVITY = 9.80665

Array = NDArray[np.float64]


def navigator() -> pi.Navigator:
    """Return a navigator of an array at rest on a plane."""
    grade = pi.NoiseGrade.from_datasheet(
        angle_random_walk_deg_sqrt_h=0.3,
        velocity_random_walk_m_s_sqrt_h=0.1,
        gyro_bias_deg_h=30,
        accel_bias_mgal=200,
        gyro_scale_ppm=1000,
        accel_scale_ppm=1000,
        correlation_time_h=1,
    )
    places = 0.02 * np.array([(i % 4, i // 4, 0) for i in range(IMUS)], dtype=float)
    rig = pi.Rig(tuple(pi.Imu(f"imu{i}", grade, position=place) for i, place in enumerate(places)))
    start = pi.Start.known(rig, 0.0, (0.5, 0.1, 30.0), attitude=(0.0, 0.0, 1.0))
    return pi.Navigator(rig, start)


def timed(seconds: float, one_by_one: bool) -> tuple[Array, pi.Navigator]:
    """Return the time of each call, s, with the navigator at the end."""
    nav, rng = navigator(), np.random.default_rng(1)
    epochs = round(seconds * RATE_HZ)
    dtheta = 1e-6 * rng.normal(size=(1000, IMUS, 3))
    dvel = 1e-5 * rng.normal(size=(1000, IMUS, 3)) + [0.0, 0.0, -GRAVITY / RATE_HZ]
    took = np.zeros(epochs)
    begin = time.perf_counter()
    for k in range(1, epochs + 1):
        while time.perf_counter() - begin < k / RATE_HZ:
            pass
        stamp, row = k / RATE_HZ, k % 1000
        before = time.perf_counter()
        if one_by_one:
            for i in range(IMUS):
                nav.imu(stamp, dtheta[row, i], dvel[row, i], i)
        else:
            nav.imu(stamp, dtheta[row], dvel[row])
        if k % RATE_HZ == int(LATE_S * RATE_HZ) and k > RATE_HZ:
            nav.gnss(stamp - LATE_S, (0.5, 0.1, 30.0), (0.02, 0.02, 0.04))
        took[k - 1] = time.perf_counter() - before
    return took, nav


def main() -> None:
    """Print the figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--one-by-one", action="store_true")
    given = parser.parse_args()
    timed(2.0, given.one_by_one)  # compiles, or loads the kernels
    took, nav = timed(given.seconds, given.one_by_one)
    p50, p99, p999 = np.percentile(took, [50.0, 99.0, 99.9])
    state = nav.state
    figures = {
        "imus": IMUS,
        "rate_hz": RATE_HZ,
        "seconds": given.seconds,
        "one_by_one": given.one_by_one,
        "p50_us": 1e6 * p50,
        "p99_us": 1e6 * p99,
        "p99.9_us": 1e6 * p999,
        "max_us": 1e6 * took.max(),
        "epochs": len(took),
        "newest_s": None if state is None else state.time,
        "refused": nav.counts,
    }
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    main()
