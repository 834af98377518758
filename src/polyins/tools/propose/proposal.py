"""A commented configuration proposed for recordings that nobody has described yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from polyins.config.yaml_document import Document, as_document
from polyins.errors import InputError
from polyins.files import find
from polyins.model.findings import Finding
from polyins.reading import loading
from polyins.reading.loading import Settings
from polyins.tools.propose.aiding import barometer_lines, heading_lines, odometer_lines
from polyins.tools.propose.imus import imu_lines
from polyins.tools.propose.lines import CHECK, Assumption, Line
from polyins.tools.propose.positions import track_lines
from polyins.tools.propose.sources import Roles, read_sources, roles
from polyins.tools.propose.start import start_lines


@dataclass(frozen=True)
class Proposal:
    """A configuration, line by line."""

    lines: tuple[Line, ...]

    @property
    def text(self) -> str:
        """The YAML; what was guessed, and what files cannot tell, is marked `CHECK:`."""
        return "\n".join(map(str, self.lines)) + "\n"

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """What is marked."""
        return tuple(dict.fromkeys(one for line in self.lines if (one := line.assumption) is not None))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The doubts that a run with it has."""
        return tuple(one.finding for one in self.assumptions if one.finding is not None)


def propose(paths: Sequence[str | Path]) -> Proposal:
    """Return a configuration for the recordings in these files.

    Raises InputError if no file holds IMU data that can be used.
    """
    read, left_out = read_sources(paths)
    of = roles(read)
    if not of.imus:
        found = "; ".join([*(f"{one.place}: {len(one.rows.time)} rows" for one in read), *left_out])
        raise InputError(
            f"{', '.join(str(path) for path in paths)}: no IMU data; expected at least one file of them"
            + (f" beside {found}" if found else "")
        )
    count = f"{len(of.imus)} IMU(s), {len(of.tracks)} stream(s) of positions"
    head = Line(f"# {count}. What says {CHECK[2:]} is guessed or unknown.")
    return Proposal((head, *(Line("", text) for text in left_out), *_sections(of)))


def _sections(of: Roles) -> list[Line]:
    first = of.imus[0]
    lines = [Line("imus:")]
    for number, imu in enumerate(of.imus, 1):
        lines += imu_lines(number, imu, of)
    if of.gnss is not None:
        lines += _section("gnss", track_lines("gnss", of.gnss, of))
    if of.reference is not None:
        lines += _section("reference", track_lines("reference", of.reference, of))
    lines += [Line("", f"{one.place} also holds positions and is not used") for one in of.unused]
    if of.heading is not None:
        lines += _section("heading", heading_lines(of.heading, first))
    if of.odometer is not None:
        lines += _section("odometer", odometer_lines(of.odometer, first))
    if of.height is not None and of.gnss is not None:
        lines += _section("height", barometer_lines(of.height, first))
    return lines + _section("start", start_lines(of))


def _section(name: str, lines: list[Line]) -> list[Line]:
    return [Line(""), Line(f"{name}:"), *lines]


def settings_of(paths: Sequence[Path]) -> Settings:
    """Return the settings that `propose` finds for data files; warnings and findings say what they assume."""
    proposal = propose([find(path).resolve() for path in paths])
    document = as_document(find(paths[0]), proposal.text)
    config, plain = loading.located(document), Document(document.path, document.values)
    return Settings(config, plain, tuple(one.sentence for one in proposal.assumptions), proposal.findings)


def check_proposal(proposal: Proposal, paths: Sequence[str | Path], out: Path | None) -> None:
    """Raise InputError if the configuration that is proposed would be refused.

    `out`: where it will be written, from whose folder its names count.
    """
    document = as_document((out or Path("proposed.yaml")).resolve(), proposal.text)
    try:
        loading.build(loading.located(document), document)
    except InputError as error:
        files = ", ".join(str(path) for path in paths)
        raise InputError(f"{files}: cannot be navigated with as they are: {error}") from error
