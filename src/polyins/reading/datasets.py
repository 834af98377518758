"""Public data sets by name, and the recordings in them."""

from __future__ import annotations

from polyins.config.yaml_document import Document, write_yaml
from polyins.errors import InputError
from polyins.model.recording import Recording
from polyins.reading import catalogue
from polyins.reading.catalogue import fetch, names
from polyins.reading.loading import load_document
from polyins.reading.wid import configuration as wid_configuration

__all__ = ["configuration", "fetch", "info", "names", "wid"]


def info(name: str) -> dict[str, object]:
    """Return what is known of a data set: summary, licence, source, number of files, the folder if it is here.

    Of a recording of the data set WID, such as `wid/trial08`, in addition its IMUs and when it starts and ends, s.
    """
    name, _, trial = name.partition("/")
    return _recording_info(name, trial) if trial else catalogue.info(name)


def _recording_info(name: str, trial: str) -> dict[str, object]:
    known = catalogue.info(name)
    if name != "wid":
        raise InputError(f"data set {name}: has no recordings by name; expected {name} alone")
    values = wid_configuration(fetch(name), trial, gnss=False)
    folder = fetch(name) / f"trial{trial.removeprefix('trial')}"
    return known | {
        "name": f"{name}/{folder.name}",
        "files": sum(path.is_file() for path in folder.iterdir()),
        "folder": str(folder),
        "imus": [imu["name"] for imu in values["imus"]],
        "start_s": values["start"]["time_s"],
        "end_s": values["start"]["end_time_s"],
    }


def wid(trial: str, *, gnss: bool = False) -> Recording:
    """Return a trial of the data set WID, such as `trial08`, as dead reckoning or with GNSS, on a local plane.

    Raises InputError if the data set is not at hand or has no such trial.
    """
    folder = fetch("wid")
    return load_document(Document(folder / trial, wid_configuration(folder, trial, gnss)))


def configuration(name: str, *, gnss: bool = False) -> str:
    """Return polyins YAML for a recording of a data set, by a name such as `wid/trial08`.

    Raises InputError if the data set has no such recording, or none that it describes.
    """
    dataset, _, trial = name.partition("/")
    catalogue.find(dataset)
    if dataset != "wid" or not trial:
        raise InputError(f"{name!r}: is no recording with a configuration; expected wid/trial08 or another trial")
    return write_yaml(wid_configuration(fetch("wid"), trial, gnss))
