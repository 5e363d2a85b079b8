"""The screens that do what commands do look as they are kept: at every size, dark, light and without colour."""

from pathlib import Path

import pytest
from textual.pilot import Pilot

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.jobs import Alive
from tests.plugins.tui.moments import MOMENTS
from tests.plugins.tui.playing import everywhere, play


@pytest.mark.parametrize("name", MOMENTS)
def test_a_screen_looks_as_it_is_kept(name: str, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await MOMENTS[name](app, pilot, monkeypatch)
        await everywhere(app, pilot, name)

    play(BenchbotApp(look=Alive), scenario)
