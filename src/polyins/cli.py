"""The commands: parse, call, print."""

from __future__ import annotations

import gc
import sys
import traceback
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from polyins.errors import InputError
from polyins.files import make_folder
from polyins.kernels.compilation import compilation_said
from polyins.screen import number, print_table, progress, say
from polyins.tools.summary_table import print_summaries
from polyins.version import __version__

if TYPE_CHECKING:
    from polyins.evaluation.documents import CompareDocument
    from polyins.model.findings import Level
    from polyins.model.recording import Recording
    from polyins.reading.loading import Settings
    from polyins.reading.long_recording import LongRecording
    from polyins.tools.comparison import Files

FOLDER = click.Path(file_okay=False, path_type=Path)
FILE = click.Path(path_type=Path)
SECONDS = click.FloatRange(0.0, 1e6)
RATE = click.FloatRange(0.0, 1e4, min_open=True)

NOT_TO_BE_USED = 3
"""exit code"""

COLLECT_AFTER = 300_000
"""new objects before Python looks for garbage: a start imports nearly as many, and all of them stay"""

TURN_S = 5e-4
"""for which a thread keeps Python's lock while others wait, s: kernels want it often, each time for an instant only"""

as_json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON document and nothing else.")
no_report_option = click.option("--no-report", is_flag=True, help="Leave out report.html.")


F = TypeVar("F", bound=Callable[..., Any])


def out_option(default: str) -> Callable[[F], F]:
    """Return the option that names the folder of a command's files."""
    text = "Folder for the files; what is there under the same names is replaced."
    return click.option("--out", type=FOLDER, default=default, show_default=True, help=text)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="polyins")
@click.option("--debug", is_flag=True, help="Show a traceback when something fails; allowed anywhere.")
def cli(debug: bool) -> None:
    """Navigation with several inertial measurement units."""


def main() -> None:
    """Run the command line.

    Exit 0 if done, 1 if it failed while running, 2 if command line or input are wrong, 3 if what came out is not to be
    used.
    """
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    debug = len(arguments) < len(sys.argv) - 1
    sys.setswitchinterval(TURN_S)
    try:
        sys.exit(cli.main(arguments, prog_name="polyins", standalone_mode=False) or 0)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "polyins"
        say(f"polyins: {error.format_message()} See {command} --help")
        sys.exit(2)
    except click.Abort:
        say("polyins: stopped")
        sys.exit(1)
    except Exception as error:
        if debug:
            traceback.print_exc()
        elif isinstance(error, InputError):
            say(f"polyins: {error}")
        else:
            say(f"polyins: failed: {type(error).__name__}: {error}\n(--debug shows where)")
        sys.exit(2 if isinstance(error, InputError) else 1)


@cli.command()
@out_option("polyins-demo")
def demo(out: Path) -> None:
    """Simulate a drive with an array of 16 IMUs, run every array method, show table and report."""
    from polyins.simulation import files
    from polyins.simulation.run import simulate as drive
    from polyins.simulation.scenario import demo as scenario
    from polyins.tools.comparison import Files

    say("simulating a drive with 16 IMUs and GNSS ...")
    with progress("simulating"):
        config = files.write(drive(scenario()), out / "recording")
    say(f"recording: {config}")
    _compare((config,), None, Files(out), as_json=False, no_report=False, judged=False)


@cli.command()
@click.argument("inputs", metavar="CONFIG|LOG...", type=FILE, nargs=-1, required=True)
@click.option(
    "--method",
    default=None,
    help="A row of the method table; unless given enav-fusion, single with one IMU, or what the wheels allow.",
)
@click.option("--imu", default=None, help="The IMU that `single` uses, by name or stream; the first unless given.")
@out_option("polyins-out")
@as_json_option
@no_report_option
def run(
    inputs: tuple[Path, ...], method: str | None, imu: str | None, out: Path, as_json: bool, no_report: bool
) -> None:
    """Run one method over one recording: a configuration (polyins, KF-GINS, Wheel-INS), or the logs that hold it."""
    from polyins.model.methods import find_method
    from polyins.tools import navigation, results
    from polyins.tools.propose.inputs import way_named

    gc.set_threshold(COLLECT_AFTER)
    if method is not None:
        find_method(method)
    if imu is not None and method not in (None, "single"):
        raise InputError(f"--imu {imu}: given with --method {method}; expected it with single only")
    with progress("reading"):
        settings = _settings(inputs)
        recording = _open(settings)
    known = navigation.head(recording)
    if imu is not None and known.rig.has_wheels:
        raise InputError(f"--imu {imu}: with wheels an IMU is chosen in the method, as in --method wheel-ins/{imu}")
    name = method or _usual_method(known, imu)
    streams = {entry.stream: entry.name for entry in settings.config.imus if entry.stream}
    index = _imu_index([one.name for one in known.rig.imus], streams.get(imu or "", imu))
    make_folder(out)
    with way_named(inputs), compilation_said(), progress(name) as update:
        outcome = navigation.run(recording, name, imu=index, folders={out: None}, progress=update)
    with progress("writing"):
        results.write_run(out, recording, outcome, report=not no_report)
    summary = outcome.summary
    if as_json:
        _print_json(summary)
    else:
        print_summaries(known.name, {name: summary}, {})
        say("start: " + ", ".join(f"{key} {value}" for key, value in summary["start"].items()))
        say(f"files: {out}" + ("" if no_report else f", report: {out / 'report.html'}"))
    _exit_by([summary["verdict"]["level"]])


def _settings(inputs: tuple[Path, ...]) -> Settings:
    """Read a configuration, or propose one for logs; what it assumes are warnings and findings."""
    from polyins.reading.loading import read_config
    from polyins.tools.propose.inputs import are_logs
    from polyins.tools.propose.proposal import settings_of

    if not are_logs(inputs):
        return read_config(inputs[0])
    return settings_of(inputs)


def _open(settings: Settings) -> Recording | LongRecording:
    """Read a recording, or open its files if it is longer than memory."""
    from polyins.reading.loading import load_settings
    from polyins.reading.long_recording import open_long

    return open_long(settings) or load_settings(settings)


def _exit_by(levels: list[Level]) -> None:
    """Exit with 3 if none of the results is to be used."""
    from polyins.model.findings import DO_NOT_USE

    if all(level == DO_NOT_USE for level in levels):
        raise click.exceptions.Exit(NOT_TO_BE_USED)


def _print_json(document: Mapping[str, Any]) -> None:
    from polyins.formats.documents import as_json

    print(as_json(document))


def _usual_method(recording: Recording, imu: str | None) -> str:
    from polyins.navigate.choice import usual_method

    return usual_method(recording.rig) if imu is None else "single"


def _imu_index(names: list[str], wanted: str | None) -> int:
    if wanted is None:
        return 0
    if wanted not in names:
        raise InputError(f"--imu {wanted}: is not in the recording; expected one of {', '.join(names)}")
    return names.index(wanted)


@cli.command()
@click.argument("inputs", metavar="CONFIG|LOG...", type=FILE, nargs=-1, required=True)
@click.option("--methods", default=None, help="Names separated by commas; unless given all that the rig allows.")
@click.option("--threads", type=click.IntRange(1), default=None, help="Runs at once; one for each core unless given.")
@click.option(
    "--single-rate",
    type=click.FloatRange(0.0, 1e4),
    default=10.0,
    show_default=True,
    help="Rows a second in the files of single IMUs; 0: every epoch.",
)
@out_option("polyins-out")
@as_json_option
@no_report_option
def compare(inputs: tuple[Path, ...], methods: str | None, single_rate: float, out: Path, **options: Any) -> None:
    """Run several methods over one recording or more, and each IMU on its own; logs make one recording together."""
    from polyins.model.methods import find_method
    from polyins.tools.comparison import Files
    from polyins.tools.propose.inputs import are_logs

    gc.set_threshold(COLLECT_AFTER)
    names = [find_method(name.strip()).name for name in methods.split(",")] if methods is not None else None
    files = Files(out, single_rate or None)
    if len(inputs) > 1 and not are_logs(inputs):
        _compare_several(inputs, names, files, **options)
    else:
        _compare(inputs, names, files, **options)


def _compare(
    inputs: tuple[Path, ...],
    methods: list[str] | None,
    files: Files,
    as_json: bool,
    no_report: bool,
    threads: int | None = None,
    judged: bool = True,
) -> None:
    from polyins.tools import navigation, results
    from polyins.tools.comparison import compare as run_all
    from polyins.tools.propose.inputs import way_named

    out = files.folder
    with progress("reading"):
        recording = _open(_settings(inputs))
    make_folder(out)
    with way_named(inputs), compilation_said(), progress("compare") as update:
        result = run_all(recording, methods, files=files, threads=threads, progress=update)
    with progress("writing"):
        results.write_comparison(out, recording, result, report=not no_report)
    if as_json:
        _print_json(result.document)
    else:
        _print_comparison(navigation.head(recording).name, result.document)
        say(f"files: {out}" + ("" if no_report else f", report: {out / 'report.html'}"))
    if judged:
        _exit_by([method["verdict"]["level"] for method in result.document["methods"].values()])


def _compare_several(
    configs: tuple[Path, ...],
    methods: list[str] | None,
    files: Files,
    as_json: bool,
    no_report: bool,
    threads: int | None,
) -> None:
    from polyins.formats.documents import write_document
    from polyins.reading.loading import names_of, read_config
    from polyins.tools import results
    from polyins.tools.comparison import Comparison, compare_several

    out = files.folder
    settings = [read_config(config) for config in configs]
    readers = {name: partial(_open, one) for name, one in zip(names_of(settings), settings, strict=True)}
    make_folder(out)

    def write(name: str, recording: Recording | LongRecording, result: Comparison) -> None:
        results.write_comparison(out / name, recording, result, report=not no_report)

    with compilation_said(), progress("compare") as update:
        document = compare_several(readers, write, methods, files=files, threads=threads, progress=update)
    write_document(out / "summary.json", document)
    parts = document["recordings"]
    if as_json:
        _print_json(document)
    else:
        for name, part in parts.items():
            _print_comparison(name, part)
        pooled = document["pooled"]
        print_summaries(f"over {len(configs)} recordings", pooled["methods"], pooled["ratio_to_single"])
        say(f"files: {out}" + ("" if no_report else f", reports: {out / '*' / 'report.html'}"))
    _exit_by([method["verdict"]["level"] for part in parts.values() for method in part["methods"].values()])


def _print_comparison(name: str, document: CompareDocument) -> None:
    from polyins.evaluation.summary import on_wheels

    methods = document["methods"]
    alone, each = next(((key, one["each"]) for key, one in methods.items() if "each" in one), ("", ()))
    wheels = any(map(on_wheels, methods.values()))
    title = f"{name}; {alone}: rms over {len(each)} "
    # on a vehicle nothing says that N modules are better by that much
    title += "wheels" if wheels else f"IMUs; sqrt(N) = {document['sqrt_n']:.2f}"
    print_summaries(title, methods, document["ratio_to_single"])


@cli.command()
@click.argument("config", type=FILE)
@click.option("--source", "sources", multiple=True, help="replay:, -, udp://, tcp://, serial://, gpsd://, mavlink://")
@click.option("--sink", "sinks", multiple=True, help="ndjson:, nmea+tcp://, nmea+udp://; each takes ?rate=HZ.")
@click.option("--method", default=None, help="A row of the method table, as for run.")
@click.option("--speed", default="1", show_default=True, help="Of a replay: times real speed, or max.")
@click.option("--rate", "rate_hz", type=RATE, default=10.0, show_default=True, help="Of sinks and log, Hz.")
@click.option("--delay", type=SECONDS, default=0.5, show_default=True, help="How late a fix may come, s.")
@click.option("--wait", type=SECONDS, default=0.05, show_default=True, help="How long an epoch waits for an IMU, s.")
@click.option("--page", default=None, type=int, help="Show a page in the browser at this port; 0: any free one.")
@click.option("--bind", default="127.0.0.1", show_default=True, help="The address at which the page is served.")
@click.option(
    "--checkpoint-every", type=SECONDS, default=10.0, show_default=True, help="Seconds between checkpoints; 0: none."
)
@click.option("--resume", is_flag=True, help="Go on from the checkpoint in --out, if there is one.")
@out_option("polyins-live")
def live(config: Path, sources: tuple[str, ...], sinks: tuple[str, ...], speed: str, **options: Any) -> None:
    """Navigate on live data, or on a recording as if it were live, until the data end or Ctrl-C."""
    from polyins.live import run

    sources, sinks = sources or run.Options.sources, sinks or run.Options.sinks
    settings = run.Options(config, sources=sources, sinks=sinks, speed=run.parse_speed(speed), **options)
    summary = run.run(settings)
    say(f"{summary['stopped_by']}: {summary['status']}; verdict: {summary['verdict']['level']}; files: {settings.out}")
    for finding in summary["verdict"]["findings"]:
        if finding["severity"] != "note":
            say(finding["text"])
    _exit_by([summary["verdict"]["level"]])


@cli.command()
@click.argument("config", type=FILE)
@click.option("--out", type=FILE, default=None, help="File for the configuration; CONFIG's name and -calibrated.")
@as_json_option
def calibrate(config: Path, out: Path | None, as_json: bool) -> None:
    """Estimate how wheel and body IMUs are mounted, or how the IMUs of an array err, and write a configuration."""
    from polyins.calibration import array, drive, listing
    from polyins.calibration.configuration import calibrated
    from polyins.files import write_bytes
    from polyins.reading.loading import build, read_config

    with progress("reading"):
        read = read_config(config)
        settings, document, warnings = read.config, read.document, read.warnings
        recording = build(settings, document, mounts_known=False)
    with progress("calibrate"):
        wheels = recording.rig.has_wheels
        calibration = drive.calibrate(recording) if wheels else array.calibrate(recording, settings.imus)
    target = out or document.path.with_name(f"{document.path.stem}-calibrated.yaml")
    moved = target.resolve().parent != document.path.resolve().parent
    text = calibrated(document.values, settings, calibration, document.path.resolve().parent if moved else None)
    make_folder(target.parent)
    write_bytes(target, text.encode())
    if as_json:
        _print_json(listing.document(calibration))
        return
    print_table(recording.name, listing.COLUMNS, listing.rows(calibration))
    for warning in (*warnings, *recording.sentences, *calibration.warnings):
        say(f"warning: {warning}")
    if wheels or calibration.agreement:
        say(f"forward: {calibration.forward_from}" if wheels else listing.agreed(calibration))
    say(f"configuration: {target}")


@cli.command()
@click.argument("inputs", metavar="CONFIG|LOG...", type=FILE, nargs=-1, required=True)
@click.option("--out", type=FOLDER, default=None, help="Folder for allan.json, noise.yaml and the page allan.html.")
@as_json_option
def allan(inputs: tuple[Path, ...], out: Path | None, as_json: bool) -> None:
    """Tell the noise of IMUs from where they rest: Allan deviation, random walks, bias instability, an array's gain."""
    from polyins.calibration import noise_listing
    from polyins.tools.noise import noise_figures, read_streams, write_noise

    if out is not None:
        make_folder(out)
    with progress("reading"):
        settings = _settings(inputs)
        streams, known = read_streams(settings)
    with progress("allan"):
        figures = noise_figures(streams, known)
    if out is not None:
        write_noise(out, settings.config.name, figures)
    if as_json:
        _print_json(noise_listing.document(figures))
        return
    print_table(settings.config.name, noise_listing.COLUMNS, noise_listing.rows(figures))
    for text in noise_listing.sentences(figures.array) if figures.array else ():
        say(text)
    for text in noise_listing.worst(figures.findings):
        say(text)
    click.echo(noise_listing.configuration(figures), nl=False)
    if out is not None:
        say(f"files: {out}, page: {out / 'allan.html'}")


@cli.command()
@click.argument("solution", type=FILE)
@click.option("--reference", type=FILE, required=True, help="A file with the true positions.")
@as_json_option
def evaluate(solution: Path, reference: Path, as_json: bool) -> None:
    """Compare a written solution with a reference."""
    from polyins.evaluation.summary import summarize
    from polyins.formats.solution_files import read_solution
    from polyins.reading.reference import load_reference

    estimate = read_solution(solution)
    summary = summarize(estimate, load_reference(reference, estimate))
    if as_json:
        _print_json(summary)
    else:
        print_summaries(str(solution), {estimate.method: summary}, {})
    _exit_by([summary["verdict"]["level"]])


@cli.command()
@click.argument("scenario", type=FILE)
@out_option("polyins-simulated")
@click.option("--seed", type=int, default=None, help="Takes the place of the scenario's own.")
def simulate(scenario: Path, out: Path, seed: int | None) -> None:
    """Simulate the recording that a scenario file describes, with its truth and a configuration to run it."""
    from polyins.simulation import files
    from polyins.simulation.run import simulate as drive

    with progress("simulating"):
        recording = drive(scenario, seed=seed)
        config = files.write(recording, out)
    for warning in recording.warnings:
        say(f"warning: {warning}")
    say(f"configuration: {config}")


@cli.command()
@click.argument("target")
@click.option("--quick", is_flag=True, help="Fewer runs.")
@out_option("polyins-reproduced")
@as_json_option
def reproduce(target: str, quick: bool, out: Path, as_json: bool) -> None:
    """Reproduce published or measured figures. TARGET: all, figures, or one, such as a3."""
    from polyins.formats.documents import write_document
    from polyins.studies import reproduction, targets

    found = targets.find(target)
    several = target in targets.SEVERAL
    make_folder(out)
    with compilation_said(), progress(target) as update:
        if several:
            document = reproduction.reproduce(target, found, quick, out, update, say)
        else:
            document = found[0].reproduce(quick, update, out)
    write_document(out / f"{target}.json", document)
    if quick:
        say("the quick form: its figures are not those of the full one")
    if as_json:
        _print_json(document)
        return
    for part in reproduction.parts(document) if several else [document]:
        reproduction.print_document(part)
    if several:
        say(f"page: {out / 'index.html'}")


@cli.command()
@as_json_option
def warmup(as_json: bool) -> None:
    """Compile ahead of time what the methods need: in a container image, or before a robot sets off."""
    from polyins.tools.warmup import warm_up

    with progress("compiling") as update:
        document = warm_up(update)
    if as_json:
        _print_json(document)
        return
    rows = [[family["name"], number(family["compiled_s"], 1)] for family in document["families"]]
    print_table("kernels", ["for", "compiled, s"], rows)
    say(f"cache: {document['cache']}")


@cli.command()
@click.option(
    "--throughput", "all_cores", is_flag=True, help="Time recordings per second instead, on one core and all."
)
@as_json_option
def bench(all_cores: bool, as_json: bool) -> None:
    """Time every method per epoch against the dense, paper-shaped single filter, in one run."""
    from polyins.tools.bench import bench as measure

    if all_cores:
        _throughput(as_json)
        return
    with compilation_said(), progress("bench") as update:
        document = measure(update)
    if as_json:
        _print_json(document)
        return
    columns = ["name", "us/epoch, median", "min", "ratio to dense/single", "runs"]
    rows = [
        [r["name"], number(r["median"]), number(r["min"]), number(r["ratio_to_dense"], 3), str(r["runs"])]
        for r in document["results"]
    ]
    print_table("CPU time per epoch, 200 Hz IMU and 1 Hz GNSS", columns, rows)


def _throughput(as_json: bool) -> None:
    from polyins.tools.throughput import throughput

    with compilation_said(), progress("bench") as update:
        document = throughput(update)
    if as_json:
        _print_json(document)
        return
    rates = zip(document["threads"], document["recordings_per_s"], strict=True)
    rows = [[str(threads), number(rate, 1)] for threads, rate in rates]
    print_table("16 IMUs, 300 s at 200 Hz, enav-fusion", ["threads", "recordings/s"], rows)
    say(f"ratio, median of {document['rounds']} rounds: {document['ratio']:.2f}")


@cli.group()
def datasets() -> None:
    """Public data sets by name."""


@datasets.command("list")
def list_datasets() -> None:
    """List the data sets that polyins knows."""
    from polyins.reading import datasets as known

    rows = [[name, str(known.info(name)["summary"]), str(known.info(name)["folder"] or "-")] for name in known.names()]
    print_table("data sets", ["name", "what", "folder"], rows)


@datasets.command("info")
@click.argument("name")
def dataset_info(name: str) -> None:
    """Say what a data set is and where it is."""
    from polyins.reading import datasets as known

    for key, value in known.info(name).items():
        click.echo(f"{key}: {value}")


@datasets.command("fetch")
@click.argument("name")
def fetch_dataset(name: str) -> None:
    """Download a data set, unless it is here, and print its folder."""
    from polyins.reading import datasets as known

    click.echo(known.fetch(name))


@datasets.command("config")
@click.argument("name", metavar="NAME/TRIAL")
@click.option("--gnss", is_flag=True, help="Let the receiver's positions aid the filter.")
def dataset_configuration(name: str, gnss: bool) -> None:
    """Print the configuration of a recording of a data set, such as wid/trial08."""
    from polyins.reading import datasets as known

    click.echo(known.configuration(name, gnss=gnss), nl=False)


@cli.command()
@click.argument("files", metavar="FILE...", type=FILE, nargs=-1, required=True)
@as_json_option
def info(files: tuple[Path, ...], as_json: bool) -> None:
    """Say what is in data files or configurations: streams, rates, gaps, span."""
    from polyins.tools.inspect import inspect, inspect_each, listing

    facts = inspect(files[0]) if len(files) == 1 else {"files": inspect_each(files)}
    if as_json:
        _print_json(facts)
    else:
        click.echo(listing(facts))
    unread = [one for one in facts.get("files", ()) if one["kind"] == "unknown"]
    if unread:
        raise InputError("; ".join(text for one in unread for text in one["problems"]))


@cli.command()
@click.argument("inputs", metavar="CONFIG|LOG...", type=FILE, nargs=-1, required=True)
@click.option("--fix", type=FILE, default=None, help="A new file for the configuration in which it is right.")
@as_json_option
def check(inputs: tuple[Path, ...], fix: Path | None, as_json: bool) -> None:
    """Say what is wrong with the data, by what evidence, and how to put it right.

    Exit 2 if a run would refuse them.
    """
    from polyins.tools.check import check as check_data
    from polyins.tools.check import write_fixed

    with progress("checking"):
        checked = check_data(inputs)
    if fix is not None:
        write_fixed(checked, fix)
    if as_json:
        _print_json(checked.as_json())
    else:
        for finding in checked.findings:
            click.echo(f"{finding.severity}: {finding.kind}: {finding.sentence}")
        if not checked.findings:
            click.echo("nothing found")
    if fix is not None:
        for setting in checked.settings:
            say(f"set {setting.sentence}")
        say(f"configuration: {fix}")
    if checked.refused:
        raise click.exceptions.Exit(2)


@cli.command()
@click.argument("source", metavar="IN", type=FILE)
@click.argument("target", metavar="OUT", type=FILE)
@click.option("--stream", default=None, help="Of a log of several: the one that is written.")
def convert(source: Path, target: Path, stream: str | None) -> None:
    """Convert a data file; formats follow from content (IN) and suffix (OUT: of a log, a folder has none)."""
    from polyins.tools.convert import convert as convert_file

    for text in convert_file(source, target, stream):
        say(f"warning: {text}")
    say(f"written: {target}")


@cli.command()
@click.argument("solution", metavar="SOLUTION", type=FILE)
@click.argument("target", metavar="OUT", type=FILE)
@click.option("--to", required=True, help="tum, kitti, kml, geojson, gpx, nmea, mcap, pos or csv.")
@click.option("--method", default=None, help="Which of the methods of a comparison, as enav-fusion or single/imu1.")
@click.option("--rate", "rate_hz", type=RATE, default=None, help="Rows a second; all unless given.")
@click.option("--columns", default=None, help="Of csv: names separated by commas; all unless given.")
@click.option(
    "--utc-of-zero", default=None, help="When time_s is zero, as 2024-05-01T12:00:00Z or 'week 2312' (of GPS)."
)
@click.option("--geoid-height", "geoid_height_m", type=float, default=None, help="Of the geoid above the ellipsoid, m.")
def export(solution: Path, target: Path, to: str, method: str | None, columns: str | None, **options: Any) -> None:
    """Write a solution, a run's folder or its solution.parquet, as a new file that other programs open."""
    from polyins.tools.export.trace import read_trace
    from polyins.tools.export.writing import ExportOptions, write

    chosen = tuple(name.strip() for name in columns.split(",")) if columns is not None else ()
    for text in write(read_trace(solution, method), target, to, ExportOptions(columns=chosen, **options)):
        say(f"warning: {text}")
    say(f"written: {target}")


@cli.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--out", type=FILE, default=None, help="File for the configuration; standard output unless given.")
def init(files: tuple[Path, ...], out: Path | None) -> None:
    """Look at recordings and write a commented configuration for them."""
    from polyins.files import write_bytes
    from polyins.tools.propose.proposal import check_proposal, propose

    if out is not None and out.parent.resolve() != Path.cwd():
        # names in a configuration count from its own folder
        files = tuple(file.resolve() for file in files)
    proposal = propose(files)
    check_proposal(proposal, files, out)
    if out is None:
        click.echo(proposal.text)
    elif out.exists():
        raise InputError(f"--out {out}: exists; expected the name of a new file")
    else:
        write_bytes(out, proposal.text.encode())
        say(f"configuration: {out}")
