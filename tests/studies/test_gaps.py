"""What the table of gaps says of a short one, in a batch and live."""

from __future__ import annotations

import numpy as np

from polyins.navigate import batch
from polyins.simulation.run import simulate
from polyins.studies.robustness.gap_faults import paused
from polyins.studies.robustness.gaps import AT, CARRIERS, live, scenario, track


def test_the_states_of_a_live_run_are_those_of_the_batch_run_where_it_has_them() -> None:
    carrier = next(one for one in CARRIERS if one.name == "wheels")
    whole = simulate(scenario(carrier, 2.0), seed=2)
    assert whole.imus[0].time[-1] > AT + 60.0
    recording = paused(whole, AT, 2.0)
    batched = batch.run(recording, carrier.method)
    for resumed in (None, AT + 2.0):
        played = live(recording, batched, resumed)
        known = np.searchsorted(batched.time, played.time)
        np.testing.assert_array_equal(played.position, batched.position[known])
        assert (played.time > AT + 2.0).sum() > 50
    assert track(batched, whole).over.max() < 4.0
