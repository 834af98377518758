"""eNav-Fusion whose fused state is fed back into the mechanization of every IMU: what may be shared, and what not.

After each epoch the velocity, or the attitude, of each IMU as seen at the array origin is replaced by the fused one. So
the next mechanization starts from it: paper A's simplification ii.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.outages import Interval
from polyins.kernels import fuse
from polyins.kernels.jit import kernel
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.navigate import batch, engine
from polyins.navigate.state import Inputs, Navigators, Outputs


def outage_maxima(recording: Recording, *, velocity: bool, attitude: bool) -> NDArray[np.float64]:
    """Return the maximum horizontal error in each outage, m, where velocity or attitude or both are fed back."""
    run = batch.prepare(recording, "enav-fusion")
    run_with_feedback(run.navigators, run.inputs, run.outputs, velocity, attitude)
    states, time = run.outputs.states, run.inputs.time
    return np.array([_maximum(recording, time, states, outage) for outage in recording.outages])


def _maximum(recording: Recording, time: NDArray[np.float64], states: NDArray[np.float64], outage: Interval) -> float:
    reference = recording.reference
    assert reference is not None
    inside = (reference.time >= outage[0]) & (reference.time <= outage[1])
    # the reference's instants are epochs of the IMUs
    epoch = np.searchsorted(time, reference.time[inside] - 1e-6)
    truth = reference.position[inside]
    miss = (states[epoch, :3] - truth) * metres_per_unit(truth[0], recording.geodetic)
    return float(np.hypot(miss[:, 0], miss[:, 1]).max())


@kernel
def run_with_feedback(navigators: Navigators, inputs: Inputs, outputs: Outputs, velocity: bool, attitude: bool) -> None:
    """Take all epochs of an array, and feed the fused velocity, attitude or both back after each."""
    state = navigators.state
    for k in range(1, len(inputs.time)):
        engine.run(navigators, inputs, outputs, None, None, slice(k, k + 1))
        for b in range(state.rows.shape[0]):
            if velocity:
                fuse.take_fused_velocity(state.rows[b], state.blocks[0])
            if attitude:
                fuse.take_fused_attitude(state.rows[b], state.blocks[0])
