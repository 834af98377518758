"""All that the data of a recording say of themselves before a filter runs."""

from __future__ import annotations

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
    InputError as `delays` does.
    """
    rig, gnss = recording.rig, recording.gnss
    fixes = () if gnss is None else of_fixes(gnss, recording.geodetic, end)
    if rig.has_wheels:
        return (*of_turning(rig, aligned), *fixes)
    blocks = Blocks.of(aligned)
    return (*disagreements(rig, aligned), *noisy(rig, blocks), *delays(recording, blocks), *fixes)
