"""A commented configuration proposed for recordings that nobody has described yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks.stream_checks import Axes, upright_axes
from polyins.config import NOISE_GRADES
from polyins.config.yaml_document import Document, as_document
from polyins.errors import InputError
from polyins.files import find
from polyins.formats.columns import open_table
from polyins.formats.log import Log
from polyins.formats.recognize import data_format, log_format, read_log
from polyins.formats.rows import ImuRows, SensorRows, Track, intervals
from polyins.model.axes import axes_matrix, right_handed_axes
from polyins.model.findings import Finding
from polyins.model.recording import Recording, usual_interval
from polyins.model.rig import DEG, HOUR
from polyins.reading import loading
from polyins.reading.guess import read_stream, read_table
from polyins.reading.loading import Settings
from polyins.reading.long_recording import LongRecording
from polyins.reading.table_streams import DATUM, HalfImu, TableStream, described, joined
from polyins.tools.inspect import describe

CHECK = "# CHECK:"
TRACK_FORMATS = {"kf-gins-gnss": "kf-gins"}
GRADE = "consumer-mems"
FULL_SCALES_DEG_S = (125.0, 250.0, 300.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
NEAR_FULL_SCALE = 0.0025
FEWEST_AT_FULL_SCALE = 5
LEFT_OUT_THERE = "rows there are left out"
STILL_RAD_S = 0.1
FAST_RAD_S = 1.0
"""of the mean rate, above which the force tells what is down at rest only"""
FEWEST_SHAKEN = 100
"""rows that tell how much they shake"""
MEDIAN_TO_STD = 1.4826
HEADING_STD_DEG = 5.0
"""of the heading of another system, and of an offset of it: a compass on a vehicle"""
FORWARD_IS_A_GUESS = "forward is a guess"
GUESSED = ("scale is a guess", "unit is a guess")
LEAST_SIGMAS = 4.0
"""of what chance makes, by which a horizontal axis agrees with the acceleration of the speed if it is forward"""
FEWEST_MEANS = 20
"""of a second, to tell which axis points forward"""
HEADING_RATE_HZ = 1.0
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
    table: TableStream | None = None

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
    # A file with attitude is a reference rather than a receiver's, if there is a choice.
    tracks.sort(key=lambda one: isinstance(one.rows, Track) and one.rows.attitude is not None)
    only_solution = len(tracks) == 1 and not tracks[0].log and data_format(tracks[0].path) == "kf-gins-nav"
    sections = ["reference"] if only_solution else ["gnss", "reference"]
    for section, track in zip(sections, tracks, strict=False):
        lines += ["", f"{section}:", *_track_lines(section, track, span)]
    lines += [f"{CHECK} {one.place} also holds positions and is not used" for one in tracks[len(sections) :]]
    for heading in headings[:1]:
        lines += ["", "heading:", *_heading_lines(heading)]
    for speed in speeds[:1]:
        lines += ["", "odometer:", *_odometer_lines(speed)]
    lines += ["", "start:", _start_line(bool(tracks) and not only_solution, tracks, headings)]
    return "\n".join(lines) + "\n"


def are_logs(paths: Sequence[str | Path]) -> bool:
    """Whether the files are data rather than configurations; raises InputError for some of each."""
    kinds = [data_format(path) == "configuration" for path in paths]
    if any(kinds) and not all(kinds):
        raise InputError(f"{', '.join(map(str, paths))}: are configurations and data; expected one or the other")
    return not kinds[0]


def settings_of(paths: Sequence[Path]) -> Settings:
    """Return the settings that `propose` finds for data files; the warnings say what they assume."""
    text = propose([find(path).resolve() for path in paths])
    document = as_document(find(paths[0]), text)
    return loading.located(document), Document(document.path, document.values), tuple(assumptions(text))


def check_proposal(text: str, paths: Sequence[str | Path], out: Path | None) -> None:
    """Raise InputError if the configuration that is proposed would be refused.

    `out`: where it will be written, from whose folder its names count.
    """
    document = as_document((out or Path("proposed.yaml")).resolve(), text)
    try:
        loading.build(loading.located(document), document)
    except InputError as error:
        files = ", ".join(str(path) for path in paths)
        raise InputError(f"{files}: cannot be navigated with as they are: {error}") from error


def doubted(recording: Recording | LongRecording, assumed: Sequence[str]) -> Recording | LongRecording:
    """Return a recording with a doubt for each assumption that would turn the heading if it were wrong."""
    remedy = "give axes in a configuration (polyins init writes one)"
    guesses = tuple(
        Finding("mount", text, "doubt", remedy=remedy)
        for text in assumed
        if FORWARD_IS_A_GUESS in text or any(guess in text for guess in GUESSED)
    )
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
    halves: list[HalfImu] = []
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
            elif data_format(path) == "table":
                streams = read_table(path)
                if isinstance(streams, HalfImu):
                    halves.append(streams)
                else:
                    found += [LogSource(path, one.rows, one.guesses, table=one) for one in streams]
            else:
                found.append(LogSource(path, *read_stream(path)))
        except InputError as error:
            refused.append(error)
    found += _paired(halves, left_out)
    if refused and not found:
        raise refused[0]
    return found, [*left_out, *(f"not used: {error}" for error in refused)]


def _paired(halves: Sequence[HalfImu], left_out: list[str]) -> list[LogSource]:
    """Return the IMUs of files of a gyro and files of an accelerometer, in their order."""
    gyros, accels = ([half for half in halves if half.what == what] for what in ("gyro", "accel"))
    found = []
    for gyro, accel in zip(gyros, accels, strict=False):
        one = described(open_table(gyro.source.path), joined(gyro, accel), [])
        found.append(LogSource(gyro.source.path, one.rows, one.guesses, table=one))
    for half in (*gyros[len(accels) :], *accels[len(gyros) :]):
        left_out.append(f"{half.source.path}: holds the {half.what} of an IMU alone, and is not used")
    return found


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
    if number > 1 and imu.log is None and imu.path != first.path:
        lines.append(f"    clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s")
    full = full_scale(imu.rows)
    if full is not None:
        lines.append(f"    gyro_range_deg_s: {full:.6g}  {CHECK} where the values of the gyro end, so {LEFT_OUT_THERE}")
    return [
        *lines,
        *_axes_lines(imu, facts, speeds),
        f"    position_m: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m",
        _noise_line(imu.rows),
    ]


def full_scale(rows: ImuRows) -> float | None:
    """Return the full scale of a gyro, deg/s, whose largest value is one that is usual and often there; else None."""
    if rows.gyro_range_deg_s is not None or len(rows.time) < FEWEST_SHAKEN:
        return None
    rates = np.abs(rows.dtheta / intervals(rows.time)[:, None]) / DEG
    largest = float(np.nanmax(rates))
    usual = any(abs(largest / scale - 1.0) < NEAR_FULL_SCALE for scale in FULL_SCALES_DEG_S)
    return largest if usual and int((rates > largest * (1.0 - 1e-6)).sum()) >= FEWEST_AT_FULL_SCALE else None


def resting_force(rows: ImuRows) -> np.ndarray | None:
    """Return the mean specific force, m/s^2, of the rows that hardly turn, if the others turn fast; else None."""
    steps = intervals(rows.time)[:, None]
    rate = np.linalg.norm(rows.dtheta / steps, axis=1)
    still = rate < STILL_RAD_S
    if not still.sum() >= FEWEST_SHAKEN or float(np.nanmean(rate)) < FAST_RAD_S:
        return None
    force: np.ndarray = np.asarray(np.nanmean((rows.dvel / steps)[still], axis=0))
    return force


def _noise_line(rows: ImuRows) -> str:
    """Return a grade, or where the rows shake more than that the random walks that this makes."""
    angle, velocity = shaking(rows)
    usual = NOISE_GRADES[GRADE]
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
        return ["    axes: [x, y, z]  # forward, right, down, as the format has them"]
    force = np.array(facts["accel_mean_m_s2"] or [0.0, 0.0, -9.8], dtype=float)
    if isinstance(imu.rows, ImuRows) and (still := resting_force(imu.rows)) is not None:
        force = still
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


def _place_lines(of: LogSource) -> list[str]:
    return [f"  file: {_quoted(of.path)}", f"  stream: {_quoted(of.stream)}"]


def _odometer_lines(of: LogSource) -> list[str]:
    return [
        *_place_lines(of),
        f"  std_m_s: 0.1  {CHECK} slip is what makes a wheel's speed wrong, not what the log states",
        f"  scale_std: 0.05  {CHECK} of a constant part of its error",
        f"  position_m: [0, 0, 0]  {CHECK} between the wheels: forward, right, down from the array's origin, m",
    ]


def _format_lines(of: LogSource, indent: str) -> list[str]:
    if of.log is not None:
        return [f"{indent}stream: {_quoted(of.stream)}"]
    kind = data_format(of.path)
    lines = [f"{indent}format: {TRACK_FORMATS.get(kind, kind)}"]
    if of.table is None or of.table.columns is None:
        return lines
    lines.append(f"{indent}columns:  {CHECK} {'; '.join(['names and units', *of.table.checks])}")
    written = of.table.columns.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    for group, content in written.items():
        lines.append(f"{indent}  {group}: {_flow(content)}")
    return lines


def _track_lines(section: str, of: LogSource, span: tuple[float, float]) -> list[str]:
    track = of.rows
    assert isinstance(track, Track)
    facts = describe(track)
    lines = [
        f"  file: {_quoted(of.path)}",
        *_format_lines(of, "  "),
        f"  # {facts['rows']} rows, {facts['begin_s']:.3f} to {facts['end_s']:.3f} s, {facts['rate_hz'] or 0.0:.2f} Hz",
        _clock_line(of, span),
    ]
    antenna = of.log.antenna if of.log else None
    if section == "gnss" and antenna is not None:
        lines.append(f"  antenna_position_m: {_flow(list(antenna))}  {CHECK} as the log's parameters say")
    else:
        point = "antenna_position_m" if section == "gnss" else "point_m"
        lines.append(f"  {point}: [0, 0, 0]  {CHECK} forward, right, down from the array's origin, m")
    if section == "gnss" and track.position_std is None:
        lines.append(f"  position_std_m: [1.5, 1.5, 3.0]  {CHECK} north, east, down; the file has none")
    unknown = [check for check in of.table.checks if check.startswith(DATUM)] if of.table else []
    lines += [
        f"  height: as-given  {CHECK} {text}; sea-level with geoid_height_m, or ellipsoidal, say which"
        for text in unknown
    ]
    if track.above_sea:
        lines.append(f"  height: as-given  {CHECK} above the sea; sea-level with geoid_height_m makes them ellipsoidal")
    return lines


def _clock_line(of: LogSource, span: tuple[float, float]) -> str:
    time = of.rows.time
    if of.log is not None and of.log.fix_age is not None:
        return f"  clock_offset_s: {-of.log.fix_age:g}  {CHECK} how old fixes are when they are stamped, by the log"
    if time[-1] < span[0] or time[0] > span[1]:
        return (
            f"  clock_offset_s: 0.0  {CHECK} the IMUs' stamps run from {span[0]:.3f} to {span[1]:.3f} s; give what "
            "brings these to the same clock"
        )
    return f"  clock_offset_s: 0.0  {CHECK} added to the stamps, to bring them to the clock of imu1, s"


def _heading_lines(of: LogSource) -> list[str]:
    return [
        *_place_lines(of),
        f"  std_deg: {HEADING_STD_DEG:g}  {CHECK} the log does not tell how good this heading is",
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
