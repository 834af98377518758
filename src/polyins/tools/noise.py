"""The noise figures of what files hold: read, told, written."""

from __future__ import annotations

from pathlib import Path

from polyins.calibration.array_gain import ArrayGain, array_gain
from polyins.calibration.imu_noise import ImuNoise, imu_noise
from polyins.calibration.noise_findings import findings as findings_of
from polyins.calibration.noise_listing import NoiseFigures, configuration, document
from polyins.errors import InputError
from polyins.files import write_bytes
from polyins.formats.documents import write_document
from polyins.model.findings import LEFT_OUT, Finding
from polyins.model.recording import ImuStream
from polyins.reading.clocks import on_one_clock
from polyins.reading.imu_stream import ReadImu, read_imu
from polyins.reading.loading import Settings


def read_streams(settings: Settings) -> tuple[tuple[ImuStream, ...], tuple[Finding, ...]]:
    """Return the IMUs of a configuration in the axes of the array, and what is left out of them.

    Raises InputError as `load` does; unlike that it needs neither a start nor IMUs that measure together.
    """
    config, alone = settings.config, len(settings.config.imus) == 1
    read = [read_imu(entry, index, settings.document, alone=alone) for index, entry in enumerate(config.imus)]
    streams, unclocked = _on_one_clock(settings, read)
    found = (*settings.findings, *(finding for one in read for finding in one.findings))
    said = {finding.sentence for finding in found}
    warnings = [*settings.warnings, *(text for one in read for text in one.check())]
    notes = (Finding("data", text) for text in dict.fromkeys(warnings) if text not in said)
    return streams, (*notes, *found, *unclocked)


def _on_one_clock(settings: Settings, read: list[ReadImu]) -> tuple[tuple[ImuStream, ...], tuple[Finding, ...]]:
    """Estimate offsets of clocks where they are asked for; what rests throughout does not tell them."""
    streams = tuple(one.stream for one in read)
    if not any(entry.time_offset for entry in settings.config.imus):
        return streams, ()
    try:
        return on_one_clock(settings.config, settings.document, read).streams, ()
    except InputError as error:
        text = f"clocks are taken as they are, so that what IMUs have in common is not seen: {error}"
        return streams, (Finding("clock", text),)


def noise_figures(streams: tuple[ImuStream, ...], known: tuple[Finding, ...] = ()) -> NoiseFigures:
    """Return the noise of IMUs, and of their mean where several rest together.

    An IMU that has no rest is named by a finding, after those that are `known` of the data. Raises InputError if none
    has.
    """
    told: list[ImuNoise] = []
    refused: list[InputError] = []
    for stream in streams:
        try:
            told.append(imu_noise(stream))
        except InputError as error:
            refused.append(error)
    if not told:
        # rates in a wrong unit shake too much, or hardly
        guessed = [finding.sentence for finding in known if finding.kind == "units"]
        raise InputError("; ".join([str(refused[0]), *guessed]))
    findings = [Finding(LEFT_OUT, str(error), "serious") for error in refused]
    names = {one.rest.name for one in told}
    array, lacking = _of_array(tuple(one for one in streams if one.name in names))
    of_imus = (finding for one in told for finding in findings_of(one))
    return NoiseFigures(tuple(told), array, (*known, *findings, *lacking, *of_imus))


def _of_array(streams: tuple[ImuStream, ...]) -> tuple[ArrayGain | None, tuple[Finding, ...]]:
    if len(streams) < 2:
        return None, ()
    try:
        return array_gain(streams), ()
    except InputError as error:
        return None, (Finding("noise", f"what the array gains is not told: {error}"),)


def write_noise(folder: Path, name: str, figures: NoiseFigures) -> None:
    """Write the document, the lines of a configuration and the page into a folder that is there."""
    from polyins.report.noise_page import write_page

    write_document(folder / "allan.json", document(figures))
    write_bytes(folder / "noise.yaml", configuration(figures).encode())
    write_page(folder / "allan.html", name, figures)
