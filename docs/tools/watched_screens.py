"""Pictures of screens as their tests have them: `python -m docs.tools.watched_screens docs/images/tui`.

Some are moments that are seldom met, made from the data of the tests; others are drawn from the kept snapshots.
`screens` takes those of a real run.
"""

import asyncio
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from textual.screen import Screen

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.batch_screen import BatchScreen
from benchbot.plugins.tui.jobs import Alive
from benchbot.plugins.tui.run_screen import RunScreen
from docs.tools.screens import draw
from tests.plugins.tui import golden
from tests.plugins.tui.moments import MOMENTS
from tests.plugins.tui.watched import StillBatch, StillFeed, batch_view, run_view, surroundings

SIZE = (110, 34)
KEPT = "home"
"""The snapshot that is drawn as it is kept, at 120 × 40 cells on a dark terminal."""
ASKS = "Put the robot at its start pose, facing the door, and step back."


def main() -> None:
    """Take the pictures."""
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    taken: dict[str, str] = {}
    for name, (make, keys, size) in SHOWN.items():
        if name == "no-color":
            os.environ["NO_COLOR"] = "1"  # an app that begins takes it out again
        taken[name] = asyncio.run(_show(make(), keys, size))
    os.environ.pop("NO_COLOR", None)
    taken |= {name: asyncio.run(_moment(name)) for name in ("new-batch", "compare")}
    taken[KEPT] = golden.svg(golden.read(golden.SNAPSHOTS / f"{KEPT}.json.xz")["120x40 dark"])
    draw(taken, folder)


async def _moment(name: str) -> str:
    app = BenchbotApp(look=Alive)
    app.animation_level = "none"
    with pytest.MonkeyPatch.context() as patch:
        async with app.run_test(size=SIZE) as pilot:
            await MOMENTS[name](app, pilot, patch)
            await pilot.pause(1.0)
            return app.export_screenshot(simplify=True)


async def _show(screen: Screen[None], keys: tuple[str, ...], size: tuple[int, int]) -> str:
    app = BenchbotApp(look=Alive)
    app.animation_level = "none"
    async with app.run_test(size=size) as pilot:
        app.push_screen(screen)
        await pilot.pause(1.0)
        await pilot.press(*keys)
        await pilot.pause(1.0)
        return app.export_screenshot(simplify=True)


def _run(**progress: object) -> Callable[[], Screen[None]]:
    return lambda: RunScreen(StillFeed(run_view(progress=progress)), surroundings=surroundings)


def _batch() -> Screen[None]:
    return BatchScreen(StillBatch(batch_view(12, 56)))


SHOWN: dict[str, tuple[Callable[[], Screen[None]], tuple[str, ...], tuple[int, int]]] = {
    "classes": (_run(), ("c", "c", "t"), SIZE),
    "operator": (_run(waiting_for=ASKS), (), (90, 28)),
    "batch": (_batch, ("f", "f"), SIZE),
    "no-color": (_run(), ("c", "c", "t"), (90, 28)),
}


if __name__ == "__main__":
    main()
