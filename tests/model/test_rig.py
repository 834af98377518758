"""What noise figures say of slow errors."""

from __future__ import annotations

import numpy as np

from polyins.model.rig import DEG, NoiseGrade


def test_a_constant_in_a_bias_is_not_forgotten() -> None:
    grade = NoiseGrade.from_datasheet(
        angle_random_walk_deg_sqrt_h=0.2,
        velocity_random_walk_m_s_sqrt_h=0.2,
        gyro_bias_deg_h=10.0,
        accel_bias_mgal=100.0,
        gyro_scale_ppm=500.0,
        accel_scale_ppm=500.0,
        correlation_time_h=1.0,
        gyro_turn_on_deg_s=[0.5, 0.0, 3.0],
    )
    start, drift = grade.slow_std().as_array(), grade.steady_std()
    np.testing.assert_allclose(start[:3] / DEG, np.hypot([0.5, 0.0, 3.0], 10.0 / 3600.0), rtol=1e-12)
    np.testing.assert_array_equal(start[3:], drift[3:])
    # driven by the noise of the drift alone it stays as unsure as it began
    driven = 2.0 * drift**2 / grade.correlation_time
    np.testing.assert_allclose(driven / (2.0 * grade.damping()), start**2, rtol=1e-12)
    # and forgets as a constant and a drift together do, for a while that is short against the correlation time
    constant = start**2 - drift**2
    correlation = (constant + drift**2 * np.exp(-60.0 / grade.correlation_time)) / start**2
    np.testing.assert_allclose(1.0 - np.exp(-60.0 * grade.damping()), 1.0 - correlation, rtol=0.02)


def test_without_a_constant_a_bias_decays_as_its_drift() -> None:
    grade = NoiseGrade.from_datasheet(
        angle_random_walk_deg_sqrt_h=0.2,
        velocity_random_walk_m_s_sqrt_h=0.2,
        gyro_bias_deg_h=0.0,
        accel_bias_mgal=100.0,
        gyro_scale_ppm=500.0,
        accel_scale_ppm=500.0,
        correlation_time_h=2.0,
    )
    np.testing.assert_array_equal(grade.damping(), np.full(12, 1.0 / 7200.0))
    np.testing.assert_array_equal(grade.slow_std().as_array(), grade.steady_std())
