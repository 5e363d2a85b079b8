"""Pictures of the screens of `benchbot tui`: `python -m docs.tools.screens docs/images/tui`, then `watched_screens`.

A real submission is started, watched and evaluated by keys, in a home of its own; Chromium draws what Textual exports.
"""

import asyncio
import io
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from PIL import Image
from textual.pilot import Pilot
from textual.widgets import Input, OptionList, Select

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.jobs import WELL
from tests.browser import launched

COLUMNS, LINES, FEW_LINES = 110, 34, 16
PATIENCE_S = 300.0
SCALE = 0.8
TASK, ROBOT, ENVIRONMENT = "semantic_slam:passive:ground_truth:segmentation", "carter", "miniroom:1"
OTHERS = {
    "broken": ["--native=false", f"--robot={ROBOT}"],
    "empty": ["--example=hello_passive", f"--robot={ROBOT}"],
    "lowres": ["--example=segmentation_mapper", "--robot=carter_lowres"],
    "short": ["--example=segmentation_mapper", f"--robot={ROBOT}", "--max-steps=12"],
}
"""Submissions beside the one that is watched, by the folders of their results."""
LARGEST_BYTES = 45_000
LOOKED_AT = 12
"""How many observations there are when the run is pictured."""


def main() -> None:
    """Take the pictures."""
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    taken: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="benchbot-") as home:
        os.environ["BENCHBOT_STATE_DIR"] = str(Path(home, "state"))
        Path(home, "work").mkdir()
        os.chdir(Path(home, "work"))
        asyncio.run(_play(lambda app, name: taken.update({name: app.export_screenshot(simplify=True)})))
    draw(taken, folder)


async def _play(take: Callable[[BenchbotApp, str], None]) -> None:
    app = BenchbotApp()
    app.animation_level = "none"
    async with app.run_test(size=(COLUMNS, LINES), notifications=True) as pilot:
        await pilot.press("n")
        for names in ((TASK,), (ROBOT,), (ENVIRONMENT, "office:1")):
            await _choose(app, pilot, names, take)
        app.screen.query_one("#solution", Select).value = "segmentation_mapper"
        app.screen.query_one("#result", Input).value = "results/result.json"
        await pilot.pause(0.5)
        take(app, "start")
        await pilot.press("ctrl+s")
        await _until(pilot, lambda: bool(app.alive.runs) and "RunScreen" in type(app.screen).__name__)
        feed = getattr(app.screen, "feed")  # noqa: B009 - the screen's own, of whichever kind it is
        await _until(pilot, lambda: feed.view.progress.get("frames", 0) >= LOOKED_AT)
        app.clear_notifications()
        await pilot.pause(0.5)
        take(app, "run")
        await pilot.press("escape")
        await _until(pilot, lambda: "HomeScreen" in type(app.screen).__name__)
        await _until(pilot, lambda: not app.alive.runs and app.alive.jobs[0].state == WELL)
        await asyncio.to_thread(_submit_others)
        app.clear_notifications()
        await pilot.resize_terminal(COLUMNS, FEW_LINES)
        await pilot.press("R")
        await _until(pilot, lambda: len(getattr(app.screen, "rows", ())) == 1 + len(OTHERS))
        await pilot.press("end", "k")
        await pilot.pause(0.5)
        take(app, "results")
        await pilot.resize_terminal(COLUMNS, LINES)
        await pilot.press("i")
        await _until(pilot, lambda: "TextScreen" in type(app.screen).__name__)
        await pilot.pause(0.5)
        take(app, "explain")


def _submit_others() -> None:
    for name, words in OTHERS.items():
        selected = [f"--task={TASK}", f"--env={ENVIRONMENT}", f"--results-location=results/{name}/result.json"]
        command = [sys.executable, "-m", "benchbot", "submit", *words, *selected, "--evaluate-with=omq"]
        subprocess.run(command, check=False, stdin=subprocess.DEVNULL)


async def _choose(
    app: BenchbotApp, pilot: Pilot[None], names: tuple[str, ...], take: Callable[[BenchbotApp, str], None]
) -> None:
    """Choose the first of the names in the list that is shown; take a picture with the last one marked."""
    for name in reversed(names):
        screen = app.screen
        options = screen.query_one(f"#list-{getattr(screen, 'step')}", OptionList)  # noqa: B009
        while not any(option.id == name for option in options.options):
            await pilot.pause(0.1)
        options.highlighted = [option.id for option in options.options].index(name)
        await pilot.pause(1.0)
        if name == names[-1] and name != TASK:
            take(app, getattr(screen, "step"))  # noqa: B009
    await pilot.press("enter")
    await pilot.pause(0.5)


async def _until(pilot: Pilot[None], condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline_s:
            raise TimeoutError(pilot.app.export_screenshot())
        await pilot.pause(0.1)


def draw(taken: Mapping[str, str], folder: Path) -> None:
    """Draw screens, as Textual exports them, into PNG files of their names."""
    with launched() as browser, tempfile.TemporaryDirectory() as exported:
        tab = browser.new_page()
        for name, drawn in taken.items():
            text = re.sub(r"@font-face \{.*?\}", "", drawn, flags=re.DOTALL).replace("Fira Code", "DejaVu Sans Mono")
            width, height = (float(number) for number in re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)[0])
            source = Path(exported, f"{name}.svg")
            source.write_text(text, "utf-8")
            tab.set_viewport_size({"width": round(width * SCALE), "height": round(height * SCALE)})
            tab.goto(source.as_uri())
            with Image.open(io.BytesIO(tab.screenshot())) as picture:
                # Few colours are on a screen: a palette of them is a third of the size, and less where all is text.
                for count in (200, 48, 16):
                    quantized = picture.convert("RGB").quantize(count, dither=Image.Dither.NONE)
                    quantized.save(folder / f"{name}.png", optimize=True)
                    if (folder / f"{name}.png").stat().st_size <= LARGEST_BYTES:
                        break


if __name__ == "__main__":
    main()
