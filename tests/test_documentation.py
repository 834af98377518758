"""The documentation says what is so: its commands and scripts run, its links lead somewhere, its tables are complete.

An HTML comment before a fenced block says how to treat it:

    polyins: file NAME       save the block under that name, for the commands after it
    polyins: scenario NAME   the same, of a scenario
    polyins: help, WHY       check command and options only
    polyins: needs DATASET   skip without that data set

`python tests/test_documentation.py` writes the tables of keys in docs/reference.md anew.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import click
import numpy as np
import pytest
from described_keys import descriptions
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

import polyins as pi
from polyins import cli, config
from polyins.config import columns
from polyins.config.yaml_document import read_yaml
from polyins.model.recording import GnssStream, ImuStream, Reference
from polyins.simulation import error_scenario, flexible_scenario, scenario
from polyins.simulation.drive_scenario import Drive, ReplayedDrive
from polyins.simulation.wheel_scenario import Laps, Slip, SurveyedTrack, WheelModule

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = [REPOSITORY / "README.md", REPOSITORY / "CHANGELOG.md", *sorted((REPOSITORY / "docs").glob("*.md"))]
REFERENCE = REPOSITORY / "docs" / "reference.md"


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: Path
    line: int
    language: str
    text: str
    mark: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def name(self) -> str | None:
        """The file to save it as."""
        found = re.match(r"(?:file|scenario) (\S+)", self.mark)
        return found[1] if found else None

    @property
    def dataset(self) -> str | None:
        found = re.match(r"needs (\S+)", self.mark)
        return found[1] if found else None

    @property
    def commands(self) -> list[list[str]]:
        """Those of polyins, as lists of words."""
        return [shlex.split(line, comments=True) for line in self.text.splitlines() if line.startswith("polyins ")]


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    pattern = re.compile(
        r"(?:<!-- polyins: (?P<mark>[^>]*?) -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```$", re.M | re.S
    )
    return [
        Block(page, text.count("\n", 0, m.start()) + 1, m["language"], m["text"], m["mark"] or "")
        for m in pattern.finditer(text)
    ]


ALL = [block for page in PAGES for block in blocks(page)]


# --- what is written runs ---------------------------------------------------------------------------------------------


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the examples and the recording that README and how-to speak of, as the current one."""
    (tmp_path / "examples").symlink_to(REPOSITORY / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_recording(folder: Path) -> None:
    """Write two IMUs (x forward, y left, z up; deg/s and m/s^2), GNSS and truth as CSV."""
    described = scenario.Scenario(
        duration_s=150, static_s=20, rate_hz=100, imus=scenario.Board(count=2, columns=2, pitch_m=0.1), outages=()
    )
    recording = pi.simulate(described)
    for name, stream in zip(("left", "right"), recording.imus, strict=True):
        _write_imu(folder / f"{name}.csv", stream, FORWARD_LEFT_UP)
    _write_positions(folder / "gnss.csv", recording.gnss)
    _write_positions(folder / "truth.csv", recording.reference)


WHEEL_RADIUS_M, BODY_CLOCK_S = 0.097, 3.2
FORWARD_LEFT_UP = np.diag([1.0, -1.0, -1.0])
"""C_sa: from the axes of array or module to those of the sensor"""
OUTWARD = {"left": np.fliplr(np.diag([1.0, 1.0, -1.0])), "right": np.roll(np.eye(3), 1, axis=1)}
"""the same for an IMU on a wheel whose z axis points outward"""


def write_robot(folder: Path) -> None:
    """Write an IMU on each wheel of a robot, one on its body, whose clock is ahead, GNSS and truth as CSV."""
    wheels = tuple(
        WheelModule(name=name, position_m=(0.0, right, 0.0), radius_m=WHEEL_RADIUS_M, chips=1)
        for name, right in (("left", -0.165), ("right", 0.165))
    )
    described = scenario.Scenario(
        duration_s=200,
        static_s=20,
        rate_hz=100,
        drive=Drive(top_speed_m_s=1.8),
        imus=scenario.Board(count=1, position_m=(0.1, 0.0, -0.15)),
        wheels=wheels,
        outages=(),
    )
    recording = pi.simulate(described)
    for stream in recording.imus:
        name = stream.name.rstrip("1")
        late = BODY_CLOCK_S if name == "body" else 0.0
        _write_imu(folder / f"{name}-imu.csv", stream, OUTWARD.get(name, FORWARD_LEFT_UP), late)
    _write_positions(folder / "antenna.csv", recording.gnss)
    _write_positions(folder / "track.csv", recording.reference)


def _write_imu(path: Path, stream: ImuStream, axes: np.ndarray[Any, Any], late: float = 0.0) -> None:
    step = np.diff(stream.time, prepend=0.0)[:, None]
    values = np.hstack([np.degrees(stream.dtheta / step) @ axes.T, stream.dvel / step @ axes.T])
    _write_csv(path, "t,gx,gy,gz,ax,ay,az", np.column_stack([stream.time + late, values]))


def _write_positions(path: Path, track: GnssStream | Reference | None) -> None:
    assert track is not None
    degrees = track.position * [180.0 / np.pi, 180.0 / np.pi, 1.0]
    _write_csv(path, "t,lat,lon,height", np.column_stack([track.time, degrees]))


def _write_csv(path: Path, header: str, values: np.ndarray[Any, Any]) -> None:
    np.savetxt(path, values, delimiter=",", header=header, comments="", fmt="%.12g")


def follow(page: Path, folder: Path) -> list[str]:
    """Do what a page says, in order; returns what was left out for want of data."""
    left_out = []
    for block in blocks(page):
        if block.name:
            (folder / block.name).write_text(block.text, encoding="utf-8")
        elif block.dataset and not _at_hand(block.dataset):
            left_out.append(f"{block}: {block.dataset}")
        elif block.language == "python":
            exec(compile(block.text, str(block), "exec"), {"__name__": "__main__"})
        elif block.language in ("sh", "console"):
            for words in block.commands:
                run(words[1:], block)
    return left_out


def _at_hand(dataset: str) -> bool:
    root = os.environ.get("POLYINS_DATA")
    return bool(root) and (Path(root or "") / dataset).is_dir()


def run(words: list[str], block: Block) -> None:
    """Run a command as the shell would, in this process; `>` sends its output to a file."""
    words = [os.path.expandvars(word) for word in words]
    target = None
    if ">" in words:
        words, (_, target) = words[: words.index(">")], words[words.index(">") :]
    if block.mark.startswith("help"):
        words = [*words, "--help"]
    try:
        with Path(target or os.devnull).open("w") as file, redirect_stdout(file) if target else nullcontext():
            cli.cli.main(words, prog_name="polyins", standalone_mode=False)
    except click.exceptions.Exit as stopped:  # after --help
        if stopped.exit_code:
            pytest.fail(f"{block}: polyins {shlex.join(words)}: exit code {stopped.exit_code}")
    except (click.ClickException, pi.InputError) as error:
        pytest.fail(f"{block}: polyins {shlex.join(words)}: {error}")


def test_readme_runs(desk: Path, data_folder_if_any: None, capsys: pytest.CaptureFixture[str]) -> None:
    write_recording(desk)
    follow(REPOSITORY / "README.md", desk)
    summary = json.loads((desk / "polyins-out" / "summary.json").read_text())
    assert summary["methods"]["enav-fusion"]["outages"]["count"] >= 2
    assert "single" in capsys.readouterr().out
    # the how-to reads what README's command wrote
    write_robot(desk)
    follow(REPOSITORY / "docs" / "how-to.md", desk)
    check_robot(desk)


def check_robot(desk: Path) -> None:
    """The how-to's robot drives, is calibrated, and its clock is found."""
    summary = json.loads((desk / "robot" / "summary.json").read_text())
    assert summary["method"] == "triple-ins"
    assert summary["reference"]["horizontal_max_m"] < 0.3
    joined = json.loads((desk / "joined" / "summary.json").read_text())
    assert set(joined["methods"]) == {"wheel-ins", "triple-ins", "triple-ins/centralized"}
    left, right, body = config.parse(read_yaml(desk / "robot-calibrated.yaml")).imus
    for wheel in (left.wheel, right.wheel):
        assert wheel is not None
        assert wheel.radius_m == pytest.approx(WHEEL_RADIUS_M, rel=0.01)
        assert wheel.lever_arm_m == pytest.approx((0.0, 0.015, 0.0), abs=1e-3)
    assert body.clock_offset_s == pytest.approx(-BODY_CLOCK_S, abs=0.01)


def test_tutorial_runs(desk: Path, data_folder_if_any: None, capsys: pytest.CaptureFixture[str]) -> None:
    left_out = follow(REPOSITORY / "docs" / "tutorial.md", desk)
    assert (desk / "fused" / "solution.parquet").is_file()
    out = capsys.readouterr().out
    if not any("kfgins-parity" in text for text in left_out):
        position = re.search(r"^position (\S+) mm", out, re.M)
        assert position
        assert float(position[1]) < 0.1
    if not any("wheelins-parity" in text for text in left_out):
        position = re.search(r"wheel-ins position (\S+) mm", out)
        assert position
        assert float(position[1]) < 2.0
    compared = json.loads((desk / "rover-compared" / "summary.json").read_text())
    assert compared["methods"]["triple-ins"]["drift"]["rate_percent"] < 0.5
    if left_out:
        pytest.skip(f"done but for {', '.join(left_out)} (set POLYINS_DATA)")


def test_first_log_runs(desk: Path, data_folder_if_any: None) -> None:
    """Each log becomes a result that is not refused, and the pair of files too."""
    if not _at_hand("logs"):
        pytest.skip("the logs are not at hand (set POLYINS_DATA)")
    logs = Path(os.environ["POLYINS_DATA"]) / "logs"
    for name, log in (
        ("flight.ulg", "ulog/ekf_failure.ulg"),
        ("copter.bin", "dataflash/log0036.bin"),
        ("robot.bag", "rosbag/husky.bag"),
    ):
        (desk / name).symlink_to(logs / log)
    write_pair(desk)
    assert follow(REPOSITORY / "docs" / "first-log.md", desk) == []
    for folder, heights in (("flight", "ellipsoidal"), ("copter", "sea-level"), ("robot", "ellipsoidal")):
        summary = json.loads((desk / folder / "summary.json").read_text())
        assert summary["heights"] == heights
        assert summary["utc_of_zero_s"] is not None
        assert (desk / folder / "report.html").is_file()
    summary = json.loads((desk / "drive" / "summary.json").read_text())
    assert summary["utc_of_zero_s"] == WEEK_2312_UNIX_S
    assert summary["coverage"]["of_recording"] > 0.85  # all but the standing start


WEEK_2312_UNIX_S = 1714262382.0
"""at which this GPS week began"""


def write_pair(folder: Path) -> None:
    """Write an IMU as CSV and fixes as `.pos`, both in seconds of one GPS week."""
    described = scenario.Scenario(duration_s=150, static_s=20, rate_hz=100, imus=scenario.Board(count=1), outages=())
    recording, begin = pi.simulate(described), 375000.0
    stream, fixes = recording.imus[0], recording.gnss
    assert fixes is not None
    _write_imu(folder / "imu.csv", stream, FORWARD_LEFT_UP, begin)
    table = (folder / "imu.csv").read_text()
    (folder / "imu.csv").write_text(table.replace("t,gx,gy,gz,ax,ay,az", "time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"))
    degrees = fixes.position * [180.0 / np.pi, 180.0 / np.pi, 1.0]
    values = np.hstack(
        [np.full((len(fixes.time), 1), 2312.0), fixes.time[:, None] + begin, degrees, fixes.position_std]
    )
    header = (
        "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix)\n%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn sde sdu"
    )
    form = "%4d %.3f %.9f %.9f %.4f 1 12 %.4f %.4f %.4f 0 0 0 0 0"
    np.savetxt(folder / "rover.pos", values, fmt=form, header=header, comments="")


def test_reference_runs(desk: Path) -> None:
    follow(REFERENCE, desk)


@pytest.fixture
def data_folder_if_any(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(os.environ.get("POLYINS_DATA", REPOSITORY.parent / "shared" / "data"))
    if folder.is_dir():
        monkeypatch.setenv("POLYINS_DATA", str(folder))


def test_a_command_of_the_readme_in_a_shell(tmp_path: Path) -> None:
    """The others run in this process; one shows that the program's name leads there."""
    done = subprocess.run([sys.executable, "-m", "polyins", "run", "missing.yaml"], cwd=tmp_path, capture_output=True)
    assert done.returncode == 2
    assert done.stdout == b""
    assert done.stderr.count(b"\n") <= 2


@pytest.mark.parametrize("block", [block for block in ALL if block.language == "yaml"], ids=str)
def test_yaml_is_a_configuration(block: Block, tmp_path: Path) -> None:
    path = tmp_path / "block.yaml"
    path.write_text(block.text, encoding="utf-8")
    if block.mark.startswith("scenario"):
        scenario.read_scenario(path)
    else:
        assert config.parse(read_yaml(path)).imus


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path) if path else page
        assert file.exists(), f"{page.name}: {target}"
        if anchor:
            assert anchor in anchors(file), f"{page.name}: {target}"


def anchors(page: Path) -> set[str]:
    """The headings of a page as GitHub names them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    headings = re.findall(r"^#+ (.*)$", text, flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


# --- what is named exists ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_named_functions_exist(page: Path) -> None:
    for name in re.findall(r"`(polyins(?:\.\w+)+)`", page.read_text(encoding="utf-8")):
        resolve(name)


def resolve(name: str) -> object:
    """Return the module, function or attribute of a dotted name."""
    parts = name.split(".")
    for split in range(len(parts), 0, -1):
        try:
            found: object = import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for part in parts[split:]:
            found = getattr(found, part)
        return found
    raise AssertionError(f"{name} is nowhere")


def test_pictures_are_small() -> None:
    pictures = list((REPOSITORY / "docs" / "pictures").glob("*"))
    assert 0 < len(pictures) <= 12
    assert all(picture.stat().st_size < 250_000 for picture in pictures)
    assert sum(picture.stat().st_size for picture in pictures) < 1_000_000


def test_every_picture_is_shown_by_a_page() -> None:
    pictures = (REPOSITORY / "docs" / "pictures").glob("*")
    shown = {Path(name).name for page in PAGES for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text())}
    assert {picture.name for picture in pictures} == shown


# --- the reference is complete ----------------------------------------------------------------------------------------


def section(title: str) -> str:
    """The text under a heading of the reference, up to the next of its rank or above."""
    text = REFERENCE.read_text(encoding="utf-8")
    rank = title.count("#")
    found = re.search(rf"^{re.escape(title)}$\n(.*?)(?=^#{{1,{rank}}} |\Z)", text, flags=re.M | re.S)
    assert found, title
    return found[1]


COMMANDS = cli.cli.commands
SOURCES = Path(pi.__file__).parents[1]
MODULES = {
    file: ".".join(file.relative_to(SOURCES).with_suffix("").parts) for file in Path(pi.__file__).parent.rglob("*.py")
}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_listed(name: str) -> None:
    command, text = COMMANDS[name], section(f"### polyins {name}")
    listed = set(re.findall(r"^\| `(--[\w-]+)`", text, flags=re.M))
    options = {option for p in command.params if isinstance(p, click.Option) for option in p.opts}
    assert listed == options
    for p in command.params:
        if isinstance(p, click.Argument):
            assert p.make_metavar(click.Context(command)) in text
        elif isinstance(p.default, str):
            assert f"| `{p.opts[0]}` | `{p.default}`" in text
    for sub in getattr(command, "commands", {}):
        assert re.search(rf"`polyins\s{name}\s{sub}\b", text)


def kinds_of_findings() -> set[str]:
    """What stands first in every call of `Finding`; names of kinds are those of upper case with a value beside them."""
    found: set[str] = set()
    for file in Path(pi.__file__).parent.rglob("*.py"):
        for call in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if (
                isinstance(call, ast.Call)
                and isinstance(call.func, ast.Name)
                and call.func.id == "Finding"
                and call.args
            ):
                kind = call.args[0]
                if isinstance(kind, ast.Name) and kind.id.isupper():
                    found.add(getattr(import_module(MODULES[file]), kind.id))
                found |= {one.value for one in ast.walk(kind) if isinstance(one, ast.Constant)}
    return found


def test_every_kind_of_finding_is_listed() -> None:
    listed = set(re.findall(r"^\| `([a-z ]+)` \|", section("### Kinds of findings"), flags=re.M))
    # those that are made from sentences
    assert listed == kinds_of_findings() | {"data", "point"}


def test_faults_are_named_by_kinds_that_exist() -> None:
    from polyins.studies.robustness.case import PARTS

    kinds = {kind for _, faults, _ in PARTS for fault in faults for kind in fault.kinds}
    assert kinds <= kinds_of_findings()


def test_every_target_and_method_is_listed() -> None:
    from polyins.model.methods import METHODS
    from polyins.studies.targets import known

    assert all(f"`{target}`" in section("### polyins reproduce") for target in known())
    assert all(f"`{method}`" in section("### polyins run") for method in METHODS)
    readme = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    assert all(f"| `{method}` |" in readme for method in METHODS)


def test_every_format_of_export_is_listed() -> None:
    from polyins.tools.export.writing import EXPORTS

    text = section("### polyins export")
    assert re.findall(r"^\| `([a-z]+)` \|", text, flags=re.M) == [one.name for one in EXPORTS]
    assert re.findall(r"`(\w+)`", text[text.index("`--to`") :].partition("\n")[0]) == [one.name for one in EXPORTS]


def test_every_public_name_is_listed() -> None:
    text = section("## Python")
    assert all(f"pi.{name}" in text for name in pi.__all__)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short run."""
    from polyins.tools import results
    from polyins.tools.comparison import Files

    folder = tmp_path_factory.mktemp("written")
    recording = pi.simulate(scenario.Scenario(duration_s=40, static_s=10, rate_hz=50, imus=scenario.Board(count=2)))
    comparison = pi.compare(recording, ["single", "enav-fusion"], files=Files(folder))
    results.write_comparison(folder, recording, comparison, report=False)
    return folder


@pytest.mark.parametrize("name", ["solution", "imu_errors"])
def test_every_column_is_listed(name: str, written: Path) -> None:
    from pyarrow import parquet

    listed = re.findall(r"^\| (`[^|]*) \|", section(f"### {name}.parquet"), flags=re.M)
    names = [column for cell in listed for column in re.findall(r"`(\w+)`", cell)]
    assert sorted(names) == sorted(parquet.read_schema(written / "enav-fusion" / f"{name}.parquet").names)


def test_every_key_of_the_summaries_is_listed(written: Path) -> None:
    document = json.loads((written / "summary.json").read_text())
    listed = {"run": section("### run"), "compare": section("### compare")}
    assert all(f"`{key}`" in listed["compare"] for key in document if key != "polyins")
    for path in keys(document["methods"]["enav-fusion"]):
        assert f"`{path}`" in listed["run"], path


def test_every_key_of_allan_is_listed() -> None:
    from polyins.calibration.noise_listing import document
    from polyins.tools.noise import noise_figures

    time, rng = np.arange(1, 1501) * 0.02, np.random.default_rng(0)
    still = [
        ImuStream(name, time, 1e-5 * rng.standard_normal((1500, 3)), 1e-4 * rng.standard_normal((1500, 3)))
        for name in ("left", "right")
    ]
    named = {"polyins", "left", "right", *config.Noise.model_fields}
    for key in keys(document(noise_figures(tuple(still)))):
        assert key in named or f"`{key}`" in section("### allan"), key


def keys(document: dict[str, Any]) -> Iterator[str]:
    for key, value in document.items():
        yield key
        if isinstance(value, dict):
            yield from keys(value)


CONFIGURATION: dict[str, type[BaseModel]] = {
    "the whole file": config.Config,
    "imus[], imu_defaults": config.ImuEntry,
    "columns of an IMU": config.ImuColumns,
    "columns.gyro": columns.GyroColumns,
    "columns.accel": columns.AccelColumns,
    "wheel": config.WheelEntry,
    "noise": config.Noise,
    "initial_errors": config.InitialErrors,
    "initial_std": config.InitialStd,
    "gnss": config.GnssEntry,
    "gnss.plane_origin": config.GeodeticPoint,
    "height": config.HeightEntry,
    "heading": config.HeadingEntry,
    "odometer": config.OdometerEntry,
    "columns of height, heading, odometer": config.SensorColumns,
    "reference": config.ReferenceEntry,
    "columns of positions": config.TrackColumns,
    "columns.time": columns.TimeColumn,
    "columns.time.fine": columns.FineTime,
    "columns.only, columns.gyro.only, columns.accel.only": columns.RowsOf,
    "columns.position": columns.PositionColumns,
    "columns.std, columns.velocity_std": columns.StdColumns,
    "columns.velocity": columns.VelocityColumns,
    "columns.attitude": columns.AttitudeColumns,
    "columns.heading": columns.HeadingColumn,
    "columns.rows": columns.RowChoice,
    "start": config.StartEntry,
    "start.position": config.StartPosition,
    "outages": config.OutageSchedule,
    "filter": config.Filter,
    "filter.rolling": config.Rolling,
    "filter.standstill": config.Standstill,
    "checks": config.Checks,
}
SCENARIO: dict[str, type[BaseModel]] = {
    "the whole scenario": scenario.Scenario,
    "imus": scenario.Board,
    "shuttle": flexible_scenario.Shuttle,
    "rulers": flexible_scenario.FlexibleMounts,
    "rulers.arms": flexible_scenario.Arm,
    "road": flexible_scenario.Road,
    "road.books": flexible_scenario.Book,
    "errors": error_scenario.SensorErrors,
    "errors.chips": error_scenario.ChipCalibration,
    "gnss of a scenario": scenario.Fixes,
    "gnss.lies": scenario.WrongFixes,
    "wheels[]": WheelModule,
    "wheels[].slip": Slip,
    "track": SurveyedTrack,
    "laps": Laps,
    "drive": Drive,
    "replay": ReplayedDrive,
}
KINDS = (
    (config.Outages, "mapping or list of two numbers each"),
    (config.Pair, "two numbers"),
    (config.Triple, "three numbers"),
    (config.PerAxis, "number or three"),
    (config.Spread, "number or three, not negative"),
    (config.PositiveSpread, "number or three above zero"),
    (config.Positive, "number above zero"),
    (config.NotNegative, "number, not negative"),
    (config.Number, "number"),
    (columns.ThreeColumns, "three columns"),
    (columns.Column, "name or number"),
)


def kind(hint: Any) -> str:
    """Say in words what a field takes."""
    for alias, words in KINDS:
        if hint == alias:
            return words
    arguments = [argument for argument in get_args(hint) if argument is not type(None)]
    if get_origin(hint) is Annotated:
        return kind(arguments[0])
    if get_origin(hint) is Literal:
        return ", ".join(f"`{argument}`" for argument in arguments)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "mapping"
    if hint in (bool, int, float, str):
        return {bool: "`true` or `false`", int: "whole number", float: "number", str: "text"}[hint]
    if type(None) in get_args(hint) and len(arguments) == 1:
        return kind(arguments[0])
    if get_origin(hint) is tuple and Ellipsis not in arguments and len(set(arguments)) == 1:
        return f"list of {len(arguments)}"
    return "list"


def shown(field: Any, model: type[BaseModel]) -> str:
    """A field's default as YAML would have it."""
    if field.is_required():
        return "the grade's" if model is config.Noise else "required"
    value = field.default
    if value is PydanticUndefined or isinstance(value, BaseModel):
        return "see there"
    if value is None or value in ((), ""):
        return "none"
    return f"`{json.dumps(value)}`" if not isinstance(value, str) else f"`{value}`"


def table(title: str, model: type[BaseModel]) -> str:
    hints = get_type_hints(model, include_extras=True)
    described = descriptions(model)
    rows = [
        f"| `{name}` | {kind(hints[name])} | {shown(field, model)} | {described[name]} |"
        for name, field in model.model_fields.items()
    ]
    return "\n".join([f"### {title}\n", "| key | value | default | what it is |", "|---|---|---|---|", *rows])


def grades() -> str:
    names = list(config.NOISE_GRADES)
    rows = [
        f"| `{key}` | " + " | ".join(f"{config.NOISE_GRADES[name][key]:g}" for name in names) + " |"
        for key in config.NOISE_GRADES[names[0]]
    ]
    header = ["### Grades of noise\n", "| | " + " | ".join(f"`{name}`" for name in names) + " |", "|---|---|---|---|"]
    return "\n".join([*header, *rows])


def known_imus() -> str:
    rows = []
    for name, imu in config.KNOWN_IMUS.items():
        figures = [
            f"{imu.figures[key].value:g} ({imu.figures[key].number:g} {imu.figures[key].unit})"
            if key in imu.figures
            else ""
            for key in KEYS_OF_IMUS
        ]
        sources = "; ".join(dict.fromkeys(one.source for one in imu.figures.values()))
        rows.append(f"| `{name}` | {imu.title} | {' | '.join(figures)} | `{imu.grade}` | {sources} |")
    header = [
        "### Common IMUs\n",
        f"| | | {' | '.join(f'`{key}`' for key in KEYS_OF_IMUS)} | the rest | source |",
        "|---|---|" + "---|" * len(KEYS_OF_IMUS) + "---|---|",
    ]
    return "\n".join([*header, *rows])


KEYS_OF_IMUS = (
    "angle_random_walk_deg_sqrt_h",
    "velocity_random_walk_m_s_sqrt_h",
    "gyro_bias_deg_h",
    "accel_bias_mgal",
    "correlation_time_h",
)


def with_tables(text: str) -> str:
    """Return the reference with its tables of keys as the models have them."""
    parts = {
        "keys": [*(table(title, model) for title, model in CONFIGURATION.items()), grades(), known_imus()],
        "scenario keys": [table(title, model) for title, model in SCENARIO.items()],
    }
    for name, tables in parts.items():
        begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
        head, _, rest = text.partition(begin)
        _, _, tail = rest.partition(end)
        text = head + begin + "\n" + "\n\n".join(tables) + "\n" + end + tail
    return text


def test_every_key_is_listed() -> None:
    text = REFERENCE.read_text(encoding="utf-8")
    assert text == with_tables(text), "python tests/test_documentation.py writes the tables anew"


def test_every_model_has_a_table() -> None:
    named = [getattr(config, name) for name in config.__all__]
    sections = {m for m in named if isinstance(m, type) and issubclass(m, config.Section)} - {
        config.Section,
        config.SensorEntry,
    }
    assert sections - {config.ImuSettings} <= set(CONFIGURATION.values())
    assert set(config.ImuSettings.model_fields) <= set(config.ImuEntry.model_fields)


if __name__ == "__main__":
    REFERENCE.write_text(with_tables(REFERENCE.read_text(encoding="utf-8")), encoding="utf-8")
