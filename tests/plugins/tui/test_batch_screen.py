"""Snapshots and keys of the screen that watches a batch."""

from dataclasses import replace
from pathlib import Path

import pytest
from textual.pilot import Pilot

from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.batch import solution_axis
from benchbot.plugins.batch.extension import extended
from benchbot.plugins.batch.folder import Folder, prepare
from benchbot.plugins.batch.status import Score
from benchbot.plugins.tui import batch_facts
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.batch_screen import BatchScreen
from benchbot.plugins.tui.jobs import Alive
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.views import BatchView, EpisodeCell
from tests.plugins.tui.playing import SIZES, Scenario, everywhere, matches, play, sees, settled, shown, until
from tests.plugins.tui.watched import StillBatch, batch_view


def watch(screen: BatchScreen, scenario: Scenario, size: tuple[int, int] = SIZES[0]) -> None:
    async def watched(app: BenchbotApp, pilot: Pilot[None]) -> None:
        app.push_screen(screen)
        await scenario(app, pilot)

    play(BenchbotApp(look=Alive), watched, size)


def test_a_batch_looks_well_in_every_size_and_its_episodes_are_found_by_keys(home: Path) -> None:
    view = replace(batch_view(8, 100), folder=home / "lights")
    feed = StillBatch(batch_view(8, 100))
    watched: list[EpisodeCell] = []
    screen = BatchScreen(feed, open_run=watched.append, go_on=lambda folder: None)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "room:8")
        await everywhere(app, pilot, "batch")

        # The cursor walks; the line below says on what it is.
        await pilot.press("b", "home", "right", "right", "right", "down", "down")
        await sees(pilot, "room:2 · carter · seed 3")
        await pilot.press("f", "f", "F")
        chosen = screen._matrix.chosen
        assert chosen is not None
        assert chosen.state == "collision"
        await sees(pilot, f"collision on {chosen.worker}")
        await matches(app, pilot, "batch-letters", (80, 24))

        # So it does by the mouse: below the head and the two lines of the first room, right of the names.
        await pilot.click("Matrix", offset=(len("room:8 ") + 3, 1 + 2))
        await sees(pilot, "room:2 · carter · seed 3")
        await pilot.press("f", "f", "F")

        # The log of what failed, with nothing in it that would command this terminal.
        feed.view = view
        attempt = Folder(view.folder).episode(chosen.name) / "attempt-1"
        attempt.mkdir(parents=True)
        (attempt / "log.txt").write_text("Traceback\n\x1b[2JKeyError: 'chair'\n")
        await pilot.press("enter")
        await sees(pilot, "KeyError: 'chair'", "attempt-1", chosen.name)
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is screen)

        # A live run of an episode is opened; of the others there is none.
        await pilot.press("w")
        assert watched == []
        await pilot.press("end", "home", "pagedown", "up", "up", "up", *["right"] * 50)
        running = next(cell for cell in view.cells if cell.state == "running")
        place = screen._matrix._grid.position[view.cells.index(running)]
        screen._matrix._go(*place)
        await sees(pilot, f"running on {running.worker} for 12 s")
        await pilot.press("w")
        assert watched == [running]

        for size in ((20, 5), (1, 1), (40, 10)):
            await pilot.resize_terminal(*size)
            await settled(pilot)
        assert "RUNNING" in shown(pilot)

    watch(screen, scenario)


def test_what_failed_is_tried_again_and_workers_are_ended_only_when_one_means_it(home: Path) -> None:
    feed = StillBatch(batch_view(3, 10))
    going_on: list[Path] = []
    screen = BatchScreen(feed, go_on=going_on.append)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "room:3")
        await pilot.press("r")
        await sees(pilot, "all that failed")
        await matches(app, pilot, "batch-retry")
        await pilot.press("1")
        await until(pilot, lambda: feed.retried == [("agent",)])
        await pilot.press("r", "a")
        await until(pilot, lambda: len(feed.retried) == 2)
        assert set(feed.retried[1]) == set(feed.view.status.failures if feed.view.status else ())
        await pilot.press("r", "escape", "g")  # while it runs, there is nothing to go on with
        await pilot.press("x")
        await sees(pilot, "End all workers of this batch?")
        await pilot.press("escape", "x", "x")
        await sees(pilot, "NOBODY WORKS")
        await pilot.press("g")
        assert going_on == [feed.view.folder]

        feed.view = replace(feed.view, problem="Its folder is gone.")
        await sees(pilot, "OUT OF TOUCH", "Its folder is gone.")
        feed.view = batch_view(3, 10, finished=1.0)
        await sees(pilot, "✗ 8 OF 30 FAILED")
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is not screen)

    watch(screen, scenario)


def test_a_thousand_episodes_are_painted_only_where_they_change(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    feed = StillBatch(batch_view(10, 100))
    screen = BatchScreen(feed)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "100 episodes each")
        await matches(app, pilot, "batch-no-color", (80, 24))
        await pilot.press("b")
        await settled(pilot)
        matrix = screen._matrix
        painted: list[int] = []
        signs = matrix._signs
        monkeypatch.setattr(matrix, "_signs", lambda row: painted.append(row) or signs(row))  # type: ignore[func-returns-value]
        assert feed.view.status is not None
        # Every cell stays as it is; what else there is to say is painted.
        feed.view = replace(feed.view, status=replace(feed.view.status, left_s=99.0), cells=(*feed.view.cells,))
        await sees(pilot, "99 s left")
        assert painted == []
        cells = list(feed.view.cells)
        cells[250] = replace(cells[250], state="timeout")
        feed.view = replace(feed.view, cells=tuple(cells))
        await until(pilot, lambda: bool(painted))
        assert set(painted) == {4}  # the first of the two lines of room:3

    watch(screen, scenario)


def test_before_a_batch_has_been_read_its_screen_says_so(home: Path) -> None:
    nothing = BatchView(home / "lights", alive=False, problem="Nothing is known yet.", status=None)
    feed = StillBatch(nothing)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "READING", "Nothing is known yet.")
        await pilot.press("enter", "down", "f", "r", "x", "g", "m", "w")
        feed.view = batch_view(2, 5)
        await sees(pilot, "room:2")
        assert "Nothing is known yet." not in shown(pilot)

    watch(BatchScreen(feed), scenario)


def test_a_high_pace_is_written_as_people_write_numbers() -> None:
    view = batch_view(2, 4)
    assert view.status is not None
    fast = replace(view, status=replace(view.status, rate_per_hour=12_900.4))

    assert ("An episode", "41 s, 12900 per hour") in batch_facts.numbers(fast)
    assert "12900 per hour" in batch_facts.compact(fast)


def test_episodes_are_a_table_that_is_sorted_and_filtered_and_scores_a_map(home: Path) -> None:
    view = batch_view(4, 20)
    cells = [replace(cell, solution=("left", "right")[index % 2]) for index, cell in enumerate(view.cells)]
    cells[0] = replace(cells[0], setting="lights dim")
    scores: dict[str | None, Score] = {"left": Score("OMQ", 0.41, 24, 0.39, 0.43), "right": Score("OMQ", 0.32, 24)}
    screen = BatchScreen(StillBatch(replace(view, cells=tuple(cells), scores=scores)))

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "left: OMQ 0.410 [0.390, 0.430] of 24 results")
        await pilot.press("m")
        await sees(pilot, "State↑", "Attempts", "by state ↑")
        assert "Setting" in [column.title for column in screen._table.columns]
        await everywhere(app, pilot, "batch-table")
        table = screen._table
        failed = [cell for cell in cells if cell.state not in ("done", "pending", "running")]
        assert {cell.name for cell in table.shown[: len(failed)]} == {cell.name for cell in failed}
        await pilot.press("greater_than_sign")
        await sees(pilot, "by score ↓")
        best = max(cell.score for cell in cells if cell.score is not None)
        assert table.shown[0].score == best
        assert table.shown[-1].score is None
        await pilot.press("less_than_sign", "end", "home", "j", "k")
        await sees(pilot, "by score ↑")
        await pilot.press("slash", *"room:2 left", "enter")
        await sees(pilot, "10 of 80 with “room:2 left”")
        await pilot.press("f")
        assert table.chosen is not None
        assert table.chosen.state in ("collision", "timeout", "agent", "platform", "infrastructure")
        await pilot.click("EpisodeTable", offset=(20, 0))
        await sees(pilot, "by score ↓")
        await pilot.press("m")
        await sees(pilot, "Mean scores", "left · carter")
        await everywhere(app, pilot, "batch-heat")
        await pilot.press("m")
        await sees(pilot, "room:4")

    watch(screen, scenario)


@pytest.mark.parametrize("columns", [1000])
def test_many_episodes_of_one_environment_fill_the_screen(columns: int, home: Path) -> None:
    screen = BatchScreen(StillBatch(batch_view(1, columns)))

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "70 a line")
        rows = [line for line in shown(pilot).splitlines() if line.startswith("│") and line.count("✓") > 20]
        assert len(rows) > 5
        bar = shown(pilot).splitlines()[1]
        assert len(bar) <= SIZES[0][0]

    watch(screen, scenario)


def test_seeds_are_added_and_whoever_watches_sees_the_new_episodes(home: Path, catalog: Catalog) -> None:
    wanted = {"task": "sample:passive", "robots": "sample_robot", "environments": "arena:1", "seeds": "0..1"}
    Path("a.py").touch()
    plan, _ = solution_axis.plan(solution_axis.each({**wanted, "native": "python a.py"}), catalog, Path.cwd())
    folder = Folder(home / "work" / "b")
    prepare(folder, plan)
    screen = BatchScreen(BatchFeed(folder.path, period_s=0.05))

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "0 of 2")
        await pilot.press("A")
        await sees(pilot, "2 episodes + 2 seeds × 1 = 4 episodes", "$ benchbot batch extend", "--seeds=2..3")
        await pilot.press(*["backspace"] * 4, "0")
        await sees(pilot, "2 episodes + 0 seeds")
        await pilot.press("ctrl+t")
        await sees(pilot, "There is no seed to add.", "→ Name others: --seeds 2..3")
        await pilot.press("backspace", *"2..5")
        await pilot.press("ctrl+t")
        await sees(pilot, "Nothing is in the way: 6 episodes, 0 of them done.")
        prepare(folder, extended(plan, [2, 3, 4, 5], catalog), update=True)
        await pilot.press("escape")
        await sees(pilot, "0 of 6")

    watch(screen, scenario, (100, 30))
