"""A recording of an array that pauses: each part is a run of its own, which begins with what is known of its IMUs.

After a pause of all IMUs the velocity is off by as much as the vehicle changed it, and nothing tells where it looks. A
covariance that says so would be too large for a filter that is linear in its errors. So the state is found anew; the
errors of the IMUs are kept, less sure by what they drift in that time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import ImuStream, Recording, StartOptions, usual_interval
from polyins.model.rig import Imu, ImuErrors
from polyins.model.solution import Solution
from polyins.prepare.timesync import gaps_of

Array = NDArray[np.float64]

HOPELESS = 10.0
"""s without data of any IMU, after which the state is found anew"""
LEAST = 5.0
"""s of data that a part has at least"""
AGED = 1.5
"""times the std of IMU errors after a pause"""

Run = Callable[[Recording], Solution]


def pauses(recording: Recording) -> list[tuple[float, float]]:
    """Return where no IMU has data for longer than `HOPELESS`: the last stamp before and the first after, s."""
    if recording.rig.has_wheels or not recording.imus:
        return []
    common = [(-np.inf, np.inf)]
    for stream in recording.imus:
        own = [gap for gap in gaps_of(stream.time, usual_interval(stream.time)) if gap[1] - gap[0] > HOPELESS]
        both = [(max(a, c), min(b, d)) for a, b in common for c, d in own]
        common = [(begin, end) for begin, end in both if end - begin > HOPELESS]
    return common


def run_parts(recording: Recording, run: Run) -> Solution:
    """Run a recording part by part between its pauses; a part that gives no start is left out, with a finding."""
    found = pauses(recording)
    borders = [*(begin for begin, _ in found), np.inf]
    solution = run(_part(recording, -np.inf, borders[0]))
    parts, findings = [solution], list(solution.findings)
    for (last, first), end in zip(found, borders[1:], strict=True):
        part = _after_pause(_part(recording, last, end), parts[-1])
        pause = f"no IMU has data for {first - last:.1f} s from {last:.2f} s"
        try:
            if min(stream.time[-1] - stream.time[0] for stream in part.imus if stream.time.size > 1) < LEAST:
                raise InputError(f"less than {LEAST:g} s of data")
            solution = run(part)
        except (InputError, ValueError) as error:
            text = f"{pause}; what follows is left out: {error}"
            findings.append(Finding("pause", text, from_s=last, to_s=first, size=first - last))
            continue
        begins = float(solution.time[0])
        text = f"{pause}; the state was found anew at {begins:.2f} s ({solution.start.get('heading', '')})"
        findings.append(Finding("restart", text, from_s=last, to_s=begins, size=first - last))
        findings += [one for one in solution.findings if one not in findings]
        parts.append(solution)
    whole = Solution.joined(parts)
    return replace(whole, start=parts[0].start, findings=tuple(findings), recording_span=_span(recording))


def _span(recording: Recording) -> tuple[float, float]:
    stamps = [stream.time[[0, -1]] for stream in recording.imus]
    return float(np.min(stamps)), float(np.max(stamps))


def _part(recording: Recording, after: float, until: float) -> Recording:
    """Return the recording with the IMUs' data after one time and up to another, s."""
    streams = []
    for stream in recording.imus:
        kept = slice(*np.searchsorted(stream.time, [after, until], "right"))
        streams.append(ImuStream(stream.name, stream.time[kept], stream.dtheta[kept], stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))


def _after_pause(recording: Recording, before: Solution) -> Recording:
    """Return a part that knows of its IMUs what the part before it found, and of its state nothing."""
    wanted = recording.start
    start = StartOptions(
        end_time=wanted.end_time, heading_from="reference" if wanted.heading_from == "reference" else "auto"
    )
    known = dict(zip(before.imu_names, range(len(before.imu_names)), strict=True))
    imus = [
        _with_errors(imu, before.imu_errors[-1, known[imu.name]], AGED * before.imu_error_std[-1, known[imu.name]])
        if imu.name in known and len(before.imu_errors)
        else imu
        for imu in recording.rig.imus
    ]
    return replace(recording, start=start, rig=replace(recording.rig, imus=tuple(imus)))


def _with_errors(imu: Imu, errors: Array, std: Array) -> Imu:
    def of(values: Array) -> ImuErrors:
        return ImuErrors(values[0:3], values[3:6], values[6:9], values[9:12])

    return replace(imu, initial_errors=of(errors), initial_std=of(np.minimum(std, imu.start_std())))
