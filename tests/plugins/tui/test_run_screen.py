"""Snapshots and keys of the screen that watches a run."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from textual.pilot import Pilot

from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.jobs import Alive
from benchbot.plugins.tui.run_screen import RunScreen
from benchbot.plugins.watching.views import RunView
from tests.plugins.tui.playing import SIZES, Scenario, everywhere, matches, play, sees, settled, shown, until
from tests.plugins.tui.watched import STATE, StillFeed, run_view, surroundings


@pytest.fixture(autouse=True)
def _in_greenwich(home: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A log shows local times."""
    with monkeypatch.context() as patch:
        patch.setenv("TZ", "UTC")
        time.tzset()
        yield
    time.tzset()


def watch(screen: RunScreen, scenario: Scenario, size: tuple[int, int] = SIZES[0]) -> None:
    async def watched(app: BenchbotApp, pilot: Pilot[None]) -> None:
        app.push_screen(screen)
        await until(pilot, lambda: screen._scenery.fetched > 0 and screen._fetched == screen._scenery.fetched)
        await scenario(app, pilot)

    play(BenchbotApp(look=Alive), watched, size)


def screen_of(view: RunView, **more: object) -> tuple[StillFeed, RunScreen]:
    feed = StillFeed(view)
    return feed, RunScreen(feed, surroundings=surroundings, **more)  # type: ignore[arg-type]


def test_a_run_looks_well_in_every_size_with_its_picture_and_its_map() -> None:
    feed, screen = screen_of(run_view())

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await everywhere(app, pilot, "run")
        assert feed.chosen[0][0] == ("image_rgb", "laser", "poses")

        # What the robot sees otherwise, with what is really there; and a closer look.
        await pilot.press("c", "c", "t")
        await sees(pilot, "with the truth", "classes")
        await matches(app, pilot, "run-classes", (120, 40))
        assert feed.chosen[-1][0] == ("image_segment", "laser", "poses", "image_rgb")
        await pilot.press("c", "c", "plus", "plus", "T")
        await sees(pilot, "2×", "depth")
        await matches(app, pilot, "run-light", (120, 40))
        await pilot.press("T", "T", "T", "T", "0")

        # In a terminal of no size at all it shows what it can, and does not fall over.
        for size in ((20, 5), (1, 1), (40, 10)):
            await pilot.resize_terminal(*size)
            await settled(pilot)
        assert "RUNNING" in shown(pilot)

    watch(screen, scenario)


def test_what_matters_most_is_large_and_in_words() -> None:
    asks = run_view(progress={"waiting_for": "Put the robot at its start pose, facing the door, and step back."})
    feed, screen = screen_of(asks, report=lambda path: None, again=lambda state: None)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "THE ROBOT ASKS YOU")
        await matches(app, pilot, "run-operator", (80, 24))
        feed.view = run_view()
        await pilot.press("d", "d")
        await sees(pilot, "DRIVEN BY HAND", "w a s d")
        await pilot.press("full_stop")
        await sees(pilot, "0.5 m, 30°")
        await matches(app, pilot, "run-by-hand", (80, 24))
        await pilot.press("x")
        await sees(pilot, "only stop watching")
        await pilot.press("escape", "escape")
        await until(pilot, lambda: "DRIVEN BY HAND" not in shown(pilot))

        # Nothing newer comes: it is said, and what was seen stays. Then the run has ended, badly.
        feed.view = replace(run_view(), problem="The supervisor does not answer.")
        await sees(pilot, "OUT OF TOUCH", "What is shown may be old.")
        feed.view = run_view(
            alive=False, progress={"failure": "collision", "failure_why": "The robot hit something during move_next."}
        )
        await sees(pilot, "ENDED: collision", "The robot hit something")
        feed.view = run_view(alive=False, problem="The run has ended.", result=Path("/home/ann/result.json"))
        await sees(pilot, "Its result is in")
        await matches(app, pilot, "run-ended", (80, 24))
        # Before anything is known, that is said, too.
        feed.view = RunView(STATE, alive=True, problem="Nothing is known yet.", session={}, progress={})
        await sees(pilot, "CONNECTING", "Nothing is known yet.")

    watch(screen, scenario)


def test_without_colour_pictures_and_maps_are_characters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    _, screen = screen_of(run_view())

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        assert app.no_color
        await matches(app, pilot, "run-no-color", (80, 24))
        await pilot.press("c", "c", "t")
        await sees(pilot, "C chair", "B book")
        assert "▀" not in shown(pilot)

    watch(screen, scenario)


def test_a_screen_that_shows_no_news_paints_nothing_and_news_at_most_ten_times_a_second() -> None:
    feed, screen = screen_of(run_view())

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await settled(pilot)
        painted: list[object] = []
        original = screen._cameras[0]._box.render_line
        screen._cameras[0]._box.render_line = lambda y: painted.append(y) or original(y)  # type: ignore[func-returns-value,method-assign]
        feed.view = replace(feed.view, progress={**feed.view.progress, "wall_time_s": 99.0})
        await sees(pilot, "1:39 min")
        assert painted == []

    watch(screen, scenario)


def test_who_wants_no_pictures_has_none_fetched() -> None:
    feed, screen = screen_of(run_view(), images="none")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "No pictures are shown")
        assert feed.chosen[0][0] == ("laser", "poses")

    watch(screen, scenario)
