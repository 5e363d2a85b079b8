"""The page as a browser shows it."""

import io
import json
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchbot.plugins.report.rendering import render
from tests.plugins.report.chromium import Browser
from tests.plugins.report.conftest import Report
from tests.plugins.report.test_page import HOSTILE

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture
def page(report: Report, results: list[Path], frames: Path, tmp_path: Path) -> Path:
    path = tmp_path / "report.html"
    path.write_text(render(report(results, name=HOSTILE), "html"), "utf-8")
    return path


def test_the_page_opens_from_a_file_asks_for_nothing_and_runs_nothing(browser: Browser, page: Path) -> None:
    browser.open(page.as_uri())

    asked = [request["request"]["url"] for request in browser.said("Network.requestWillBeSent")]
    assert [url for url in asked if not url.startswith("data:")] == [page.as_uri()]
    assert browser.said("Log.entryAdded") == []
    assert browser.said("Runtime.consoleAPICalled") == []
    assert browser.said("Runtime.exceptionThrown") == []
    assert browser.evaluate("document.title").startswith(HOSTILE[:20])
    assert browser.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
    # The style is in force although the page forbids everything but its own.
    assert browser.evaluate("getComputedStyle(document.querySelector('.score strong')).fontSize") != "16px"


@pytest.mark.parametrize("width", [1280, 390])
def test_it_fits_wide_and_narrow_windows_light_and_dark(browser: Browser, page: Path, width: int) -> None:
    browser.open(page.as_uri())
    brightness = {}
    for scheme in ("light", "dark"):
        browser.look(width, scheme)
        shown = np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("L"), float)
        assert shown.std() > 5
        brightness[scheme] = shown.mean()

    assert brightness["light"] > 200 > 80 > brightness["dark"]
    assert browser.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_that_keeps_anybody_out(browser: Browser, page: Path, scheme: str) -> None:
    """WCAG 2.1 AA and best practice, contrast included, everything unfolded."""
    browser.open(page.as_uri())
    browser.look(1280, scheme)
    browser.evaluate("document.querySelectorAll('details').forEach(details => { details.open = true })")
    browser.evaluate(f"{(files('axe_core_python') / 'axe.min.js').read_text('utf-8')}; null")

    found = browser.evaluate("axe.run().then(result => JSON.stringify([result.violations, result.passes.length]))")

    violations, passed = json.loads(found)
    assert [(violation["id"], violation["nodes"][0]["html"]) for violation in violations] == []
    assert passed > 20


def test_it_is_used_with_a_keyboard(browser: Browser, page: Path) -> None:
    browser.open(page.as_uri())
    reached = []
    for _ in range(4):
        for kind in ("keyDown", "keyUp"):
            browser("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
        reached.append(browser.evaluate("document.activeElement.textContent"))

    assert reached[:3] == ["Skip to the result", "Result", "By environment"]


def test_it_is_printed(browser: Browser, page: Path) -> None:
    browser.open(page.as_uri())
    browser.look(1280, "dark")

    assert browser.pdf().startswith(b"%PDF-")
    browser("Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    assert browser.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
