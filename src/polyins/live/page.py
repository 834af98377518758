"""A page in the browser that follows the navigator: one HTML file and a stream of server-sent events."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from polyins.errors import InputError
from polyins.live.snapshot import Snapshot

RATE_HZ = 10.0
TRACK = 4000
"""points that a page which opens later is sent; every second one goes when there are more"""
KEEP_ALIVE = 5.0  # s
POLICY = "default-src 'self'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


class Page:
    """A sink that serves what it takes over HTTP."""

    def __init__(self, bind: str, port: int, report: Callable[[], dict[str, Any]]) -> None:
        """`report` says how it goes; it is called when something changed, in the thread that brings it."""
        self.report = report
        self.track: list[tuple[float, float, bool]] = []
        """m north, east, and whether it is dead reckoning"""
        self.every, self.skipped = 1, 0
        self.news = "{}"
        self.count = 0
        self.changed = threading.Condition()
        self.closed = False
        try:
            self.server = _Server((bind, port), self)
        except (OSError, OverflowError) as error:
            raise InputError(f"--page {port}: cannot be served at {bind} ({error})") from error
        self.url = f"http://{bind}:{self.server.server_address[1]}/"
        threading.Thread(target=self.server.serve_forever, name="page", daemon=True).start()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        row = snapshot.row
        point = (round(row["north_m"] or 0.0, 2), round(row["east_m"] or 0.0, 2), snapshot.dead_reckoning)
        with self.changed:
            self.skipped += 1
            if self.skipped >= self.every:
                self.track.append(point)
                self.skipped = 0
            if len(self.track) > TRACK:
                self.track, self.every = self.track[::2], 2 * self.every
        self.tell()

    def tell(self) -> None:
        """Send what the report says to all who look."""
        news = json.dumps(self.report(), allow_nan=False)
        with self.changed:
            self.news = news
            self.count += 1
            self.changed.notify_all()

    def close(self) -> None:
        """Say that it is over, and stop."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()
        self.server.shutdown()
        self.server.server_close()

    def next_news(self, seen: int) -> tuple[int, str] | None:
        """Wait for news after number `seen`, or for a while; None when it is over."""
        with self.changed:
            if self.count == seen and not self.closed:
                self.changed.wait(KEEP_ALIVE)
            return None if self.closed and self.count == seen else (self.count, self.news)


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def __init__(self, at: tuple[str, int], page: Page) -> None:
        self.page = page
        super().__init__(at, _Handler)


class _Handler(BaseHTTPRequestHandler):
    server: _Server

    def do_GET(self) -> None:
        """Answer with the page, or follow with events."""
        if self.path == "/":
            self._send_page()
        elif self.path == "/events":
            self._send_events()
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def log_request(self, code: int | str = "-", size: int | str = "-") -> None:
        """Say nothing: standard error is for the navigator."""

    def _begin(self, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()

    def _send_page(self) -> None:
        self._begin("text/html; charset=utf-8")
        self.wfile.write(files("polyins.live").joinpath("page.html").read_bytes())

    def _send_events(self) -> None:
        page = self.server.page
        self._begin("text/event-stream")
        try:
            with page.changed:
                track = json.dumps(page.track)
            self._event("track", track)
            seen = -1
            while (news := page.next_news(seen)) is not None:
                if news[0] == seen:
                    self.wfile.write(b":\n\n")
                else:
                    seen, text = news
                    self._event("news", text)
            self._event("over", "{}")
        except OSError:
            return  # the page was closed

    def _event(self, kind: str, text: str) -> None:
        self.wfile.write(f"event: {kind}\ndata: {text}\n\n".encode())
