"""eNav-Fusion whose fused state is fed back into the mechanization of every IMU: what may be shared, and what not.

After each epoch the velocity, or the attitude, of each IMU as seen at the array origin is replaced by the fused one. So
the next mechanization starts from it: paper A's simplification ii.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.outages import Interval
from polyins.kernels import fuse
from polyins.kernels.jit import Array, kernel
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.navigate import batch, engine
from polyins.navigate.engine import Inputs, Outputs, Plan, State


def outage_maxima(recording: Recording, *, velocity: bool, attitude: bool) -> NDArray[np.float64]:
    """Return the maximum horizontal error in each outage, m, where velocity or attitude or both are fed back."""
    run = batch.prepare(recording, "enav-fusion")
    fixes = run.inputs.fixes if len(run.inputs.fixes) else None
    run_with_feedback(run.state, run.plan, run.inputs, run.outputs, fixes, run.origin, velocity, attitude)
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
def run_with_feedback(
    state: State,
    plan: Plan,
    inputs: Inputs,
    outputs: Outputs,
    fixes: Array | None,
    origin: Array | None,
    velocity: bool,
    attitude: bool,
) -> None:
    """Take all epochs of an array, and feed the fused velocity, attitude or both back after each."""
    for k in range(1, len(inputs.time)):
        engine.run_epochs(state, plan, inputs, outputs, k, k + 1, fixes, None, origin, None, None)
        for b in range(state.blocks.shape[0]):
            if velocity:
                fuse.take_fused_velocity(state.blocks[b], state.groups[0])
            if attitude:
                fuse.take_fused_attitude(state.blocks[b], state.groups[0])
