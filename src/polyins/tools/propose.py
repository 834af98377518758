"""A commented configuration proposed for recordings that nobody has described yet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks.stream_checks import Axes, upright_axes
from polyins.config import NOISE_GRADES
from polyins.config.yaml_document import Document, as_document
from polyins.errors import InputError
from polyins.files import find
from polyins.formats import geoid, rtklib, table
from polyins.formats.log import Log
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track, intervals
from polyins.model.axes import axes_matrix, composed, right_handed_axes
from polyins.model.findings import Finding
from polyins.model.recording import Recording, usual_interval
from polyins.model.rig import DEG, HOUR
from polyins.reading import loading
from polyins.reading.guess import guess_columns, read_stream
from polyins.reading.loading import Settings
from polyins.reading.long_recording import LongRecording
from polyins.tools.inspect import describe

CHECK = "# CHECK:"
TRACK_FORMATS = {"kf-gins-gnss": "kf-gins"}
GRADE = "consumer-mems"
SENSOR_AXES: Axes = ("x", "y", "z")
FEWEST_SHAKEN = 100
"""rows that tell how much they shake"""
MEDIAN_TO_STD = 1.4826
SLOWEST_RAD_S = 0.1
"""less than that hardly turns: biases of cheap gyros are as large"""
STANDING_M_S = 0.1
"""less than that a reference says of what stands"""
HEADING_STD_DEG = 5.0
"""of the heading of another system, and of an offset of it: a compass on a vehicle"""
BY_UTC = "by what both files say of UTC; an autopilot knows it to a tenth of a second; time_offset: estimate finds more"
FORWARD_IS_A_GUESS = "forward is a guess"
LEAST_SIGMAS = 4.0
"""of what chance makes, by which a horizontal axis agrees with the acceleration of the speed if it is forward"""
FEWEST_MEANS = 20
"""of a second, to tell which axis points forward"""
BAROMETER_STD_M, BAROMETER_BIAS_M, WEATHER_M_SQRT_S = 1.0, 300.0, 0.1
"""noise of a barometer on a vehicle; 35 hPa; 6 m in an hour"""
BAROMETER_RATE_HZ = HEADING_RATE_HZ = 1.0
"""errors of another filter last; taken at its own rate they would be averaged away"""


@dataclass(frozen=True)
class LogSource:
    """One stream, and where it is."""

    path: str | Path
    rows: ImuRows | Track | SensorRows
    notes: tuple[str, ...] = ()
    stream: str = ""
    """its name, in a log"""
    log: Log | None = None

    @property
    def utc_of_zero(self) -> float | None:
        """Unix time at which its stamps are zero, s, where its file tells it; a log gets fixes when they are old."""
        if self.log is None:
            return rtklib.utc_of_zero(self.path) or table.utc_of_zero(self.path)
        return None if self.log.utc_of_zero is None else self.log.utc_of_zero + (self.log.fix_age or 0.0)

    @property
    def place(self) -> str:
        """Its file, and its name in it."""
        return f"{self.path}, {self.stream}" if self.stream else str(self.path)


def propose(paths: Sequence[str | Path]) -> str:
    """Return polyins YAML for the recordings in these files.

    What was guessed, and what files cannot tell, is marked `CHECK:`. Raises InputError if no file holds IMU data that
    can be used.
    """
    read, left_out = _sources(paths)
    imus = [one for one in read if isinstance(one.rows, ImuRows)]
    tracks = [one for one in read if isinstance(one.rows, Track)]
    headings, speeds = _sensors(read, "heading"), _sensors(read, "odometer")
    if not imus:
        found = "; ".join([*(f"{one.place}: {len(one.rows.time)} rows" for one in read), *left_out])
        raise InputError(
            f"{', '.join(str(path) for path in paths)}: no IMU data; expected at least one file of them"
            + (f" beside {found}" if found else "")
        )
    marked = f"What says {CHECK[2:]} is guessed or unknown."
    lines = [f"# {len(imus)} IMU(s), {len(tracks)} stream(s) of positions. {marked}", *_comments(left_out)]
    lines.append("imus:")
    for number, imu in enumerate(imus, 1):
        lines += _imu_lines(number, imu, imus[0], speeds)
    span = (max(one.rows.time[0] for one in imus), min(one.rows.time[-1] for one in imus))
    # Another system's solution comes last, one with attitude is a reference rather than a receiver's, if there is a
    # choice, and positions computed afterwards are better than the log's.
    tracks.sort(
        key=lambda one: (
            _is_estimate(one),
            isinstance(one.rows, Track) and one.rows.attitude is not None,
            one.log is not None,
        )
    )
    only_solution = bool(tracks) and _is_estimate(tracks[0])
    if len(tracks) > 2 and _is_estimate(tracks[-1]) and not _is_estimate(tracks[1]):
        tracks.insert(1, tracks.pop())
    sections = ["reference"] if only_solution else ["gnss", "reference"]
    if len(tracks) > 1 and _is_receiver(tracks[1]):
        sections = sections[:1]
    for section, track in zip(sections, tracks, strict=False):
        lines += ["", f"{section}:", *_track_lines(section, track, imus[0], span)]
    lines += [f"{CHECK} {one.place} also holds positions and is not used" for one in tracks[len(sections) :]]
    for heading in headings[:1]:
        lines += ["", "heading:", *_heading_lines(heading, imus[0])]
    for speed in speeds[:1]:
        lines += ["", "odometer:", *_odometer_lines(speed, imus[0])]
    for height in _sensors(read, "height")[:1] if "gnss" in sections[: len(tracks)] else []:
        lines += ["", "height:", *_barometer_lines(height, imus[0])]
    same_log = only_solution and tracks[0].log is not None and tracks[0].log is imus[0].log
    given = _given_start(tracks[0], span) if same_log and not headings else []
    lines += ["", "start:", *(given or [_start_line(bool(tracks) and not only_solution, tracks, headings)])]
    return "\n".join(lines) + "\n"


def are_logs(paths: Sequence[str | Path]) -> bool:
    """Whether the files are data rather than configurations; raises InputError for some of each."""
    kinds, refused = [], []
    for path in paths:
        try:
            kinds.append(data_format(path) == "configuration")
        except InputError as error:
            refused.append(error)
    if not kinds or (refused and any(kinds)):
        raise refused[0]
    if any(kinds) and not all(kinds):
        raise InputError(f"{', '.join(map(str, paths))}: are configurations and data; expected one or the other")
    return not kinds[0]


@contextmanager
def way_named(paths: Sequence[str | Path]) -> Iterator[None]:
    """Say of what logs lack for a start how to give it, for they have no keys."""
    try:
        yield
    except InputError as error:
        if not str(error).startswith("start:") or not are_logs(paths):
            raise
        raise InputError(
            f"{error}: polyins init {' '.join(map(str, paths))} --out run.yaml writes a configuration that takes it; "
            "motion with fixes, a second antenna or another system's attitude would tell it as well"
        ) from None


def settings_of(paths: Sequence[Path]) -> Settings:
    """Return the settings that `propose` finds for data files; the warnings say what they assume."""
    text = propose([find(path).resolve() for path in paths])
    document = as_document(find(paths[0]), text)
    return loading.located(document), Document(document.path, document.values), tuple(assumptions(text))


def doubted(recording: Recording | LongRecording, assumed: Sequence[str]) -> Recording | LongRecording:
    """Return a recording with a doubt for each assumption that would turn the heading if it were wrong."""
    remedy = "give axes in a configuration (polyins init writes one)"
    guesses = tuple(Finding("mount", text, "doubt", remedy=remedy) for text in assumed if FORWARD_IS_A_GUESS in text)
    if isinstance(recording, LongRecording):
        head = recording.head
        return replace(recording, head=replace(head, findings=(*head.findings, *guesses)))
    return replace(recording, findings=(*recording.findings, *guesses))


def assumptions(proposal: str) -> list[str]:
    """Return what a proposal marks as guessed or unknown, as sentences."""
    found = []
    for line in proposal.splitlines():
        value, mark, reason = (part.strip() for part in line.partition(CHECK))
        if mark:
            found.append(f"assumed {value} ({reason})" if value else reason)
    return list(dict.fromkeys(found))


def _sources(paths: Sequence[str | Path]) -> tuple[list[LogSource], list[str]]:
    """Return the streams that can be used, and why others are not; raises InputError if no file is readable."""
    found: list[LogSource] = []
    left_out: list[str] = []
    refused: list[InputError] = []
    for path in paths:
        try:
            if log_format(path) is not None:
                log = read_log(path)
                found += [
                    LogSource(path, rows, (), name, log)
                    for name, rows in log.streams.items()
                    if name not in log.unusable
                ]
                left_out += [f"{path}: {name} is not used: {why}" for name, why in log.unusable.items()]
                left_out += [f"{path}: {note}" for note in log.notes]
            else:
                found.append(LogSource(path, *read_stream(path)))
        except InputError as error:
            refused.append(error)
    if refused and not found:
        raise refused[0]
    return found, [*left_out, *(f"not used: {error}" for error in refused)]


def _is_estimate(of: LogSource) -> bool:
    """Whether positions are another system's solution by their format: no measurements."""
    if of.log is not None:
        return of.stream in of.log.references
    return data_format(of.path) == "kf-gins-nav"


def _is_receiver(of: LogSource) -> bool:
    """Whether positions are those of a log's receiver, which judge nothing."""
    return of.log is not None and not _is_estimate(of) and isinstance(of.rows, Track) and of.rows.attitude is None


def _comments(texts: Sequence[str]) -> list[str]:
    """Return what is not used as comments."""
    return [f"{CHECK} {text}" for text in texts]


def _start_line(gnss: bool, tracks: list[LogSource], headings: list[LogSource]) -> str:
    """Return where the heading comes from: of what a start needs, the one thing that data at rest do not tell."""
    if headings:
        return f"  heading_from: auto  {CHECK} that of {headings[0].stream}; else heading_deg"
    if gnss:
        return f"  heading_from: auto  {CHECK} the course over ground; is it the heading? else heading_deg or reference"
    if any(isinstance(one.rows, Track) and one.rows.attitude is not None for one in tracks):
        return f"  heading_from: auto  {CHECK} that of the reference"
    return f"  heading_deg: 0.0  {CHECK} clockwise from north; no file tells it"


def _given_start(of: LogSource, span: tuple[float, float]) -> list[str]:
    """Return the state that a log's reference has when the IMUs begin: without other aids nothing tells it better."""
    track = of.rows
    assert isinstance(track, Track)
    if track.velocity is None or track.attitude is None or track.time[-1] < span[0]:
        return []
    row = int(np.searchsorted(track.time, span[0]))
    roll, pitch, heading = (float(angle) for angle in np.round(track.attitude[row] / DEG, 6))
    velocity = [float(value) for value in np.round(track.velocity[row], 6)]
    return [
        f"  time_s: {float(track.time[row])!r}  {CHECK} the state is that of the reference",
        f"  velocity_m_s: {_flow(velocity)}",
        f"  roll_pitch_deg: {_flow([roll, pitch])}",
        f"  heading_deg: {heading}",
        *(["  estimate_gyro_bias: false  # it moves"] if np.linalg.norm(velocity) > STANDING_M_S else []),
    ]


def _sensors(read: Sequence[LogSource], kind: str) -> list[LogSource]:
    return [one for one in read if isinstance(one.rows, SensorRows) and one.rows.kind == kind]


def _imu_lines(number: int, imu: LogSource, first: LogSource, speeds: list[LogSource]) -> list[str]:
    assert isinstance(imu.rows, ImuRows)
    facts = describe(imu.rows)
    lines = [f"  - name: imu{number}", f"    file: {_quoted(imu.path)}", *_format_lines(imu, "    ")]
    lines.append(f"    # {facts['rows']} rows, {facts['duration_s']:.1f} s at {facts['rate_hz'] or 0.0:.2f} Hz")
    if facts["repeated_stamps"] and facts["duration_s"] > 0.0:
        rate = (facts["rows"] - 1) / facts["duration_s"]
        repeated = facts["repeated_stamps"]
        lines.append(f"    rate_hz: {rate:.6g}  {CHECK} {repeated} stamp(s) repeat, so rows are counted")
    shift = _shift(imu, first)
    if shift:
        lines.append(f"    clock_offset_s: {shift!r}  {CHECK} {BY_UTC}")
    elif number > 1 and imu.log is None:
        lines.append(f"    clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s")
    return [
        *lines,
        *_axes_lines(imu, facts, speeds),
        _point_line("    position_m", imu),
        _noise_line(imu.rows, imu.log.noise.get(imu.stream) if imu.log else None),
    ]


def _noise_line(rows: ImuRows, stated: tuple[float, float] | None = None) -> str:
    """Return a grade, or where the rows shake more than that, or than the log states, the random walks of this."""
    angle, velocity = shaking(rows)
    usual = NOISE_GRADES[GRADE]
    if stated is not None:
        angle, velocity = max(angle, stated[0]) / DEG * np.sqrt(HOUR), max(velocity, stated[1]) * np.sqrt(HOUR)
        given = f"angle_random_walk_deg_sqrt_h: {angle:.3g}, velocity_random_walk_m_s_sqrt_h: {velocity:.3g}"
        return f"    noise: {{grade: {GRADE}, {given}}}  {CHECK} what the log states, or shakes from row to row if more"
    grades = f"a grade ({', '.join(NOISE_GRADES)}) or figures"
    walks = {
        "angle_random_walk_deg_sqrt_h": angle / DEG * np.sqrt(HOUR),
        "velocity_random_walk_m_s_sqrt_h": velocity * np.sqrt(HOUR),
    }
    if not any(walk > usual[key] for key, walk in walks.items()):
        return f"    noise: {GRADE}  {CHECK} {grades}"
    given = ", ".join(f"{key}: {max(walk, usual[key]):.3g}" for key, walk in walks.items())
    return f"    noise: {{grade: {GRADE}, {given}}}  {CHECK} {grades}; what shakes from row to row is taken for noise"


def shaking(rows: ImuRows) -> tuple[float, float]:
    """Return the random walks, rad/sqrt(s) and m/s/sqrt(s), that vibration makes, of the worst axis.

    What changes from row to row is taken for white: of second differences a steady motion is no part, and their
    variance is six times that of what is white. Their median size is not moved by shocks.
    """
    if len(rows.time) < FEWEST_SHAKEN:
        return 0.0, 0.0
    step = usual_interval(rows.time)
    sizes = []
    for increments in (rows.dtheta, rows.dvel):
        changes = np.abs(np.diff(increments, 2, axis=0))
        white = float(np.nanmedian(changes, axis=0).max()) * MEDIAN_TO_STD / np.sqrt(6.0)
        sizes.append(white / np.sqrt(step) if step > 0.0 else 0.0)
    return sizes[0], sizes[1]


def _axes_lines(imu: LogSource, facts: dict[str, Any], speeds: list[LogSource]) -> list[str]:
    if imu.log is not None and imu.log.upright:
        own = imu.log.axes.get(imu.stream, SENSOR_AXES)
        return [f"    axes: [{', '.join(own)}]  # forward, right, down, as the format has them"]
    if imu.log is not None and (imu.log.axes or imu.stream in imu.log.points):
        axes = composed(_shared_axes(imu.log), imu.log.axes.get(imu.stream, SENSOR_AXES))
        return [
            f"    axes: [{', '.join(axes)}]  {CHECK} as the log has them to each other, turned upright; "
            f"{FORWARD_IS_A_GUESS}",
            f"    mount_deg: [0, 0, 0]  {CHECK} roll, pitch, yaw that the axes are off by, deg",
        ]
    force = np.array(facts["accel_mean_m_s2"] or [0.0, 0.0, -9.8], dtype=float)
    axes = upright_axes(("x", "y", "z"), force)
    mean = ", ".join(f"{value:.1f}" for value in force)
    forward = FORWARD_IS_A_GUESS
    if speeds and isinstance(imu.rows, ImuRows) and isinstance(speeds[0].rows, SensorRows):
        axes, correlation, sigmas = forward_axes(axes, imu.rows, speeds[0].rows)
        if sigmas > LEAST_SIGMAS:
            forward = f"forward feels what {speeds[0].stream} accelerates, correlation {correlation:.2f}"
    return [
        f"    # at rest or on average the sensor feels [{mean}] m/s^2, so down is known",
        f"    axes: [{', '.join(axes)}]  {CHECK} sensor axes that point forward, right, down; {forward}",
        f"    mount_deg: [0, 0, 0]  {CHECK} roll, pitch, yaw that the axes are off by, deg",
    ]


def _shared_axes(log: Log) -> Axes:
    """Return which of the axes that a log's IMUs share point forward, right, down, by their force while they rest."""
    forces = [axes_matrix(log.axes.get(name, SENSOR_AXES)) @ _force_at_rest(rows) for name, rows in log.imus.items()]
    force = np.mean(forces, axis=0)
    return SENSOR_AXES if log.upright or not force.any() else upright_axes(SENSOR_AXES, force)


def _force_at_rest(rows: ImuRows) -> np.ndarray:
    """Return the mean specific force, shape (3,), of the rows that hardly turn; of all if these are few."""
    steps = intervals(rows.time)
    resting = np.linalg.norm(rows.dtheta, axis=1) < SLOWEST_RAD_S * steps
    chosen = resting if resting.sum() >= FEWEST_SHAKEN else steps > 0.0
    return np.asarray(rows.dvel[chosen].sum(axis=0) / max(float(steps[chosen].sum()), 1e-9))


def _point_line(key: str, of: LogSource) -> str:
    """Return where a sensor is, as the log says, or that nobody knows."""
    if of.log is not None and of.stream in of.log.points:
        point = axes_matrix(_shared_axes(of.log)) @ np.array(of.log.points[of.stream])
        return f"{key}: {_flow([round(float(value), 6) + 0.0 for value in point])}  {CHECK} as the log says"
    return f"{key}: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m"


def forward_axes(axes: Axes, rows: ImuRows, speed: SensorRows) -> tuple[Axes, float, float]:
    """Return the axes of the same down whose forward force goes best with the acceleration of the speed.

    Returns their correlation as well, and how many times it is what chance makes of so many means. Both are means over
    a second, in which tilt and vibration count little.
    """
    ends = np.arange(max(rows.time[0], speed.time[0]) + 1.0, min(rows.time[-1], speed.time[-1]), 1.0)
    if len(ends) < FEWEST_MEANS:
        return axes, 0.0, 0.0
    gained = np.diff(np.interp(ends, speed.time, speed.value))
    sums = np.column_stack([np.interp(ends, rows.time, total) for total in np.nancumsum(rows.dvel, axis=0).T])
    felt = np.diff(sums, axis=0)
    felt = felt - felt.mean(axis=0)
    gained = gained - gained.mean()
    size = np.linalg.norm(felt, axis=0) * np.linalg.norm(gained)
    agreement = (felt * gained[:, None]).sum(axis=0) / np.where(size > 0.0, size, np.inf)
    candidates = [one for one in right_handed_axes() if one[2] == axes[2]]
    best = max(candidates, key=lambda one: float(axes_matrix(one)[0] @ agreement))
    correlation = float(axes_matrix(best)[0] @ agreement)
    return best, correlation, correlation * float(np.sqrt(len(gained)))


def _place_lines(of: LogSource, first: LogSource) -> list[str]:
    shift = _shift(of, first)
    clock = [f"  clock_offset_s: {shift!r}  {CHECK} {BY_UTC}"] if shift else []
    return [f"  file: {_quoted(of.path)}", f"  stream: {_quoted(of.stream)}", *clock]


def _shift(of: LogSource, first: LogSource) -> float | None:
    """Return what brings stamps to the clock of the first IMU, s, or None where files do not tell."""
    if of.log is first.log and of.log is not None:
        return 0.0
    zero, base = of.utc_of_zero, first.utc_of_zero
    return None if zero is None or base is None else round(zero - base, 6)


def _odometer_lines(of: LogSource, first: LogSource) -> list[str]:
    return [
        *_place_lines(of, first),
        f"  std_m_s: 0.1  {CHECK} slip is what makes a wheel's speed wrong, not what the log states",
        f"  scale_std: 0.05  {CHECK} of a constant part of its error",
        f"  position_m: [0, 0, 0]  {CHECK} between the wheels: forward, right, down from the array's origin, m",
    ]


def _barometer_lines(of: LogSource, first: LogSource) -> list[str]:
    assert isinstance(of.rows, SensorRows)
    std = f"  std_m: {BAROMETER_STD_M:g}  {CHECK} wind and rotors press on it as well"
    return [
        *_place_lines(of, first),
        std,
        f"  bias_std_m: {BAROMETER_BIAS_M:g}  {CHECK} by which the weather is off the standard atmosphere, and the sea",
        f"  bias_random_walk_m_sqrt_s: {WEATHER_M_SQRT_S:g}  {CHECK} how fast the weather changes",
        f"  rate_hz: {BAROMETER_RATE_HZ:g}  # its errors last",
        f"  position_m: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m",
    ]


def _format_lines(of: LogSource, indent: str) -> list[str]:
    if of.log is not None:
        return [f"{indent}stream: {_quoted(of.stream)}"]
    kind = data_format(of.path)
    lines = [f"{indent}format: {TRACK_FORMATS.get(kind, kind)}"]
    if kind != "table" or not of.notes:
        return lines
    columns, _ = guess_columns(of.path)
    lines.append(f"{indent}columns:  {CHECK} names and units")
    for group, content in columns.model_dump(mode="json", exclude_none=True).items():
        lines.append(f"{indent}  {group}: {_flow(content)}")
    return lines


def _track_lines(section: str, of: LogSource, first: LogSource, span: tuple[float, float]) -> list[str]:
    track = of.rows
    assert isinstance(track, Track)
    facts = describe(track)
    lines = [
        f"  file: {_quoted(of.path)}",
        *_format_lines(of, "  "),
        f"  # {facts['rows']} rows, {facts['begin_s']:.3f} to {facts['end_s']:.3f} s, {facts['rate_hz'] or 0.0:.2f} Hz",
        _clock_line(of, first, span),
    ]
    antenna = of.log.antenna if of.log else None
    if section == "gnss" and antenna is not None:
        lines.append(f"  antenna_position_m: {_flow(list(antenna))}  {CHECK} as the log's parameters say")
    else:
        lines.append(_point_line("  antenna_position_m" if section == "gnss" else "  point_m", of))
    if section == "gnss" and track.position_std is None:
        lines.append(f"  position_std_m: [1.5, 1.5, 3.0]  {CHECK} north, east, down; the file has none")
    if not track.datum_known:
        lines.append(f"  height: ellipsoidal  {CHECK} the log does not tell what heights are above; else sea-level")
    if track.above_sea:
        lines.append(_height_line())
    return lines


def _height_line() -> str:
    if geoid.library() is not None:
        return f"  height: sea-level  {CHECK} above the sea; {geoid.MODEL} or geoid_height_m makes them ellipsoidal"
    return (
        f"  height: as-given  {CHECK} above the sea; sea-level with geoid_height_m, or a grid of it (pip install "
        "'polyins[geoid]'), makes them ellipsoidal"
    )


def _clock_line(of: LogSource, first: LogSource, span: tuple[float, float]) -> str:
    time, shift = of.rows.time, _shift(of, first)
    if shift:
        age = of.log.fix_age or 0.0 if of.log else 0.0
        return f"  clock_offset_s: {round(shift - age, 6)!r}  {CHECK} {BY_UTC}"
    if of.log is not None and of.log.fix_age is not None:
        return f"  clock_offset_s: {-of.log.fix_age:g}  {CHECK} how old fixes are when they are stamped, by the log"
    if time[-1] < span[0] or time[0] > span[1]:
        return (
            f"  clock_offset_s: 0.0  {CHECK} the IMUs' stamps run from {span[0]:.3f} to {span[1]:.3f} s; give what "
            "brings these to the same clock"
        )
    return f"  clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s"


def _heading_lines(of: LogSource, first: LogSource) -> list[str]:
    assert isinstance(of.rows, SensorRows)
    told = of.rows.std is not None
    how = "or leave it out, to take what the log tells" if told else "the log does not tell how good this heading is"
    return [
        *_place_lines(of, first),
        f"  std_deg: {HEADING_STD_DEG:g}  {CHECK} {how}",
        f"  offset_std_deg: {HEADING_STD_DEG:g}  {CHECK} of a constant part of its error",
        f"  rate_hz: {HEADING_RATE_HZ:g}  # its errors last",
    ]


def _quoted(text: object) -> str:
    return "'" + str(text).replace("'", "''") + "'"


def _flow(value: Any) -> str:
    """Write plain values as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    return _quoted(value) if isinstance(value, str) else str(value)
