"""The page in a real browser: every figure is drawn and nothing complains."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from headless import chromium

FIGURES = ["trajectory", "outages", "position", "velocity", "attitude", "imus", "innovations"]
MEASURE = """
const div = document.getElementById('plot-' + arguments[0]);
const box = div.querySelector('.main-svg').getBoundingClientRect();
const marks = [...div.querySelectorAll('.scatterlayer .trace, .barlayer .trace')];
const drawn = marks.filter(mark => mark.querySelector('path'));
return {width: box.width, height: box.height, drawn: drawn.length};
"""


@pytest.fixture(scope="module")
def browser(report: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with chromium(tmp_path_factory.mktemp("profile"), (1200, 900)) as driver:
        driver.get(report.as_uri())
        yield driver


def test_every_figure_is_drawn(browser):
    present = [div.get_attribute("id") for div in browser.find_elements("css selector", ".js-plotly-plot")]
    assert present == [f"plot-{name}" for name in FIGURES]
    for name in FIGURES:
        measured = browser.execute_script(MEASURE, name)
        assert measured["width"] > 900, name
        assert measured["height"] > 300, name
        assert measured["drawn"] >= 3, name


def test_the_menu_changes_what_is_shown(browser):
    click = "Plotly.restyle('plot-imus', {visible: arguments[0]})"
    menu = "return document.getElementById('plot-imus').layout.updatemenus[0].buttons[0].args[0].visible"
    before = browser.execute_script(MEASURE, "imus")["drawn"]
    browser.execute_script(click, browser.execute_script(menu))
    after = browser.execute_script(MEASURE, "imus")["drawn"]
    assert (before, after) == (6 * 12, 12)


def test_nothing_is_sent_away_and_no_button_offers_it(browser):
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    titles = [button.get_attribute("data-title") for button in browser.find_elements("css selector", ".modebar-btn")]
    assert titles
    assert not [title for title in titles if "hare" in title or "loud" in title]


def test_a_phone_does_not_scroll_sideways(browser):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.execute_async_script("setTimeout(arguments[0], 400)")
    assert browser.execute_script("return document.documentElement.scrollWidth") == 390
    assert browser.execute_script(MEASURE, "position")["width"] < 390
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_console_is_silent(browser):
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
