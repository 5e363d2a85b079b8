"""The screens that do what commands do look as they are kept: at every size, dark, light and without colour."""

from pathlib import Path

import pytest
from textual.pilot import Pilot

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.jobs import Alive
from tests.plugins.tui.moments import MOMENTS
from tests.plugins.tui.playing import SIZES, everywhere, matches, play, set_look


@pytest.mark.parametrize("name", [name for name in MOMENTS if name != "palette"])
def test_a_screen_looks_as_it_is_kept(name: str, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await MOMENTS[name](app, pilot, monkeypatch)
        await everywhere(app, pilot, name)

    play(BenchbotApp(look=Alive), scenario)


def test_the_palette_looks_as_it_is_kept(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        # One that is open while the theme changes keeps some colours of the theme before: each look opens its own.
        for look in ("light", "no-color", "dark"):
            set_look(app, look)
            await MOMENTS["palette"](app, pilot, monkeypatch)
            await matches(app, pilot, "palette", *SIZES)
            await pilot.press("escape")

    play(BenchbotApp(look=Alive), scenario)
