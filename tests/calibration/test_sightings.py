"""What sensors say of a trajectory: predicted values and their derivatives, by finite differences."""

import numpy as np
import pytest

from polyins.calibration.preintegration import Increments, rotation
from polyins.calibration.sightings import KINDS, OFFSETS, STATES, Instants, Nodes, Predicted, Sightings

RNG = np.random.default_rng(4)
TIME = 0.02 * np.arange(61)
MEASURED = np.hstack([RNG.normal(0.0, 0.01, (61, 3)), RNG.normal([0.0, 0.0, -0.2], 0.05, (61, 3))])
CUT = Increments.of(TIME, MEASURED, 20)
NODES = Nodes(
    RNG.normal(0.0, 10.0, (4, 3)),
    RNG.normal(0.0, 5.0, (4, 3)),
    rotation(RNG.normal(0.0, 0.3, (4, 3))),
    RNG.normal(0.0, 0.003, (4, 12)),
    np.tile([0.0, 0.0, 9.8], (4, 1)),
)
AT = np.array([0.013, 0.207, 0.555, 1.1901])
SIZES = {"position": 3, "velocity": 3, "heading": 1, "attitude": 3, "speed": 1}


def predicted(kind: str, nodes: Nodes, time: np.ndarray, offsets: np.ndarray) -> Predicted:
    size = SIZES[kind]
    values = rotation(RNG.normal(0.0, 0.01, (4, 3))) if kind == "attitude" else np.zeros((4, size))
    if kind == "attitude":
        start = Instants.at(AT, NODES, CUT.preintegrated(NODES.errors[:-1]))
        values = start.attitude
    seen = Sightings("x", kind, AT, values, np.ones((4, size)), np.array([0.5, -0.3, 1.0]))
    return seen.predicted(Instants.at(time, nodes, CUT.preintegrated(nodes.errors[:-1])), offsets)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives(kind: str) -> None:
    offsets = np.zeros(len(OFFSETS.get(kind, ())))
    at = predicted(kind, NODES, AT, offsets)
    h = 1e-6

    def slope(before: Predicted, after: Predicted) -> np.ndarray:
        return (before.residual - after.residual) / (2.0 * h)

    by_time = slope(*(predicted(kind, NODES, AT + s, offsets) for s in (-h, h)))
    np.testing.assert_allclose(at.by_time, by_time, atol=2e-3 * max(1.0, np.abs(by_time).max()))
    for k in range(STATES):
        step = np.zeros((4, STATES))
        step[:, k] = h
        found = slope(predicted(kind, NODES.moved(-step), AT, offsets), predicted(kind, NODES.moved(step), AT, offsets))
        np.testing.assert_allclose(at.by_states[:, :, k], found, atol=0.02 * max(1.0, np.abs(found).max()))
    for k in range(len(offsets)):
        step = h * np.eye(len(offsets))[k]
        found = slope(predicted(kind, NODES, AT, offsets - step), predicted(kind, NODES, AT, offsets + step))
        np.testing.assert_allclose(at.by_offsets[:, :, k], found, atol=1e-6 * max(1.0, np.abs(found).max()))


def test_just_before_a_node_a_trajectory_is_where_the_increments_end() -> None:
    measured = CUT.preintegrated(NODES.errors[:-1])
    end = Instants.at(np.array([0.4 - 1e-9]), NODES, measured)
    span, start = 0.4, NODES.attitude[0]
    position = NODES.position[0] + NODES.velocity[0] * span + 0.5 * NODES.gravity[0] * span**2
    np.testing.assert_allclose(end.position[0], position + start @ measured.position[0, -1], atol=1e-7)
    velocity = NODES.velocity[0] + NODES.gravity[0] * span + start @ measured.velocity[0, -1]
    np.testing.assert_allclose(end.velocity[0], velocity, atol=1e-7)
    np.testing.assert_allclose(end.attitude[0], start @ measured.turned[0, -1], atol=1e-7)
