"""The page in a real browser, while a recording is replayed at ten times its speed."""

import json
import re
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from headless import chromium

from polyins.live import page as live_page
from polyins.live import run as live_run
from polyins.live.snapshot import Snapshot

FAR = 30.0  # s
READ = """
const text = id => document.getElementById(id).textContent;
const ids = ['clock', 'roll', 'pitch', 'heading', 'latitude', 'longitude', 'height', 'north', 'east', 'std_north',
  'std_heading', 'fix_age', 'refused'];
return {status: text('status'), ...Object.fromEntries(ids.map(id => [id, text(id)])),
  imus: [...document.querySelectorAll('#imus tr')].map(row => [...row.cells].map(cell => cell.textContent))};
"""
PAINTED = """
const canvas = document.getElementById(arguments[0]);
const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
const colours = new Set();
for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 200) colours.add(data.slice(k, k + 3).join());
return [...colours];
"""
BLUE, ORANGE = "0,114,178", "213,94,0"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with chromium(tmp_path_factory.mktemp("profile"), (1300, 1000)) as driver:
        yield driver


def wait_for(value: Callable[[], Any]) -> Any:
    until = time.monotonic() + FAR
    while not (found := value()):
        assert time.monotonic() < until
        time.sleep(0.05)
    return found


def figures(shown: dict[str, Any]) -> dict[str, float]:
    return {key: float(re.sub(r"[^\d.-]", "", text)) for key, text in shown.items() if key not in ("status", "imus")}


def test_the_page_follows_a_replay(
    browser: Any, drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pages: list[live_page.Page] = []
    said: dict[str, dict[str, Any]] = {}

    class Watched(live_page.Page):
        """Keeps what it showed."""

        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            pages.append(self)

        def take(self, snapshot: Snapshot) -> None:
            super().take(snapshot)
            said[f"{snapshot.row['time_s']:.1f} s"] = json.loads(self.news)

    monkeypatch.setattr(live_run, "Page", Watched)
    options = live_run.Options(drive, tmp_path, sinks=(), speed=4.0, page=0)
    thread = threading.Thread(target=live_run.run, args=(options,))
    thread.start()
    browser.get(wait_for(lambda: pages)[0].url)
    wait_for(lambda: browser.execute_script("return document.body.dataset.time"))
    first = browser.execute_script(READ)
    wait_for(lambda: browser.execute_script(READ)["status"] == "dead reckoning")
    in_outage = browser.execute_script(READ)
    assert ORANGE in wait_for(lambda: set(browser.execute_script(PAINTED, "map")))
    wait_for(lambda: browser.execute_script(READ)["status"] == "navigating")
    second = browser.execute_script(READ)
    assert {BLUE, ORANGE} <= set(browser.execute_script(PAINTED, "map"))
    assert len(set(browser.execute_script(PAINTED, "horizon"))) > 3
    thread.join(FAR)
    assert wait_for(lambda: browser.execute_script(READ)["status"] == "stopped")
    assert first["clock"] != in_outage["clock"] != second["clock"]
    for shown in (first, in_outage, second):
        news = said[shown["clock"]]
        assert shown["status"] == news["status"]
        state, seen = news["state"], figures(shown)
        for name in ("roll", "pitch", "heading"):
            assert seen[name] == pytest.approx(state[f"{name}_deg"], abs=0.00501)
        for name in ("latitude", "longitude"):
            assert seen[name] == pytest.approx(state[f"{name}_deg"], abs=5.1e-7)
        for name in ("height", "north", "east"):
            assert seen[name] == pytest.approx(state[f"{name}_m"], abs=0.00501)
        assert seen["std_north"] == pytest.approx(state["std_north_m"], abs=0.000501)
        assert seen["std_heading"] == pytest.approx(state["std_heading_deg"], abs=0.00501)
        assert seen["fix_age"] == pytest.approx(news["fix_age_s"], abs=0.0501)
        assert seen["refused"] == news["refused"]
        for cells, imu in zip(shown["imus"], news["imus"], strict=True):
            assert cells[0] == imu["name"]
            numbers = [imu["gyro_residual_deg_s"], imu["accel_residual_m_s2"], imu["rate_hz"]]
            for cell, number in zip(cells[1:], numbers, strict=True):
                assert float(cell) == pytest.approx(number, abs=0.051)
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    outside = "return performance.getEntriesByType('resource').filter(r => !r.name.startsWith(location.origin)).length"
    assert browser.execute_script(outside) == 0
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    assert browser.execute_script("return document.documentElement.scrollWidth") == 390
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_what_is_served_before_a_start() -> None:
    served = live_page.Page("127.0.0.1", 0, lambda: {"status": "looking for a start: no data", "refused": 3})
    try:
        with urllib.request.urlopen(served.url) as answer:
            html = answer.read().decode()
        assert not re.findall(r"(?:src|href)=\"?https?:", html)
        with urllib.request.urlopen(served.url + "events") as stream:
            served.tell()
            text = b"".join(stream.readline() for _ in range(6)).decode()
        assert "event: track\ndata: []" in text
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(served.url + "../secret")
    finally:
        served.close()


def test_a_long_track_is_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_page, "TRACK", 100)
    served = live_page.Page("127.0.0.1", 0, dict)

    class Row:
        dead_reckoning = False

        def __init__(self, north: float) -> None:
            self.row = {"north_m": north, "east_m": 0.0}

    for k in range(1000):
        served.take(Row(float(k)))
    served.close()
    norths = [point[0] for point in served.track]
    assert 50 <= len(norths) <= 100
    assert norths == sorted(norths)
    assert norths[-1] > 950.0
