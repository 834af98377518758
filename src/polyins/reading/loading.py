"""From a configuration file to a `Recording`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins.checks import faults, stream_checks, wheel_checks
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.table import in_short
from polyins.checks.vouched import vouched
from polyins.config import Config, kf_gins_configuration, parse, wheel_ins_configuration
from polyins.config.units import read
from polyins.config.yaml_document import Document, read_yaml, write_yaml
from polyins.errors import InputError
from polyins.model.findings import Finding
from polyins.model.recording import FilterOptions, Heights, ImuStream, Recording
from polyins.model.rig import Imu, Rig
from polyins.reading import catalogue, clocks, usable
from polyins.reading.imu_stream import as_mounted, read_imu
from polyins.reading.position_stream import read_gnss, read_reference
from polyins.reading.sensor_stream import constraint_of, entries, read_sensors, sensors_of
from polyins.reading.timing import outage_intervals, start_options

NOT_IN_FORCE = {"dataset", "imu_defaults"}
"""keys that the others take in"""


@dataclass(frozen=True)
class Settings:
    """A configuration that was read, or was made for logs."""

    config: Config
    """file names in it are absolute"""
    document: Document
    """says where its keys stand"""
    warnings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


def load(path: str | Path) -> Recording:
    """Read the recording that a configuration describes: polyins YAML, or a KF-GINS or Wheel-INS file.

    They are told apart by content. Raises InputError, before anything is computed, for a configuration or data that
    cannot be right.
    """
    return load_settings(read_config(path))


def load_settings(settings: Settings) -> Recording:
    """Read the recording that a configuration describes which is read already; raises InputError as `load` does."""
    recording = build(settings.config, settings.document)
    warnings = (*settings.warnings, *recording.warnings)
    return replace(recording, warnings=warnings, findings=(*recording.findings, *settings.findings))


def read_config(path: str | Path) -> Settings:
    """Read a configuration file."""
    document = read_yaml(path)
    warnings: tuple[str, ...] = ()
    for program in (wheel_ins_configuration, kf_gins_configuration):
        if program.recognizes(document):
            values, warnings = program.translated(document)
            document = Document(document.path, values)
            break
    return Settings(located(document), document, warnings)


def names_of(settings: Sequence[Settings]) -> list[str]:
    """Return a name for each of several configurations: its own, after that of its folder where they share one.

    Raises InputError if two are still the same, or one cannot name a folder.
    """
    own = [one.config.name for one in settings]
    names: dict[str, Path] = {}
    for name, one in zip(own, settings, strict=True):
        document = one.document
        path = document.path.resolve()
        if Path(name).name != name:
            raise document.error(["name"], f"is {name!r}; expected what may be the name of a folder")
        longer = name if own.count(name) == 1 else f"{path.parent.name}/{name}"
        if longer in names:
            raise InputError(
                f"{path}: is named {longer!r} as is {names[longer]}; expected recordings that differ in name"
            )
        names[longer] = path
    return list(names)


def load_document(document: Document) -> Recording:
    """Read the recording that the values of a configuration describe; raises InputError as `load` does."""
    return build(located(document), document)


def located(document: Document) -> Config:
    """Return the configuration that a document holds, with absolute paths; raises InputError as `parse` does."""
    config = parse(document)
    with document.at(["dataset"]):
        folder = catalogue.fetch(config.dataset) if config.dataset else document.path.parent.resolve()
    return _with_absolute_paths(config, folder, document.path)


def build(config: Config, document: Document, mounts_known: bool = True) -> Recording:
    """Read and check the streams that a configuration names.

    `mounts_known`: check that wheels turn as declared and arrays stand upright; what calibrates them needs not know
    yet, and arrays are turned upside down for it.
    """
    evidence = gather(config, document, mounts_known)
    recording = evidence.recording
    if not mounts_known:
        return recording
    return replace(recording, findings=(*recording.findings, *in_short(evidence)))


def gather(config: Config, document: Document, mounts_known: bool = True) -> Evidence:
    """Read as `build` does what checks look at."""
    notes = wheel_checks.check_settings(config, document)
    alone, accept = len(config.imus) == 1, config.checks.accept
    found = [read_imu(entry, index, document, alone=alone) for index, entry in enumerate(config.imus)]
    alive, dead = faults.alive([one.stream for one in found])
    notes += one_by_kind([text for i in alive for text in found[i].check(accept)])
    measuring = [found[i] for i in alive]
    read_streams = [one.stream for one in measuring]
    with vouched(accept, notes):
        faults.check_distinct(read_streams)
    kept, fallen = list(range(len(measuring))), usable.NONE
    if mounts_known:
        kept, fallen = usable.upright([one.entry for one in measuring], alive, read_streams, document, accept)
    going = [measuring[i] for i in kept]
    imus = tuple(one.imu for one in going)
    known, config = config, config.model_copy(update={"imus": tuple(one.entry for one in going)})
    config, streams, offsets = clocks.on_one_clock(config, document, going)
    known = _with_clocks(known, config)
    kept, apart = usable.overlapping(config.imus, [(stream.time[0], stream.time[-1]) for stream in streams])
    config = config.model_copy(update={"imus": tuple(config.imus[i] for i in kept)})
    imus, streams = tuple(imus[i] for i in kept), tuple(streams[i] for i in kept)
    findings = (*dead, *fallen, *apart, *(finding for one in measuring for finding in one.findings))
    findings += tuple(clocks.described(one, float(streams[0].time[0])) for one in offsets)
    findings += tuple(finding for one in offsets for finding in clocks.leaps_of(one))
    spans = {stream.name: (stream.time[0], stream.time[-1]) for stream in streams}
    span = stream_checks.check_common_span(spans, wait=any(imu.wheel for imu in imus))
    recording = assemble(config, document, imus, streams, span, mounts_known)
    warnings = (*notes, *recording.warnings)
    text = in_force(known)
    recording = replace(recording, warnings=warnings, findings=findings, clock_offsets=offsets, config_text=text)
    each = (
        ImuEvidence(place, one.entry, one.imu, one.rows, one.stream)
        for place, one in zip(alive, measuring, strict=True)
    )
    return Evidence(config, document, tuple(each), recording)


def assemble(
    config: Config,
    document: Document,
    imus: tuple[Imu, ...],
    streams: tuple[ImuStream, ...],
    span: tuple[float, float],
    mounts_known: bool = True,
) -> Recording:
    """Read what a configuration names beside the IMUs, whose data cover `span`, and put all together."""
    notes: list[str] = []
    gnss = reference = geodetic = None
    heights: Heights = "ellipsoidal"
    if config.gnss:
        gnss, geodetic, heights, texts = read_gnss(config.gnss, document, span, config.checks.accept)
        notes += texts
    if mounts_known:
        notes += wheel_checks.check_motion(config, document, imus, streams, gnss, bool(geodetic))
    if config.reference:
        reference, kind, texts = read_reference(config.reference, document, span)
        geodetic = _one_kind(geodetic, kind, document.place(["reference"]))
        if gnss is None:
            heights = reference.heights
        elif (heights == "ellipsoidal") != (reference.heights == "ellipsoidal"):
            raise document.error(
                ["reference", "height"], "is as-given for one of gnss and reference; expected it for both, or neither"
            )
        notes += texts
    if config.start.position:
        geodetic = _one_kind(geodetic, config.start.position.geodetic, document.place(["start", "position"]))
    aiding, texts = read_sensors(config, document, span)
    notes += texts
    start, texts = start_options(config.start, document, span)
    return Recording(
        _rig(config, document, imus),
        streams,
        gnss,
        reference,
        geodetic=bool(geodetic),
        outages=outage_intervals(config, document, span, gnss),
        start=start,
        options=read(config.filter, FilterOptions, nonholonomic=constraint_of(config)),
        name=config.name,
        warnings=(*notes, *texts),
        aiding=aiding,
        heights=heights,
        utc_of_zero=clocks.utc_of_zero(config),
        accepted=config.checks.accept,
    )


def without_data(config: Config, document: Document) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording that has no streams yet: the rig, how to start, what the filter is told; and warnings.

    Positions are geodetic unless there is no GNSS or it is turned into metres, or the start's are on a local plane.
    Raises InputError for settings that need data beforehand.
    """
    notes = wheel_checks.check_settings(config, document)
    for keys in clocks.to_be_found(config.model_copy(update={"reference": None})):
        raise document.error(keys, "is found from a whole recording; expected clock_offset_s")
    if config.start.heading_from == "reference":
        raise document.error(
            ["start", "heading_from"], "is reference, which live data have not; expected heading_deg or gnss-course"
        )
    imus = []
    for index, entry in enumerate(config.imus):
        with document.at(["imus", index]):
            imus.append(as_mounted(entry))
    start, texts = start_options(config.start, document, clocks.ALWAYS)
    geodetic = config.gnss is not None and config.gnss.plane_origin is None
    if config.start.position:
        geodetic = config.start.position.geodetic
    rig = _rig(config, document, tuple(imus))
    options = read(config.filter, FilterOptions, nonholonomic=constraint_of(config))
    recording = Recording(rig, (), geodetic=geodetic, start=start, options=options, name=config.name)
    return recording, (*notes, *texts, *_not_live(config))


def _not_live(config: Config) -> list[str]:
    """Say what is configured and not looked at in live data."""
    keys = {
        "outages": bool(config.outages),
        "reference": config.reference is not None,
        "gnss.rate_hz": config.gnss is not None and config.gnss.rate_hz is not None,
        "imus[].rate_hz": any(imu.rate_hz is not None for imu in config.imus),
        "imus[].gyro_range_deg_s": any(imu.gyro_range_deg_s is not None for imu in config.imus),
        "start.end_time_s": config.start.end_time_s is not None,
    }
    return [f"{key}: is not looked at in live data" for key, given in keys.items() if given]


def _rig(config: Config, document: Document, imus: tuple[Imu, ...]) -> Rig:
    with document.at(["gnss", "antenna_position_m"]):
        antenna = np.array(config.gnss.antenna_position_m) if config.gnss else np.zeros(3)
        rig = Rig(imus, antenna, sensors_of(config, document))
    if config.odometer is not None and rig.has_wheels:
        raise document.error(
            ["odometer"], "is given, and an IMU on a wheel, which shows the speed as well; expected one"
        )
    return rig


def in_force(config: Config) -> str:
    """Return the configuration as YAML."""
    return write_yaml(config.model_dump(mode="json", exclude=NOT_IN_FORCE))


def _with_clocks(config: Config, found: Config) -> Config:
    """Return a configuration with what was found of the clocks; IMUs that are left out have none."""
    by_name = {entry.name: entry for entry in found.imus}
    imus = tuple(by_name.get(entry.name, entry.model_copy(update=entry.settled())) for entry in config.imus)
    return found.model_copy(update={"imus": imus})


def one_by_kind(notes: list[str]) -> list[str]:
    """Say only once what several files have in common, word for word but for their names."""
    places: dict[str, list[str]] = {}
    for note in notes:
        place, _, text = note.partition(": ")
        places.setdefault(text, []).append(place)
    return [
        f"{found[0]}{f' and {len(found) - 1} files more' if len(found) > 1 else ''}: {text}"
        for text, found in places.items()
    ]


def _one_kind(known: bool | None, new: bool, place: str) -> bool:
    """Return whether positions are geodetic; all must be of one kind."""
    if known is not None and known != new:
        kinds = {True: "latitude and longitude", False: "on a local plane"}
        raise InputError(f"{place}: positions are {kinds[new]}, those before {kinds[known]}; expected one kind")
    return new


def _with_absolute_paths(config: Config, folder: Path, path: Path) -> Config:
    def absolute(entry: Any) -> Any:
        if not entry or not entry.file:
            return entry
        return entry.model_copy(update={"file": within(entry.file)})

    def within(name: str) -> str:
        return str(folder / Path(name).expanduser())

    def whole(imu: Any) -> Any:
        """Return an IMU's entry whose accelerometer may have a file of its own."""
        if imu.columns is None or not imu.columns.accel.file:
            return absolute(imu)
        accel = imu.columns.accel.model_copy(update={"file": within(imu.columns.accel.file)})
        return absolute(imu).model_copy(update={"columns": imu.columns.model_copy(update={"accel": accel})})

    changes = {
        "name": config.name or path.stem,
        "imus": tuple(whole(imu) for imu in config.imus),
        "gnss": absolute(config.gnss),
        "reference": absolute(config.reference),
        **{kind: absolute(entry) for kind, entry in entries(config)},
    }
    return config.model_copy(update=changes)
