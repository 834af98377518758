"""From a configuration file to a `Recording`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polyins import datasets
from polyins.config import Config, parse
from polyins.errors import InputError
from polyins.io import checks, kf_gins_configuration
from polyins.io.imu_stream import read_imu
from polyins.io.position_stream import read_gnss, read_reference
from polyins.io.timing import outage_intervals, start_options
from polyins.io.yaml_document import Document, read_yaml, write_yaml
from polyins.recording import FilterOptions, Recording
from polyins.rig import Rig


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
    document = read_yaml(path)
    warnings: tuple[str, ...] = ()
    if kf_gins_configuration.recognizes(document):
        values, warnings = kf_gins_configuration.translated(document)
        document = Document(document.path, values)
    config = parse(document)
    with document.at(["dataset"]):
        folder = datasets.fetch(config.dataset) if config.dataset else document.path.parent.resolve()
    return _with_absolute_paths(config, folder, document.path), document, warnings


def build(config: Config, document: Document) -> Recording:
    """Read and check the streams that a configuration names."""
    read = [read_imu(entry, index, document) for index, entry in enumerate(config.imus)]
    imus, streams, warnings = zip(*read, strict=True)
    notes = [text for texts in warnings for text in texts]
    span = checks.check_common_span({stream.name: (stream.time[0], stream.time[-1]) for stream in streams})
    gnss = reference = geodetic = None
    if config.gnss:
        gnss, geodetic, texts = read_gnss(config.gnss, document, span)
        notes += texts
    if config.reference:
        reference, kind, texts = read_reference(config.reference, document, span)
        geodetic = _one_kind(geodetic, kind, document.place(["reference"]))
        notes += texts
    if config.start.position:
        geodetic = _one_kind(geodetic, config.start.position.geodetic, document.place(["start", "position"]))
    start, texts = start_options(config.start, document, span)
    with document.at(["gnss", "antenna_position_m"]):
        rig = Rig(imus, np.array(config.gnss.antenna_position_m) if config.gnss else np.zeros(3))
    return Recording(
        rig,
        streams,
        gnss,
        reference,
        geodetic=bool(geodetic),
        outages=outage_intervals(config, document, span, gnss),
        start=start,
        options=_filter_options(config),
        name=config.name,
        config_text=write_yaml(config.model_dump(mode="json", exclude={"dataset", "imu_defaults"})),
        warnings=(*notes, *texts),
    )


def _filter_options(config: Config) -> FilterOptions:
    return FilterOptions(
        gate_limit=config.filter.gate_limit,
        gate_reopen_after=config.filter.gate_reopen_after,
        gnss_snap=config.filter.gnss_snap_s,
        gravity=config.filter.gravity_m_s2,
    )


def _one_kind(known: bool | None, new: bool, place: str) -> bool:
    """Return whether positions are geodetic; all must be of one kind."""
    if known is not None and known != new:
        kinds = {True: "latitude and longitude", False: "on a local plane"}
        raise InputError(f"{place}: positions are {kinds[new]}, those before {kinds[known]}; expected one kind")
    return new


def _with_absolute_paths(config: Config, folder: Path, path: Path) -> Config:
    def absolute(entry: Any) -> Any:
        return entry and entry.model_copy(update={"file": str(folder / Path(entry.file).expanduser())})

    changes = {
        "name": config.name or path.stem,
        "imus": tuple(absolute(imu) for imu in config.imus),
        "gnss": absolute(config.gnss),
        "reference": absolute(config.reference),
    }
    return config.model_copy(update=changes)
