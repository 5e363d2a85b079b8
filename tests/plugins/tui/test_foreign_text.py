"""What others have named, on the screens: nothing of it is markup, and nothing of it commands the terminal."""

import json
import unicodedata
from pathlib import Path

import yaml
from rich.control import Control
from rich.segment import Segment
from textual.color import Color
from textual.pilot import Pilot
from textual.widgets import Select

from benchbot.core.errors import BenchbotError
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.base import Harmless
from benchbot.plugins.tui.forms import SolutionForm, _set
from benchbot.plugins.tui.jobs import RUNNING, Alive, Job, JobStatus
from benchbot.plugins.tui.submissions import JobScreen, SubmitScreen
from tests.plugins.tui.playing import play, sees, settled, shown, until
from tests.plugins.tui.test_screens import run_of
from tests.plugins.tui.written import SAMPLE, write_results

HOSTILE = "[bold]x[/] [@click=app.quit]y[/] [/nonsense] \x1b]52;c;cm0=\x07\x9b2J\u202e0.9\u202c"
"""Markup that acts, markup that is broken, and commands to a terminal."""


def commands(app: BenchbotApp) -> list[str]:
    """Return the characters on the screen that no line may hold."""
    return [
        letter
        for strip in app.screen._compositor.render_strips()
        for segment in strip
        for letter in segment.text
        if not segment.control and unicodedata.category(letter) in ("Cc", "Cf", "Cs")
    ]


def test_names_of_others_are_shown_as_they_are_and_do_nothing(home: Path) -> None:
    log = home / "job"
    log.mkdir()
    job = Job(log, ("submit", f"--example={HOSTILE}", "--json"), 1, 0.0, Path("results/result.json"))
    job.log.write_text(f"solution | {HOSTILE}\nsolution | 10 %\r20 %\n")
    alive = Alive(runs=(run_of(HOSTILE, 0),), jobs=(JobStatus(job, RUNNING, HOSTILE),))
    app = BenchbotApp(look=lambda: alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "[bold]x[/] [@click=app.quit]y[/] [/nonsense]")
        app.notify(f"The run of {HOSTILE} is ending.")
        app.tell(BenchbotError(HOSTILE, HOSTILE, HOSTILE))
        await sees(pilot, "is ending")
        for screen in (SubmitScreen(alive.runs[0]), JobScreen(job)):
            app.push_screen(screen)
            await settled(pilot)
            assert "[bold]x[/]" in shown(pilot)
            assert commands(app) == []
        assert "\\u001b]52;c;cm0=\\u0007" in shown(pilot)

    play(app, scenario, (120, 40))


def test_results_with_hostile_names_are_rows_of_one_line(home: Path) -> None:
    folder = write_results(home / "work" / "results")
    details = yaml.safe_load((SAMPLE / "environments" / "arena_1.yaml").read_text())
    document = json.loads((folder / "perfect.json").read_text())
    document["environment_details"] = [{**details, "name": f"{HOSTILE}\nResult"}]
    (folder / "hostile.json").write_text(json.dumps(document))
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("R")
        await sees(pilot, "4 results.", "[bold]x[/] [@click")
        assert commands(app) == []
        await pilot.press("E")
        await until(pilot, lambda: "avg_pairwise" in shown(pilot))
        assert commands(app) == []

    play(app, scenario, (200, 60))


def test_choices_are_no_markup(home: Path) -> None:
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        app.push_screen(SubmitScreen(run_of("arena:1", 0)))
        await settled(pilot)
        solution = app.screen.query_one(SolutionForm).query_one("#solution", Select)
        _set(solution, [(HOSTILE, "hostile")])
        solution.value = "hostile"
        await settled(pilot)
        assert "[bold]x[/]" in shown(pilot)
        assert commands(app) == []

    play(app, scenario, (120, 40))


def test_a_line_keeps_its_cells() -> None:
    segments = Harmless().apply([Segment(f"a{HOSTILE}\ud800b")], Color(0, 0, 0))

    assert segments[0].text.startswith("a[bold]x[/]")
    assert segments[0].text.endswith("2J0.9?b")
    moving = Control.move_to(1, 1).segment
    assert Harmless().apply([moving], Color(0, 0, 0)) == [moving]
