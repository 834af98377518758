"""IMUs on rulers: what they put out, mechanized, is where they are."""

import numpy as np
import pytest
from mechanization import mechanize
from scipy.spatial.transform import Rotation

from polyins.simulation import earth
from polyins.simulation.cantilever import Cantilever
from polyins.simulation.flexible import FlexibleMount, flex, shape_of, tip_motion
from polyins.simulation.flexible_scenario import Book, FlexibleMounts, Road, Shuttle
from polyins.simulation.increments import increments
from polyins.simulation.moving_imu import moving_increments, smooth_rates
from polyins.simulation.shaking import Shaking, shake, shaken_path

STEP = 1.0 / 2000.0
BEAM = Cantilever(0.22, 0.03, 0.001, 0.015, 0.008, 0.02)
RIGHT = FlexibleMount(BEAM, np.array([-0.2, 0.31, 0.01]), 1.0, tuning=1.02)
LEFT = FlexibleMount(BEAM, np.array([0.18, -0.28, 0.01]), -1.0, tuning=0.98)


def shuttle(duration=40.0):
    return Shuttle(speed_m_s=1.15, straight_m=8.0, turn_radius_m=1.0).path(duration, 3.0, (0.53, 1.99, 30.0), earth)


def lawn(path, roughness_mm=3.0):
    road = Road(roughness_mm=roughness_mm, books=(Book(at_m=2.0, height_m=0.01, under="left"),))
    return shake(path, road.ground(path, (3.0,), np.random.default_rng(3)), road.suspension(), STEP)


def moved(ruler, flexing, shaking, sample):
    out = np.empty(18)
    tip_motion(shaking.motion[sample], shaking.change[sample], flexing[sample], shape_of(ruler), out)
    return out[:9].reshape(3, 3), out[9:12], out[12:15], out[15:18]


@pytest.mark.parametrize("ruler", [RIGHT, LEFT], ids=["right", "left"])
def test_mechanized_increments_of_a_flexing_imu_return_its_own_pose(ruler):
    path = shuttle()
    shaking = lawn(path)
    flexing = flex(ruler, shaking, 9.79)
    dtheta, dvel = moving_increments(smooth_rates(path, 8000, 0.005), ruler, flexing, shaking)
    # the test means something: the tip swings through centimetres and degrees
    assert np.ptp(flexing[:, 0]) > 0.01
    every = np.arange(0, 80001, 400)
    motion = path.motion(every * STEP)
    relative = [moved(ruler, flexing, shaking, n) for n in every]
    C = np.array([C_np @ C_ps for C_np, (C_ps, *_) in zip(motion.C_nb, relative, strict=True)])
    place = np.array([C_np @ u for C_np, (_, _, u, _) in zip(motion.C_nb, relative, strict=True)])
    position = motion.position + earth.displacement(motion.position, place)
    turning = motion.angular_rate - motion.earth_rate
    speed = [v + np.cross(w, u) for w, (_, _, u, v) in zip(turning, relative, strict=True)]
    velocity = motion.velocity + np.einsum("tij,tj->ti", motion.C_nb, speed)
    p, v, attitude = mechanize(position[0], velocity[0], C[0], dtheta, dvel, 0.005)
    at = every[1:] // 10 - 1
    meridian, transverse = earth.radii(position[1:])
    metric = np.column_stack([meridian, transverse * np.cos(position[1:, 0]), np.ones_like(meridian)])
    angle = Rotation.from_matrix(np.swapaxes(C[1:], 1, 2) @ attitude[at]).magnitude()
    # what is left is the mechanization's own error at 200 Hz: coning and sculling of a 12 Hz vibration
    assert np.degrees(angle).max() < 5e-4
    assert np.abs(v[at] - velocity[1:]).max() < 2e-3
    assert np.abs((p[at] - position[1:]) * metric).max() < 0.03


def test_rates_and_forces_are_derivatives_of_the_pose():
    """The same increments from the pose alone, by finite differences on the finest grid."""
    path = shuttle(12.0)
    shaking = lawn(path)
    flexing = flex(RIGHT, shaking, 9.79)
    _, dvel = moving_increments(smooth_rates(path, 2400, 0.005), RIGHT, flexing, shaking)
    samples = np.arange(16000, 16200)
    relative = [moved(RIGHT, flexing, shaking, n) for n in samples]
    C_ps, w, u, speed = (np.array(values) for values in zip(*relative, strict=True))
    turned = Rotation.from_matrix(np.swapaxes(C_ps[:-1], 1, 2) @ C_ps[1:]).as_rotvec()
    np.testing.assert_allclose(turned / STEP, (w[1:] + w[:-1]) / 2.0, atol=2e-3 * np.abs(w).max())
    np.testing.assert_allclose(np.diff(u, axis=0) / STEP, (speed[1:] + speed[:-1]) / 2.0, atol=2e-3)
    # the path is level and straight here: the vertical force is gravity and the tip's acceleration
    intervals = slice(samples[0] // 10, samples[-1] // 10)
    C = C_ps[::10][: intervals.stop - intervals.start]
    felt = np.einsum("tij,tj->ti", C, dvel[intervals])[:, 2]
    expected = np.diff(speed[::10, 2])[: len(felt)] - 9.79 * 0.005
    np.testing.assert_allclose(felt, expected, atol=0.1 * np.abs(expected + 9.79 * 0.005).max())


def test_a_stiff_ruler_on_level_ground_is_a_rigid_mount():
    path = shuttle(20.0)
    still = Shaking(STEP, np.zeros((40001, 3)), np.zeros((40001, 3)))
    stiff = FlexibleMount(BEAM, RIGHT.tip, 1.0, stiff=True)
    dtheta, dvel = moving_increments(smooth_rates(path, 4000, 0.005), stiff, flex(stiff, still, 9.79), still)
    rigid_dtheta, rigid_dvel = increments(path).at(stiff.nominal)
    np.testing.assert_allclose(dtheta, rigid_dtheta, atol=1e-10)
    np.testing.assert_allclose(dvel, rigid_dvel, atol=1e-9)


def test_at_rest_a_ruler_sags_by_its_own_weight_and_the_module_s():
    still = Shaking(STEP, np.zeros((10, 3)), np.zeros((10, 3)))
    ruler = FlexibleMount(BEAM, RIGHT.tip, 1.0)
    sag = flex(ruler, still, 9.81)[:, 0]
    rigidity = 200e9 * 0.03 * 0.001**3 / 12.0
    weight = 7850.0 * 0.03 * 0.001 * 9.81
    # point load at the tip and uniform load, Euler and Bernoulli's static beam
    expected = 0.015 * 9.81 * 0.22**3 / (3.0 * rigidity) + weight * 0.22**4 / (8.0 * rigidity)
    np.testing.assert_allclose(sag, expected, rtol=0.01)
    # gravity's direction as the module feels it: turned by the slope, the right way on either side
    for side, tip in ((1.0, 0.3), (-1.0, -0.3)):
        turned = moved(FlexibleMount(BEAM, np.array([0.0, tip, 0.0]), side), flex(ruler, still, 9.81), still, 0)[0]
        assert Rotation.from_matrix(turned).as_euler("ZYX")[2] == pytest.approx(side * BEAM.slope * sag[0] / 0.22)


def test_the_shaken_path_s_velocity_and_rate_are_derivatives():
    path = shuttle(20.0)
    body = shaken_path(path, lawn(path))
    time, h = np.linspace(5.0, 19.0, 57), 1e-5
    point = (0.3, -0.2, 0.1)
    before, now, after = (body.truth(time + shift, point) for shift in (-h, 0.0, h))
    meridian, transverse = earth.radii(now.position)
    metric = np.column_stack([meridian, transverse * np.cos(now.position[:, 0]), -np.ones_like(meridian)])
    np.testing.assert_allclose((after.position - before.position) * metric / (2 * h), now.velocity, atol=1e-4)
    turned = Rotation.from_euler("ZYX", before.attitude[:, ::-1]).inv() * Rotation.from_euler(
        "ZYX", after.attitude[:, ::-1]
    )
    motion = body.motion(time)
    np.testing.assert_allclose(turned.as_rotvec() / (2 * h), motion.angular_rate - motion.earth_rate, atol=1e-4)
    assert np.abs(body.motion(time).attitude[:, 0]).max() > 1e-3


def test_what_a_clamp_gives_to_one_end_of_a_ruler_it_takes_from_the_other():
    arms = [{"tip_m": (x, y, 0.0), "free_length_m": 0.2} for x in (0.1, -0.1) for y in (0.3, -0.3)]
    found = set()
    for seed in range(20):
        tunings = [ruler.tuning for ruler in FlexibleMounts(arms=tuple(arms)).mounts(np.random.default_rng(seed))]
        np.testing.assert_allclose([tunings[0] + tunings[1], tunings[2] + tunings[3]], 2.0)
        found.add(tuple(np.round(tunings, 6)))
    # either end may be the longer one, of each ruler
    assert found == {(a, 2.0 - a, b, 2.0 - b) for a in (0.97, 1.03) for b in (0.97, 1.03)}


def test_each_imu_keeps_its_nominal_place_in_the_rig():
    arms = ({"tip_m": (0.1, 0.3, 0.0), "free_length_m": 0.2}, {"tip_m": (0.1, -0.3, 0.0), "free_length_m": 0.2})
    right, left = FlexibleMounts(arms=arms).mounts()
    np.testing.assert_allclose(right.nominal, [0.1, 0.3, -0.008])
    assert (right.side, left.side) == (1.0, -1.0)
