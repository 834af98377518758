"""All that the data of a recording say of themselves before a filter runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from polyins.model.findings import Finding
from polyins.model.recording import Recording
from polyins.prepare.blocks import Blocks
from polyins.prepare.delays import delays
from polyins.prepare.fixes import of_fixes
from polyins.prepare.noise import noisy
from polyins.prepare.timesync import Aligned
from polyins.prepare.turning import of_turning
from polyins.prepare.votes import disagreements


def of_data(recording: Recording, aligned: Aligned, end: float) -> tuple[Finding, ...]:
    """Return which IMUs disagree or are noisy, which clocks disagree, and what is wrong with the fixes.

    `aligned`: the IMUs of the recording, or the beginning of what they measured; `end`: of all of it, s. Raises
    InputError as `delays` does. Kinds that the user vouches for are notes.
    """
    found = _found(recording, aligned, end)
    return tuple(replace(one, severity="note") if one.kind in recording.accepted else one for one in found)


def _found(recording: Recording, aligned: Aligned, end: float) -> Iterator[Finding]:
    rig, gnss = recording.rig, recording.gnss
    if rig.has_wheels:
        yield from of_turning(rig, aligned)
    else:
        blocks = Blocks.of(aligned)
        yield from disagreements(rig, aligned)
        yield from noisy(rig, blocks)
        yield from delays(recording, blocks)
    if gnss is not None:
        yield from of_fixes(gnss, recording.geodetic, end)
