"""Whether the errors of a fused solution fit its covariance: NEES of nine states over simulated drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.consistency import nees, share_inside
from polyins.kernels import covariance
from polyins.navigate import batch
from polyins.navigate.sharing import square_of
from polyins.navigate.state import LOG_EVERY
from polyins.simulation.run import simulate_with_truth
from polyins.studies.beyond.drives import METHOD, of_some, scenario
from polyins.studies.consistency import STATES, navigation_errors

Array = NDArray[np.float64]


def consistency(name: str, count: int, seeds: range, quick: bool) -> dict[str, float]:
    """Return the mean NEES of nine states, the share of seconds inside the 95 % bounds, and the mean in outages."""
    errors, covariances = [], []
    within: Array = np.zeros(0)
    for seed in seeds:
        simulation = simulate_with_truth(scenario(name, quick), seed=seed)
        recording = of_some(simulation, count)
        run = batch.prepare(recording, METHOD)
        every, block = int(run.plan.settings[LOG_EVERY]), run.state.blocks[0]
        known = []
        for first in range(1, len(run.inputs.time) - every, every):
            run.advance(first, first + every)
            whole = block.copy()
            covariance.complete(whole, len(square_of(whole)))
            known.append(square_of(whole)[:STATES, :STATES].copy())
        rows = np.arange(1, len(known) + 1) * every
        time = run.inputs.time[rows]
        errors.append(navigation_errors(run.outputs.states[rows], simulation.path.truth(time)))
        covariances.append(np.array(known))
        within = np.any([(time > begin) & (time < end) for begin, end in recording.outages], axis=0)
    shortest = min(map(len, errors))
    average = nees(np.array([one[:shortest] for one in errors]), np.array([one[:shortest] for one in covariances]))
    return {
        "mean": float(average.mean()),
        "inside_percent": 100.0 * share_inside(average, len(seeds), STATES),
        "outages": float(average[within[:shortest]].mean()),
    }
