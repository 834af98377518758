"""`polyins live`: sources, session and sinks put together, until the data end or a signal comes."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polyins.config import Config
from polyins.config.yaml_document import Document
from polyins.errors import InputError
from polyins.files import make_folder
from polyins.formats.documents import write_document
from polyins.kernels.compilation import compilation_said
from polyins.live.conversion import Conversion
from polyins.live.inbox import Inbox
from polyins.live.page import RATE_HZ as PAGE_RATE_HZ
from polyins.live.page import Page
from polyins.live.preload import preload
from polyins.live.replay import Replay
from polyins.live.session import Checkpoints, Session
from polyins.live.sinks import Outlet, ParquetLog, open_sink
from polyins.live.source import POLL, RefusedError, Source
from polyins.live.sources import open_source
from polyins.model.findings import notes
from polyins.model.methods import find_method
from polyins.model.recording import Recording
from polyins.navigate import choice
from polyins.navigate.samples import Sample
from polyins.navigate.starter import Starter
from polyins.prepare.alignment import Start
from polyins.reading import loading
from polyins.screen import say
from polyins.version import __version__

if TYPE_CHECKING:
    from polyins.navigate.navigator import Navigator

REPLAY = "replay:"
TOLD = 5.0  # s, at least, between two messages on what is missing for a start


Opened = tuple[Source, Conversion | None]
"""a source, and what its samples go through; those of a replay are as the navigator wants them"""


@dataclass(frozen=True)
class Options:
    """What the command line says."""

    config: Path
    out: Path
    sources: tuple[str, ...] = (REPLAY,)
    sinks: tuple[str, ...] = ("ndjson:",)
    method: str | None = None
    speed: float = 1.0
    rate_hz: float = 10.0
    delay: float = 0.5
    wait: float = 0.05
    page: int | None = None
    bind: str = "127.0.0.1"
    checkpoint_every: float = 10.0
    resume: bool = False


def parse_speed(text: str) -> float:
    """Return a replay's speed, a number or max; raises InputError for anything else."""
    if text == "max":
        return math.inf
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed < math.inf:
        raise InputError(f"--speed {text}: expected a number above 0, or max")
    return speed


def run(options: Options) -> dict[str, Any]:
    """Navigate until the data end or SIGINT or SIGTERM comes; returns the summary, which is also written.

    Raises InputError for a configuration, source or sink that cannot be right, and for data that end without a start.
    """
    settings = loading.read_config(options.config)
    config = settings.config
    recording, said = _recording(options, config, settings.document)
    method = find_method(options.method or choice.usual_method(recording.rig)).name
    make_folder(options.out)
    session = _session(options, config, recording, method)
    with _stop_signals() as stopped:
        live = Live(session, _sources(options, config, recording, session), stopped)
        live.open_outlets(options, method, config)
        live.run()
    summary = live.summary(method, (*settings.warnings, *said))
    write_document(options.out / "summary.json", summary)
    if session.navigator is None and not live.stopped_by:
        raise InputError(f"{options.config}: the data ended without a start: {session.starter.why}")
    return summary


class Live:
    """Threads that read, one that navigates."""

    def __init__(
        self, session: Session, sources: Sequence[tuple[Source, Conversion | None]], stopped: list[str]
    ) -> None:
        self.session = session
        self.sources = sources
        self.signals = stopped
        self.stopped_by = ""
        self.page: Page | None = None
        self.files: list[Path] = []
        self.inbox = Inbox(len(sources))
        self.failure: Exception | None = None
        self.said = (time.monotonic(), "")

    def open_outlets(self, options: Options, method: str, config: Config) -> None:
        """Open sinks, log and page."""
        outlets: list[Outlet] = []
        geoid = config.gnss.geoid_height_m if config.gnss else None
        geodetic = self.session.starter.blank.geodetic
        self.session.outlets = outlets
        log = _free(options.out / "solution.parquet") if options.resume else options.out / "solution.parquet"
        self.files.append(log)
        as_given = config.gnss is not None and config.gnss.height == "as-given"
        known: dict[str, object] = {"method": method, "heights": "unknown" if as_given else "ellipsoidal"}
        outlets.append(Outlet(ParquetLog(log, known), options.rate_hz))
        outlets.extend(open_sink(url, options.rate_hz, geodetic, geoid) for url in options.sinks)
        if options.page is not None:
            self.page = Page(options.bind, options.page, self.report)
            outlets.append(Outlet(self.page, PAGE_RATE_HZ))
            say(f"page: {self.page.url}")

    def run(self) -> None:
        """Take samples until none can come any more, or until a signal; what has come by then is taken."""
        threads = [threading.Thread(target=self._pump, args=pair, daemon=True) for pair in self.sources]
        for thread in threads:
            thread.start()
        try:
            while not self.signals and (samples := self.inbox.take(POLL)) is not None:
                self._take(samples)
            self.stopped_by = self.signals[0] if self.signals else ""
            self._take(self.inbox.take(0.0) or [])
            self.session.finish()
        except BrokenPipeError:
            self.stopped_by = "end of standard output"
            self.session.finish()
        finally:
            self._close()
        if self.failure is not None:
            raise self.failure

    def _take(self, samples: list[Sample]) -> None:
        for sample in samples:
            self.session.take(sample)
        if self.session.navigator is None:
            self._tell_what_is_missing()

    def _tell_what_is_missing(self) -> None:
        why, now = self.session.starter.why, time.monotonic()
        if self.page is not None:
            self.page.tell()
        if why != self.said[1] and now - self.said[0] > TOLD:
            say(f"looking for a start: {why}")
            self.said = now, why

    def _pump(self, source: Source, conversion: Conversion | None) -> None:
        try:
            for samples in source.chunks():
                self.inbox.put(_admitted(samples, source, conversion))
        except Exception as error:
            self.failure = error  # raised when what has come is safe
        finally:
            self.inbox.source_ended()

    def _close(self) -> None:
        for source, _ in self.sources:
            source.stop()
        self.inbox.close()
        for outlet in self.session.outlets:
            outlet.sink.close()

    def refused(self) -> Counter[str]:
        """Return what was refused anywhere, by kind."""
        counts = self.session.refused()
        for source, _ in self.sources:
            counts.update(source.counts)
        return counts

    def report(self) -> dict[str, Any]:
        """Return how it goes, for the page."""
        return {**self.session.report(), "refused": self.refused().total()}

    def summary(self, method: str, warnings: Sequence[str]) -> dict[str, Any]:
        """Return the document that is written at the end."""
        session = self.session
        rig = session.starter.blank.rig
        names = [imu.name for imu in rig.imus] + [sensor.kind for sensor in rig.sensors]
        report = session.report()
        checkpoints = session.checkpoints.count if session.checkpoints else 0
        judged = session.judged(notes(warnings))
        return {
            "polyins": __version__,
            "method": method,
            "sources": [source.url for source, _ in self.sources],
            "stopped_by": self.stopped_by or "end of data",
            "status": report["status"],
            "geodetic": session.starter.blank.geodetic,
            "start": session.start and {"time_s": session.start.time, **session.start.sources},
            "end_s": session.last.state.time if session.last else None,
            "epochs": {name: session.samples[name] for name in names},
            "fixes": session.samples["GNSS"],
            "refused": dict(sorted(self.refused().items())),
            "imus": report.get("imus", []),
            "checkpoints": checkpoints,
            "files": [path.name for path in self.files if path.is_file()],
            "verdict": judged.document(),
            "coverage": session.coverage,
            "faults": judged.faults,
            "warnings": judged.warnings,
        }


def _admitted(samples: list[Sample], source: Source, conversion: Conversion | None) -> list[Sample]:
    if conversion is None:
        return samples
    admitted = []
    for sample in samples:
        try:
            admitted.append(conversion.taken(sample))
        except RefusedError as error:
            source.counts[str(error)] += 1
    return admitted


def _recording(options: Options, config: Config, document: Document) -> tuple[Recording, tuple[str, ...]]:
    """Return the recording to be replayed, or one without streams; and warnings."""
    if REPLAY in options.sources:
        recording = loading.build(config, document)
        return recording, recording.sentences
    return loading.without_data(config, document)


def _session(options: Options, config: Config, recording: Recording, method: str) -> Session:
    from polyins.navigate.navigator import Navigator

    rig, delay = recording.rig, options.delay
    latest = max(delay, options.wait)
    needs_fix = recording.start.position is None and config.gnss is not None
    begin: Callable[[Start], Navigator] = partial(
        Navigator,
        rig,
        method=method,
        options=recording.options,
        geodetic=recording.geodetic,
        delay=delay,
        wait=options.wait,
    )
    with compilation_said():
        preload(recording, method, latest, begin)
    starter = Starter(replace(recording, imus=(), gnss=None), latest, needs_fix, method)
    every = options.checkpoint_every or math.inf
    checkpoints = Checkpoints(options.out, every)
    session = Session(starter, begin, (), checkpoints)
    if options.resume and checkpoints.path.is_file():
        session.resume(Navigator.resume(checkpoints.path), np.load(checkpoints.origin_path))
        say(f"going on from {checkpoints.path}")
    return session


def _sources(options: Options, config: Config, recording: Recording, session: Session) -> list[Opened]:
    names = tuple(imu.name for imu in recording.rig.imus)
    conversion = Conversion(config, recording.geodetic)
    after = -math.inf
    if session.navigator is not None and session.navigator.state is not None:
        after = session.navigator.state.time - 2.0 * options.delay
    return [
        (Replay(recording, options.speed, after), None) if url == REPLAY else (open_source(url, names), conversion)
        for url in options.sources
    ]


def _free(path: Path) -> Path:
    """Return the path, or the first one with a number that is free."""
    number = 2
    free = path
    while free.exists():
        free = path.with_stem(f"{path.stem}-{number}")
        number += 1
    return free


@contextmanager
def _stop_signals() -> Iterator[list[str]]:
    """Collect the names of SIGINT and SIGTERM instead of dying of them."""
    received: list[str] = []

    def note(number: int, frame: object) -> None:
        received.append(signal.Signals(number).name)

    if threading.current_thread() is not threading.main_thread():
        yield received
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
