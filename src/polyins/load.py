"""From a configuration file to a `Recording`: streams read, checked, turned into array axes, put on one clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins import datasets
from polyins.config import (
    Config,
    GnssEntry,
    ImuEntry,
    InitialErrors,
    InitialStd,
    Noise,
    OutageSchedule,
    ReferenceEntry,
    Start,
    parse,
)
from polyins.errors import InputError
from polyins.io import checks, kf_gins, kf_gins_configuration, rtklib, table, xsens_dot
from polyins.io.recognize import imu_format, track_format
from polyins.io.rows import ImuRows, Track
from polyins.io.yaml_document import Document, read_yaml, write_yaml
from polyins.recording import Array, FilterOptions, GnssStream, ImuStream, Recording, Reference, StartOptions
from polyins.rig import DEG, PPM, Imu, ImuErrors, NoiseGrade, Rig

Span = tuple[float, float]


def load(path: str | Path) -> Recording:
    """Read the recording that a configuration describes: polyins YAML or a KF-GINS file, told apart by content.

    Raises InputError, before anything is computed, for a configuration or data that cannot be right.
    """
    config, document, warnings = read_config(path)
    recording = build(config, document)
    return replace(recording, warnings=(*warnings, *recording.warnings))


def read_config(path: str | Path) -> tuple[Config, Document, tuple[str, ...]]:
    """Read a configuration file; file names in it come out absolute.

    Returns the configuration, the document that says where its keys stand, and warnings.
    """
    document = read_yaml(path, first_of_duplicates=True)
    if kf_gins_configuration.recognizes(document):
        values, warnings = kf_gins_configuration.translated(document)
        document = document.translated(values)
    elif document.warnings:
        raise InputError(document.warnings[0].replace("; the first one counts", "; expected each key once"))
    else:
        warnings = ()
    config = parse(document)
    folder = datasets.fetch(config.dataset) if config.dataset else document.path.parent.resolve()
    return _with_absolute_paths(config, folder, document.path), document, warnings


def build(config: Config, document: Document) -> Recording:
    """Read and check the streams that a configuration names."""
    loaded = [_imu(entry, index, document) for index, entry in enumerate(config.imus)]
    imus = tuple(imu for imu, _, _ in loaded)
    streams = tuple(stream for _, stream, _ in loaded)
    warnings = [text for _, _, texts in loaded for text in texts]
    span = checks.check_common_span({s.name: (float(s.time[0]), float(s.time[-1])) for s in streams})

    gnss = geodetic = None
    if config.gnss:
        gnss, geodetic, texts = _gnss(config.gnss, document, span)
        warnings += texts
    reference = None
    if config.reference:
        reference, reference_geodetic, texts = _reference(config.reference, document, span)
        geodetic = _one_kind(geodetic, reference_geodetic, document.place(["reference"]))
        warnings += texts
    if config.start.position:
        geodetic = _one_kind(geodetic, config.start.position.geodetic, document.place(["start", "position"]))
    start, texts = _start(config.start, document, span)
    warnings += texts
    antenna = np.array(config.gnss.antenna_position_m) if config.gnss else np.zeros(3)
    with document.at(["gnss", "antenna_position_m"]):
        rig = Rig(imus, antenna)
    return Recording(
        rig,
        streams,
        gnss,
        reference,
        geodetic=bool(geodetic),
        outages=_outages(config, document, span, gnss),
        start=start,
        options=FilterOptions(
            gate_limit=config.filter.gate_limit,
            gate_reopen_after=config.filter.gate_reopen_after,
            gnss_snap=config.filter.gnss_snap_s,
            gravity=config.filter.gravity_m_s2,
        ),
        name=config.name,
        config_text=write_yaml(config.model_dump(mode="json", exclude={"dataset", "imu_defaults"})),
        warnings=tuple(warnings),
    )


