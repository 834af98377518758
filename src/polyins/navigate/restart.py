"""What pauses: each part between two pauses is a run of its own, which begins with what is known of its IMUs.

While no IMU has data the velocity goes off by as much as the vehicle changes it, and nothing tells where it looks. A
covariance that says so would be too large for a filter that is linear in its errors. So the state is found anew; the
errors of the IMUs are kept, less sure by what they drift in that time. On wheels without GNSS nothing tells place and
heading again. What the vehicle may have driven and turned moves and turns all that follows as a whole, which dead
reckoning does not see: speed, constraints and gravity are the same in every place and under every heading. So the
filter goes on as sure as it is of that, and what the pause left unknown, `alignment.Datum`, is added to what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.findings import Finding, Severity
from polyins.model.geodesy import displacement, metres_per_unit
from polyins.model.recording import Recording, StartOptions
from polyins.model.rig import DEG, Imu, ImuErrors
from polyins.model.solution import Solution
from polyins.navigate.bridging import ACCELERATION, TURN_RATE
from polyins.prepare.alignment import Datum, Start

Array = NDArray[np.float64]
Part = TypeVar("Part")
NO_DATA, BROKEN, HOPELESS_STATE = "no IMU has data", "the state is no number", "resets of the position do not help"
SETTLED = 1.0
"""s after a state that is no number or is given up, which the run before it has seen"""


class Pause(NamedTuple):
    """A time without a state."""

    begin: float
    """s, the last stamp before it"""
    end: float
    """s, the first that may be taken after it"""
    why: str = NO_DATA


HOPELESS, HOPELESS_ON_WHEELS = 1.0, 0.6
"""s without data of any IMU, after which the state is found anew: of an array; of wheels, which coast. What a vehicle
may turn in that time, see `bridging`, is as much as a filter that is linear takes."""
STRAIGHT = 3.0
"""s for which a vehicle is taken to have gone on as it went; after that it may look anywhere"""
AGED = 1.5
"""times the std of IMU errors after a pause"""
USUAL_SPEED = 10.0
"""m/s, at least, that a vehicle may drive in a pause"""
CLIMBED = 0.1
"""of the way: height that a vehicle gains or loses on it"""
SMALL_TURN = 5.0
"""deg: more is ten times what a heading by dead reckoning is usually sure to"""
UNKNOWN = "unknown: that before the pause"
COASTED = "that before the pause"
ANY_HEADING = np.pi / np.sqrt(3.0)
"""rad: std of a heading of which nothing is known"""
SURE_POSITION, SURE_HEADING = 0.01, 0.1 * DEG
"""m, rad: std with which dead reckoning goes on from where it is taken to be"""


@dataclass(frozen=True)
class Known:
    """What a run knows at its last epoch."""

    time: float
    """s"""
    position: Array
    """see `model.recording`"""
    velocity: Array
    """m/s north, east, down"""
    heading: float
    """rad"""
    position_std: Array
    """m"""
    heading_std: float
    """rad"""
    imu_errors: dict[str, tuple[Array, Array]]
    """of each IMU by its name, and their std, (12,) each"""
    ended: str = ""
    """why the run ended there though its data went on"""


def hopeless(on_wheels: bool) -> float:
    """Return how long no IMU may have data before the state is found anew, s."""
    return HOPELESS_ON_WHEELS if on_wheels else HOPELESS


def pauses(recording: Recording) -> list[Pause]:
    """Return where no IMU has data for hopelessly long: the last stamp before and the first after, s."""
    limit = hopeless(recording.rig.has_wheels)
    gaps = []
    for stream in recording.imus:
        edges = np.concatenate([[-np.inf], stream.time, [np.inf]])
        gaps.append([(edges[k], edges[k + 1]) for k in np.flatnonzero(np.diff(edges) > limit)])
    return common_pauses(gaps, limit)


def common_pauses(gaps: Iterable[Iterable[tuple[float, float]]], limit: float) -> list[Pause]:
    """Return where all IMUs have a gap longer than a limit, s, within what they measure; `gaps` of each IMU."""
    common = [(-np.inf, np.inf)]
    for known in map(list, gaps):
        both = [(max(a, begin), min(b, end)) for a, b in common for begin, end in known]
        common = [(begin, end) for begin, end in both if end - begin > limit]
    return [Pause(float(begin), float(end)) for begin, end in common if np.isfinite(end - begin)]


def parts_of(recording: Recording, found: Sequence[Pause]) -> Iterator[tuple[Pause | None, Recording]]:
    """Give the parts of a recording between its pauses, each with the one before it."""
    for pause, begin, end in borders(found):
        yield pause, part_of(recording, begin, end, pause)


def rest_of(part: Recording, pause: Pause) -> Recording:
    """Return what is left of a part after a state that is no number or was given up."""
    return part_of(part, np.nextafter(pause.end, -np.inf), np.inf, pause)


def borders(found: Sequence[Pause]) -> list[tuple[Pause | None, float, float]]:
    """Return the pause before each part, the time after which its data begin, and that up to which they go, s."""
    lasts = [-np.inf, *(pause.begin for pause in found), np.inf]
    return [(found[k - 1] if k else None, begin, end) for k, (begin, end) in enumerate(pairwise(lasts))]


def run_parts(
    parts: Iterable[tuple[Pause | None, Part]],
    run: Callable[[Part, Known | None, Pause | None], Iterator[tuple[Solution, Known]]],
    rest: Callable[[Part, Pause], Part],
) -> Iterator[Solution]:
    """Run a recording part by part between its pauses; a part that gives no start is left out, with a finding.

    `parts`: each with the pause before it. `run` takes a part, what the run before it knew, and the pause, and gives
    the solution stretch by stretch, with what is known at its end. What is told of the whole, the last solution tells.
    Raises InputError if no part gives a start.
    """
    before: Known | None = None
    held: Solution | None = None
    told: tuple[Finding, ...] = ()
    first: dict[str, object] = {}
    refusal: InputError | None = None
    ahead = iter(parts)
    following = next(ahead, None)
    while following is not None:
        pause, part = following
        begun = False
        ended: Known | None = None
        try:
            for solution, knowing in run(part, before, pause):
                if held is not None:
                    yield held
                if not begun and pause is not None:
                    told = (*told, restarted(pause, solution.start))
                begun, ended, first = True, knowing if knowing.ended else None, first or solution.start
                found = (*told, *(one for one in solution.findings if one not in told))
                held = replace(solution, start=first, findings=found)
        except InputError as error:
            if begun:
                raise
            refusal = refusal or error
            told = told if pause is None else (*told, left_out(pause, str(error)))
        else:
            told, before = told if held is None else held.findings, knowing
        if ended is not None:
            pause = Pause(ended.time, ended.time + SETTLED, ended.ended)
            following = pause, rest(part, pause)
        else:
            following = next(ahead, None)
    if held is None:
        assert refusal is not None
        raise refusal
    yield replace(held, findings=told)


def left_out(pause: Pause, why: str) -> Finding:
    """Say that what follows a pause gives no start."""
    text = f"{_words(pause)}; what follows is left out: {why}"
    severity: Severity = "note" if pause.why == NO_DATA else "serious"
    return Finding("pause", text, severity, from_s=pause[0], to_s=pause[1], size=pause[1] - pause[0])


def restarted(pause: Pause, start: Mapping[str, object]) -> Finding:
    """Say that the state was found anew after a pause; `start`: its time and where it came from, as of a solution."""
    heading, begins = start.get("heading"), cast(float, start["time_s"])
    text = f"{_words(pause)}; the state was found anew at {begins:.2f} s (heading: {heading})"
    size = pause[1] - pause[0]
    if heading != UNKNOWN:
        level: Severity = "note" if pause.why == NO_DATA else "doubt"
        return Finding("restart", text, level, from_s=pause[0], to_s=begins, size=size)
    remedy = "GNSS tells place and heading again; start.time_s begins a run of its own after the pause"
    return Finding("restart", text, "serious", from_s=pause[0], to_s=begins, size=size, remedy=remedy)


def coasted(gaps: list[Pause]) -> tuple[Finding, ...]:
    """Say that a vehicle without GNSS coasted, s to s, whose blocks take each other's common error for news."""
    found = []
    for gap in gaps:
        turned = np.degrees(TURN_RATE * (gap[1] - gap[0]))
        text = f"{_words(gap)}; the vehicle may have turned by {turned:.0f} deg (1 sigma), which the std do not hold"
        severity: Severity = "serious" if turned > SMALL_TURN else "doubt"
        remedy = "a method of one block, as body-ins, or /centralized holds it; GNSS tells it"
        found.append(Finding("pause", text, severity, from_s=gap[0], to_s=gap[1], size=turned, remedy=remedy))
    return tuple(found)


def _words(pause: Pause) -> str:
    if pause.why != NO_DATA:
        return f"{pause.why} after {pause.begin:.2f} s"
    return f"no IMU has data for {pause[1] - pause[0]:.1f} s from {pause[0]:.2f} s"


def is_lost(recording: Recording) -> bool:
    """Whether nothing in a recording tells place and heading after a pause."""
    return recording.rig.has_wheels and recording.gnss is None and recording.start.heading_from != "reference"


def begun(part: Recording, before: Known | None, pause: Pause | None) -> Recording:
    """Return a part with what is known before the pause; raise InputError if it lacks what a start is made from."""
    if pause is None:
        return part
    lacking = [stream.name for stream in part.imus if stream.time.size < 2]
    if lacking and (part.rig.has_wheels or len(lacking) == len(part.imus)):
        raise InputError(f"no data from {lacking[0]}")
    if part.gnss is not None and not part.gnss.time.size:
        raise InputError("no fix from GNSS")
    return after(part, before, is_lost(part))


def after(recording: Recording, before: Known | None, lost: bool) -> Recording:
    """Return a part that knows of its IMUs what the part before it found; of its state what a pause leaves of it.

    `lost`: whether the old place and heading stand. Of a start that is given for a time of its own all stands.
    """
    wanted = recording.start
    if before is None and wanted.time is not None:
        return recording
    start = StartOptions(end_time=wanted.end_time, goes_on=before is not None)
    if wanted.heading_from == "reference":
        start = replace(start, heading_from="reference")
    if before is None:
        return replace(recording, start=start)
    if lost:
        shown = any(sensor.kind == "heading" for sensor in recording.rig.sensors)
        start = replace(start, position=before.position, heading=None if shown else before.heading)
    imus = [
        _with_errors(imu, *before.imu_errors[imu.name]) if imu.name in before.imu_errors else imu
        for imu in recording.rig.imus
    ]
    return replace(recording, start=start, rig=replace(recording.rig, imus=tuple(imus)))


def as_lost(start: Start, before: Known, geodetic: bool) -> Start:
    """Return a start where the vehicle may be, and the datum as unsure as one that drove and turned since."""
    length, speed = start.time - before.time, float(np.linalg.norm(before.velocity))
    told = start.sources["heading"] != "given"
    turned = 0.0 if told else min(float(np.hypot(before.heading_std, TURN_RATE * length)), ANY_HEADING)
    if length <= STRAIGHT and not before.ended:
        moved = before.velocity * length / metres_per_unit(before.position, geodetic)
        off = 0.5 * length**2 * np.hypot(ACCELERATION, speed * TURN_RATE) + before.heading_std * speed * length
        heading = COASTED
    else:
        moved, off = np.zeros(3), max(USUAL_SPEED, speed) * length
        heading, turned = UNKNOWN, 0.0 if told else ANY_HEADING
    driven = np.hypot(before.position_std, np.array([1.0, 1.0, CLIMBED]) * off)
    return replace(
        start,
        position=start.position + moved,
        position_std=np.full(3, SURE_POSITION),
        attitude_std=start.attitude_std if told else np.array([*start.attitude_std[:2], SURE_HEADING]),
        sources={**start.sources, "position": "that before the pause", **({} if told else {"heading": heading})},
        datum=Datum(driven, turned),
    )


def with_datum(states: Array, variances: Array, start: Start, geodetic: bool) -> Array:
    """Return the variances of states, (T, 12), with what is unknown of the datum.

    `states`: position and velocity come first in them. A heading that is off by psi moves what is r away from the start
    by psi times r, across.
    """
    datum = start.datum
    if datum is None:
        return variances
    square = datum.heading_std**2
    way = displacement(states[:, :3], start.position, geodetic)
    found = variances.copy()
    found[:, 0:3] += datum.position_std**2
    found[:, 0:2] += square * way[:, 1::-1] ** 2
    found[:, 3:5] += square * states[:, 4:2:-1] ** 2
    found[:, 11] += square
    return found


def part_of(recording: Recording, begin: float, end: float, pause: Pause | None) -> Recording:
    """Return the recording with the data after one time and up to another, s; `pause`: that before it."""
    streams = [one.at(slice(*np.searchsorted(one.time, [begin, end], "right"))) for one in recording.imus]
    gnss = recording.gnss
    if gnss is not None and pause is not None:
        gnss = gnss.at(gnss.time >= pause.end)
    return replace(recording, imus=tuple(streams), gnss=gnss)


def _with_errors(imu: Imu, errors: Array, std: Array) -> Imu:
    """Return an IMU whose errors are known, less sure than they were."""

    def of(values: Array) -> ImuErrors:
        return ImuErrors(values[0:3], values[3:6], values[6:9], values[9:12])

    return replace(imu, initial_errors=of(errors), initial_std=of(np.minimum(AGED * std, imu.start_std())))
