"""Fixtures of a browser: Debian's Chromium, driven by playwright, one for each module and a profile for each test."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

NAMES = ("chromium", "chromium-browser", "chromium-headless-shell", "google-chrome", "google-chrome-stable", "chrome")
PATIENCE_MS = 60_000
FLAGS = (
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    # Whatever it would like to look up, it finds nothing.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)
# WebGL without a GPU. All that is drawn goes through it then, at a tenth of the speed.
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@contextmanager
def launched(*, webgl: bool = True) -> Iterator["Browser"]:
    """Run a headless browser; what is expected of its pages may take a while on a busy machine."""
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        flags = [*FLAGS, *(SOFTWARE_GL if webgl else ())]
        browser = playwright.chromium.launch(executable_path=_executable(), args=flags, chromium_sandbox=False)
        yield browser
        browser.close()


# Not for the session: as long as playwright runs, its thread has an event loop, and other tests need one of their own.
@pytest.fixture(scope="module")
def browser() -> Iterator["Browser"]:
    """Yield a browser."""
    with launched() as browser:
        yield browser


@pytest.fixture
def tab(browser: "Browser") -> Iterator["Page"]:
    """Yield an empty page of a new profile, 1280 pixels wide."""
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        context.set_default_timeout(PATIENCE_MS)
        yield context.new_page()


def look(tab: "Page", width: int, scheme: Any) -> None:
    """Make the window so wide, in pixels, and prefer a colour scheme: `light` or `dark`."""
    tab.set_viewport_size({"width": width, "height": 900})
    tab.emulate_media(color_scheme=scheme)


def violations(tab: "Page") -> list[tuple[str, str]]:
    """Return what axe finds wrong with a page, by WCAG 2.1 AA and best practice: rule and element."""
    source = (files("axe_core_python") / "axe.min.js").read_text("utf-8")
    tab.evaluate(f"() => {{ {source}; }}")
    found = tab.evaluate("axe.run().then(({ violations, passes }) => ({ violations, passed: passes.length }))")
    assert found["passed"] > 10
    return [(rule["id"], node["html"]) for rule in found["violations"] for node in rule["nodes"]]


def _executable() -> str:
    for name in NAMES:
        found = shutil.which(name)
        if found is not None:
            return found
    raise AssertionError(f"This test needs a browser, one of {', '.join(NAMES)}: apt-get install chromium")
