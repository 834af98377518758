"""Vectorized attitude conversions against first principles."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from polyins.model.attitude import (
    angular_rate,
    euler_angles,
    euler_jacobian,
    euler_variance,
    in_succession,
    of_rotation_vectors,
    quaternions,
    rotation_matrices,
    wrap,
)

angle = st.floats(-3.1, 3.1)
tilt = st.floats(-1.4, 1.4)


def axis_rotation(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


@given(angle, tilt, angle)
def test_euler_angles_are_the_zyx_sequence_and_survive_the_way_there_and_back(roll, pitch, heading):
    euler = np.array([[roll, pitch, heading]])
    built = axis_rotation(2, heading) @ axis_rotation(1, pitch) @ axis_rotation(0, roll)
    np.testing.assert_allclose(rotation_matrices(quaternions(euler))[0], built, atol=1e-14)
    np.testing.assert_allclose(euler_angles(quaternions(euler)), euler, atol=1e-12)
    np.testing.assert_allclose(euler_angles(-quaternions(euler)), euler, atol=1e-12)


@given(angle, tilt, angle, st.integers(0, 2))
def test_jacobian_matches_finite_differences_of_a_rotated_attitude(roll, pitch, heading, axis):
    euler = np.array([[roll, pitch, heading]])
    step = 1e-6
    half = 0.5 * step
    w, x, y, z = quaternions(euler)[0]
    vector = np.array([x, y, z])

    def rotated(sign: float) -> np.ndarray:
        # q(phi) q_nb: the rotation by phi, given in n, comes on the left
        turn = sign * np.sin(half) * np.eye(3)[axis]
        scalar = np.cos(half) * w - turn @ vector
        return euler_angles(np.array([[scalar, *(np.cos(half) * vector + w * turn + np.cross(turn, vector))]]))[0]

    difference = wrap(rotated(1.0) - rotated(-1.0)) / (2.0 * step)
    np.testing.assert_allclose(euler_jacobian(euler)[0, :, axis], difference, atol=1e-7, rtol=1e-6)


def test_variance_of_euler_angles_is_that_of_drawn_attitude_errors():
    generator = np.random.default_rng(3)
    root = generator.normal(size=(3, 3)) * 1e-3
    covariance = root @ root.T
    phi = generator.normal(size=(200_000, 3)) @ root.T
    euler = np.array([[0.4, 0.8, 2.0]])
    drawn = np.var(phi @ euler_jacobian(euler)[0].T, axis=0)
    upper = covariance[np.triu_indices(3)][None]
    np.testing.assert_allclose(euler_variance(euler, upper)[0], drawn, rtol=0.02)


def test_level_body_has_the_heading_variance_of_phi_down():
    variance = euler_variance(np.array([[0.3, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 9.0]]))
    np.testing.assert_allclose(variance, [[1.0, 1.0, 9.0]])


def test_angular_rate_of_a_steady_turn_is_exact_whatever_the_quaternions_sign():
    time = np.array([0.0, 0.01, 0.02, 0.05, 0.06])
    rate = np.array([0.3, -0.2, 1.5])
    size = np.linalg.norm(rate)
    half = 0.5 * size * time[:, None]
    attitude = np.hstack([np.cos(half), np.sin(half) * rate / size])
    attitude[2] *= -1.0
    np.testing.assert_allclose(angular_rate(time, attitude), np.tile(rate, (5, 1)), atol=1e-11)


def test_angular_rate_of_a_body_at_rest_and_of_one_epoch_is_zero():
    still = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    np.testing.assert_array_equal(angular_rate(np.arange(4.0), still), 0.0)
    np.testing.assert_array_equal(angular_rate(np.zeros(1), still[:1]), np.zeros((1, 3)))


@given(arrays(float, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(-4.0, 4.0)))
def test_rotations_in_succession_are_their_product_in_order(vectors):
    whole = np.eye(3)
    for vector in vectors:
        whole = whole @ Rotation.from_rotvec(vector).as_matrix()
    product = in_succession(of_rotation_vectors(vectors))
    np.testing.assert_allclose(rotation_matrices(product[None, :])[0], whole, atol=1e-13)
