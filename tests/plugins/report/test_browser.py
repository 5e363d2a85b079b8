"""The page as a browser shows it."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from benchbot.plugins.report.rendering import render
from tests.browser import look, violations
from tests.plugins.report.conftest import Report
from tests.plugins.report.test_page import HOSTILE

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture
def page(report: Report, results: list[Path], frames: Path, tmp_path: Path) -> Path:
    path = tmp_path / "report.html"
    path.write_text(render(report(results, name=HOSTILE), "html"), "utf-8")
    return path


def test_the_page_opens_from_a_file_asks_for_nothing_and_runs_nothing(tab: Page, page: Path) -> None:
    asked: list[str] = []
    said: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))

    tab.goto(page.as_uri())

    assert [url for url in asked if not url.startswith("data:")] == [page.as_uri()]
    assert said == []
    assert tab.title().startswith(HOSTILE[:20])
    assert tab.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
    # The style is in force although the page forbids everything but its own.
    assert tab.evaluate("getComputedStyle(document.querySelector('.score strong')).fontSize") != "16px"


@pytest.mark.parametrize("width", [1280, 390])
def test_it_fits_wide_and_narrow_windows_light_and_dark(tab: Page, page: Path, width: int) -> None:
    tab.goto(page.as_uri())
    brightness = {}
    for scheme in ("light", "dark"):
        look(tab, width, scheme)
        shown = np.asarray(Image.open(io.BytesIO(tab.screenshot(full_page=True))).convert("L"), float)
        assert shown.std() > 5
        brightness[scheme] = shown.mean()

    assert brightness["light"] > 200 > 80 > brightness["dark"]
    assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_that_keeps_anybody_out(tab: Page, page: Path, scheme: str) -> None:
    """WCAG 2.1 AA and best practice, contrast included, everything unfolded."""
    tab.goto(page.as_uri())
    look(tab, 1280, scheme)
    tab.evaluate("document.querySelectorAll('details').forEach(details => { details.open = true })")

    assert violations(tab) == []


def test_it_is_used_with_a_keyboard(tab: Page, page: Path) -> None:
    tab.goto(page.as_uri())
    reached = []
    for _ in range(4):
        tab.keyboard.press("Tab")
        reached.append(tab.evaluate("document.activeElement.textContent"))

    assert reached[:3] == ["Skip to the result", "Result", "By environment"]


def test_it_is_printed(tab: Page, page: Path) -> None:
    tab.goto(page.as_uri())
    look(tab, 1280, "dark")

    assert tab.pdf().startswith(b"%PDF-")
    tab.emulate_media(media="print", color_scheme="dark")
    assert tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert tab.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
