"""Drives the app by keys, and waits until its screen shows something."""

import asyncio
import time
from collections.abc import Awaitable, Callable

from textual.filter import Monochrome
from textual.pilot import Pilot

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.camera import CameraPanel
from benchbot.plugins.tui.map_panel import MapPanel
from tests.plugins.tui import golden

PATIENCE_S = 90.0
SIZES = ((80, 24), (120, 40), (200, 60))

Scenario = Callable[[BenchbotApp, Pilot[None]], Awaitable[None]]


def play(app: BenchbotApp, scenario: Scenario, size: tuple[int, int] = SIZES[0]) -> None:
    """Run the app without a terminal, and the scenario in it."""

    async def played() -> None:
        app.animation_level = "none"
        async with app.run_test(size=size, notifications=True) as pilot:
            await scenario(app, pilot)

    asyncio.run(played())


async def until(pilot: Pilot[None], condition: Callable[[], bool], what: str = "") -> None:
    """Wait until something is so."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, f"{what or 'It'} never came:\n{shown(pilot)}"
        await pilot.pause(0.02)


async def sees(pilot: Pilot[None], *texts: str) -> None:
    """Wait until the screen shows all of these."""
    for text in texts:
        await until(pilot, lambda text=text: text in shown(pilot), repr(text))  # type: ignore[misc]


def shown(pilot: Pilot[None]) -> str:
    """Return the text on the screen."""
    return "\n".join(golden.lines(golden.cells(pilot.app)))


async def everywhere(app: BenchbotApp, pilot: Pilot[None], name: str) -> None:
    """Compare the screen with what is kept, at each of `SIZES`: dark, light and without colour."""
    for look in ("light", "no-color", "dark"):
        set_look(app, look)
        await matches(app, pilot, name, *SIZES)


def set_look(app: BenchbotApp, look: str) -> None:
    """Show the app from now on as a `light` or `dark` one, or as `NO_COLOR` has it from its start on."""
    app._filters[:] = [each for each in app._filters if not isinstance(each, Monochrome)]
    app.no_color = look == "no-color"
    if app.no_color:
        app._filters.append(Monochrome())
    app.theme = "textual-light" if look == "light" else "textual-dark"
    app.refresh_css(animate=False)
    for screen in app.screen_stack:
        for widget in screen.walk_children(with_self=True):
            widget.notify_style_update()
            widget.refresh()
            if isinstance(widget, CameraPanel | MapPanel):
                widget.tell_legend()


async def matches(app: BenchbotApp, pilot: Pilot[None], name: str, *sizes: tuple[int, int]) -> None:
    """Compare the screen with what is kept, at each size."""
    before = (app.size.width, app.size.height)
    for width, height in sizes or (before,):
        await pilot.resize_terminal(width, height)
        await settled(pilot)
        golden.matches(app, name)
    await pilot.resize_terminal(*before)


async def settled(pilot: Pilot[None]) -> None:
    """Wait until the screen has stayed the same for a while."""
    last: golden.Cells = []
    same = 0
    while same < 4:
        await pilot.pause(0.05)
        now = golden.cells(pilot.app)
        same = same + 1 if now == last else 0
        last = now
