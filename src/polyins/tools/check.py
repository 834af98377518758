"""What is wrong with a recording, and a configuration in which it is right.

Checks are asked stage by stage. Where one finds what a configuration can put right, it is put right in memory and all
are asked again: of data in a wrong unit nothing else can be said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence
from polyins.checks.table import STAGES, judged
from polyins.config import Config
from polyins.config.checks import Checks, Judgement
from polyins.config.yaml_document import Document, Setting, as_document
from polyins.errors import ImplausibleError, InputError
from polyins.files import find, write_bytes
from polyins.model.findings import Finding, notes
from polyins.reading.loading import gather, located, read_config
from polyins.tools.propose.inputs import are_logs
from polyins.tools.propose.proposal import propose

MOST_ROUNDS = 12
NO_START = "start"
"""kind of the finding that a run finds none, which refuses the data"""
REFUSED = "refused"
"""kind of what no check names by another one"""


SEVERAL = ("rest", "pause", "data", "left out")
"""kinds of which there may be more than one"""


def _same(one: Finding, other: Finding) -> bool:
    return (one.kind, one.stream, one.axis) == (other.kind, other.stream, other.axis)


@dataclass
class Checked:
    """What was found."""

    document: Document | None
    """the configuration in which all is right that one can put right; None: there is none"""
    findings: list[Finding] = field(default_factory=list)
    settings: list[Setting] = field(default_factory=list)
    """that make it so"""
    refused: bool = False
    """whether a run would refuse the data as they are"""

    def new(self, finding: Finding) -> bool:
        """Whether what puts a finding right has not been set yet, or goes on to where it leads."""
        before = next((one for one in self.findings if _same(one, finding)), None)
        return before is None or (
            isinstance(finding.size, float) and isinstance(before.size, float) and abs(finding.size) < abs(before.size)
        )

    def add(self, found: Sequence[Finding]) -> None:
        """Take findings that are not there yet; of what a cause explains nothing is said again."""
        for one in found:
            alike = [known for known in self.findings if _same(one, known)]
            if not alike or (one.kind in SEVERAL and one not in alike):
                self.findings.append(one)

    def set(self, settings: Sequence[Setting]) -> None:
        """Take settings, each in the place of an earlier one for the same key."""
        keys = {one.keys for one in settings}
        self.settings = [*(one for one in self.settings if one.keys not in keys), *settings]

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            "findings": [one.document() for one in self.findings],
            "refused": self.refused,
            "settings": [{"key": one.key, "value": one.value} for one in self.settings],
        }


def check(inputs: Sequence[Path]) -> Checked:
    """Check a configuration, or the logs that one is proposed for; never raises for what `run` would refuse."""
    try:
        checked = _opened(inputs)
        assert checked.document is not None
        _check_all(checked)
    except InputError as refusal:
        return Checked(None, [Finding(REFUSED, str(refusal), "serious")], refused=True)
    return checked


def _opened(inputs: Sequence[Path]) -> Checked:
    if not are_logs(inputs):
        if len(inputs) > 1:
            raise InputError(f"{', '.join(map(str, inputs))}: are {len(inputs)} configurations; expected one")
        settings = read_config(inputs[0])
        return Checked(settings.document, list(notes(settings.warnings)))
    proposal = propose([find(path).resolve() for path in inputs])
    assumed = [one.finding or Finding("data", one.sentence) for one in proposal.assumptions]
    return Checked(as_document(find(inputs[0]), proposal.text), assumed)


def _check_all(checked: Checked) -> None:
    """Ask all checks, put right what can be, and ask again."""
    for number in range(MOST_ROUNDS):
        assert checked.document is not None
        evidence, refusals = _read(checked.document)
        found = [] if evidence is None else _asked(evidence)
        checked.refused |= (number == 0 and bool(refusals)) or any(one.finding.kind == NO_START for one in found)
        settings = [one for diagnosis in found if checked.new(diagnosis.finding) for one in diagnosis.settings]
        named = {one.finding.kind for one in found}
        checked.add([one.finding for one in found])
        if not settings:
            checked.add([one for one in refusals if one.kind not in named])
            if evidence is not None:
                checked.add([*evidence.recording.findings, *notes(evidence.recording.warnings)])
            return
        checked.set(settings)
        checked.document = checked.document.changed(settings)


def _read(document: Document) -> tuple[Evidence | None, list[Finding]]:
    """Read what a configuration names, whatever would be judged of it; returns what would be refused."""
    refusals: list[Finding] = []
    config, accepted = located(document), set[Judgement]()
    while True:
        try:
            evidence = gather(_accepting(config, accepted), document)
        except ImplausibleError as refusal:
            refusals.append(Finding(refusal.kind, str(refusal), "serious"))
            accepted.add(refusal.kind)  # type: ignore[arg-type]
        except InputError as refusal:
            return None, [*refusals, Finding(REFUSED, str(refusal), "serious")]
        else:
            return replace(evidence, config=config), refusals


def _accepting(config: Config, kinds: set[Judgement]) -> Config:
    return config.model_copy(update={"checks": Checks(accept=(*config.checks.accept, *sorted(kinds)))})


def _asked(evidence: Evidence) -> list[Diagnosis]:
    """Ask stage by stage up to the first in which something can be put right."""
    found: list[Diagnosis] = []
    for stage in STAGES:
        found += [one for each in stage for one in judged(each, evidence)]
        if any(one.settings for one in found):
            break
    return found


def write_fixed(checked: Checked, out: Path) -> None:
    """Write the configuration in which all is right that one can put right; raise InputError if there is none."""
    if checked.document is None:
        raise InputError(f"--fix {out}: {checked.findings[0].text}")
    if out.exists():
        raise InputError(f"--fix {out}: exists; expected the name of a new file")
    folder = checked.document.path.resolve().parent
    document = checked.document
    if out.resolve().parent != folder and "dataset" not in document.values:
        document = document.changed(_absolute(document.values, folder))
    write_bytes(out, document.text.encode())


def _absolute(values: dict[str, Any], folder: Path) -> list[Setting]:
    """Return the settings that name files from anywhere."""
    found = []
    for name, section in values.items():
        for index, one in enumerate(section) if isinstance(section, list) else [(None, section)]:
            if isinstance(one, dict) and isinstance(one.get("file"), str):
                keys = (name, "file") if index is None else (name, index, "file")
                found.append(Setting(keys, str(folder / Path(one["file"]).expanduser())))
    return found
