"""The shell's screens, played by keys. Their pictures are in `snapshots`."""

from pathlib import Path

import pytest
from textual.pilot import Pilot
from textual.widgets import Input, Select

from benchbot.core import plugin_manager
from benchbot.plugins.tui import jobs
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.dialogs import HelpScreen
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.jobs import BADLY, RUNNING, WELL, Alive, Job, JobStatus
from benchbot.plugins.tui.new_run import NewRunScreen
from benchbot.plugins.tui.results import ResultsScreen
from benchbot.plugins.tui.submissions import JobScreen, SubmitScreen
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire.run_state import Connection, RunState
from tests.plugin_factory import PluginFactory
from tests.plugins.tui.playing import everywhere, matches, play, sees, until
from tests.plugins.tui.written import write_results

FUTURE_S = 1e12
TOWNS = """
from pathlib import Path
from benchbot.plugin import EnvironmentSet, hookimpl

def make(number):
    folder = Path(__file__).parent / "made" / str(number)
    (folder / "environments").mkdir(parents=True, exist_ok=True)
    about = f"name: town_{number}\\nvariant: 1\\ntype: sim_sample\\ndescription: Town number {number}.\\n"
    about += "map_path: arena_1.yaml\\nstart_pose: [1, 0, 0, 0, -2, 0, 0]\\n"
    about += "trajectory_poses: [[1, 0, 0, 0, -1, 0, 0]]\\n"
    (folder / "environments" / f"town_{number}_1.yaml").write_text(about)
    return folder

@hookimpl
def benchbot_environment_sets():
    yield EnvironmentSet("town", 3, make)
"""
WORDS = (
    "submit",
    "--example=hello_passive",
    "--json",
    "--task=sample:passive",
    "--robot=sample_robot",
    "--env=arena:1",
)


def run_of(environment: str, number: int) -> RunState:
    return RunState(
        connection=Connection(f"http://127.0.0.1:{10000 + number}", None, "token"),
        operator_token="operator",
        pid=4000 + number,
        task="semantic_slam:passive:ground_truth",
        robot="carter",
        environment=environment,
        seed=number,
        folder=f"/home/ann/runs/20260301-12000{number}-ab",
        platform_log="platform.log",
        supervisor_log="supervisor.log",
        result="result.json",
        started_s=FUTURE_S,  # so that it is 0 s old, whenever this is run
    )


def job_of(name: str, folder: Path = Path("/home/ann/jobs")) -> Job:
    return Job(folder / name, WORDS, 1, 0.0, Path("results/result.json"))


ALIVE = Alive(
    runs=(run_of("miniroom:1", 0), run_of("house:2:3", 1)),
    batches=(
        BatchEntry(Path("/home/ann/study/lights"), True, 0.0, 1000, 120),
        BatchEntry(Path("/home/ann/study/seeds"), False, 0.0, 40, 40, {"agent": 2, "timeout": 1}),
        BatchEntry(Path("/home/ann/study/broken"), False, 0.0, 2, 2, {"platform": 2}),
    ),
    jobs=(
        JobStatus(job_of("3"), RUNNING, "running"),
        JobStatus(job_of("2"), WELL, "OMQ 0.7312"),
        JobStatus(job_of("1"), BADLY, "The solution failed."),
    ),
)


def test_the_first_screen_says_what_is_alive_and_what_to_do_when_nothing_is(home: Path) -> None:
    now = [Alive()]
    app = BenchbotApp(look=lambda: now[0])

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "No run and no batch")
        await matches(app, pilot, "home-empty")
        for key in ("enter", "s", "x", "right_square_bracket"):  # of nothing there is nothing to watch or end
            await pilot.press(key)
        assert isinstance(app.screen, HomeScreen)
        app.clear_notifications()
        now[0] = ALIVE
        app.look()
        await sees(pilot, "miniroom:1", "120 of 1000", "OMQ 0.7312", "◐ seeds", "✗ broken", "2 of 2, ✗ 2 failed")
        await everywhere(app, pilot, "home")
        await pilot.press("down", "down")
        await sees(pilot, "120 of 1000 are finished")
        app.look()
        await pilot.press("x")
        await sees(pilot, "Open the batch")
        await pilot.press("up", "x")
        await sees(pilot, "End the run of house:2:3?")
        app.clear_notifications()
        await matches(app, pilot, "question")
        await pilot.press("z", "escape")
        now[0] = Alive(jobs=(JobStatus(job_of("3"), WELL, "OMQ 0.5000"),))
        app.look()
        await sees(pilot, "Ended: hello_passive")
        assert isinstance(app.screen, HomeScreen)

    play(app, scenario)


def test_keys_are_explained_and_the_light_can_be_switched_on(home: Path) -> None:
    app = BenchbotApp(look=lambda: ALIVE)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "miniroom:1")
        await pilot.press("T")
        assert app.theme == "textual-light"
        await pilot.press("T")
        await sees(pilot, "miniroom:1")
        await pilot.press("question_mark")
        await everywhere(app, pilot, "help")
        await sees(pilot, "Here, now", "Quit; what runs goes on", "Everywhere")
        assert isinstance(app.screen, HelpScreen)
        await pilot.press("question_mark")
        assert isinstance(app.screen, HomeScreen)

    play(app, scenario)


def test_an_environment_of_a_set_is_chosen_by_its_name_and_made_then(
    home: Path, plugin_factory: PluginFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = plugin_factory.make("acme-towns", TOWNS)
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample,acme-towns")
    plugin_manager.load.cache_clear()
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("n")
        await sees(pilot, "sample:passive")
        await pilot.press("slash", *"passive", "enter")
        await sees(pilot, "sample_robot")
        await pilot.press("enter")
        await sees(pilot, "arena:1", "town_1:1 to town_3:1: / and its name")
        assert not (package / "made").exists()
        await pilot.press("slash", *"town_4", "enter")
        await sees(pilot, "'town_4:1' is not a")
        app.clear_notifications()
        await pilot.press("backspace", "2", "enter")
        await sees(pilot, "Town number 2.")
        assert [path.name for path in (package / "made").iterdir()] == ["2"]
        await pilot.press("enter")
        await sees(pilot, "Environment: town_2:1", "Scored by")

    play(app, scenario)
    plugin_manager.load.cache_clear()


def test_a_run_is_chosen_step_by_step_and_what_is_impossible_says_why(home: Path) -> None:
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("n")
        await sees(pilot, "sample:passive", "Actions: move_distance")
        screen = app.screen
        assert isinstance(screen, NewRunScreen)
        await pilot.press("3")  # not before the task
        await until(pilot, lambda: screen.step == "task")
        await pilot.press("slash", *"goal", "enter")
        await sees(pilot, "sample_robot", "✗ walker", "Camera: 48 × 32")
        app.clear_notifications()
        await matches(app, pilot, "new-robot")
        await pilot.press("end", "enter")  # the robot that nothing can run
        await sees(pilot, "Install it: benchbot install")
        assert "robot" not in screen.chosen
        app.clear_notifications()
        await pilot.press("home", "down", "down", "enter")
        await until(pilot, lambda: screen.chosen.get("robot") == "sample_robot")
        await sees(pilot, "✗ arena:2", "A walled arena")
        await everywhere(app, pilot, "new-environment")
        await pilot.press("enter")
        await sees(pilot, "sample:goal  sample_robot  arena:1", "Scored by")
        seed = screen.query_one("#seed", Input)
        seed.value = "many"
        await pilot.press("ctrl+s")
        await sees(pilot, "Seed is not a whole number")
        seed.value = "7"
        screen.query_one("#solution", Select).value = "\0own"
        await pilot.press("ctrl+s")
        await sees(pilot, "There is nothing to submit")
        app.clear_notifications()
        await everywhere(app, pilot, "new-start")
        screen.query_one("#command", Input).value = "python mine.py"
        screen.query_one("#result", Input).value = "here.json"
        await sees(pilot, "$ benchbot submit '--native=python mine.py' --results-location=here.json")
        await pilot.press("ctrl+y")
        assert f"--results-location={home / 'work' / 'here.json'}" in app.clipboard
        assert app.clipboard.endswith("--task=sample:goal --robot=sample_robot --env=arena:1 --seed=7")
        assert jobs.jobs() == []
        for step in ("environment", "robot", "task"):
            await pilot.press("escape")
            await until(pilot, lambda step=step: screen.step == step)  # type: ignore[misc]
        await pilot.press("escape")  # all tasks again
        await sees(pilot, "sample:passive")
        await pilot.press("enter")  # another task: what came after it is to be chosen again
        await until(pilot, lambda: list(screen.chosen) == ["task"])
        await sees(pilot, "✗ walker")
        await pilot.press("escape")
        await until(pilot, lambda: screen.step == "task")
        await pilot.press("escape")
        await until(pilot, lambda: isinstance(app.screen, HomeScreen))

    play(app, scenario)


@pytest.mark.parametrize("size", [(20, 5), (1, 1), (50, 8)])
def test_no_terminal_is_too_small_and_any_can_change(size: tuple[int, int], home: Path) -> None:
    app = BenchbotApp(look=lambda: ALIVE)
    folder = write_results(home / "work" / "results")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await until(pilot, lambda: app.alive is ALIVE)
        for screen in (
            NewRunScreen(),
            SubmitScreen(ALIVE.runs[0]),
            ResultsScreen(folder),
            JobScreen(job_of("1", home)),
        ):
            app.push_screen(screen)
            await pilot.resize_terminal(130, 50)
            await pilot.press("tab", "down", "question_mark", "down", "escape")
            await pilot.resize_terminal(*size)
            await pilot.press("down")
            app.pop_screen()
        await pilot.press("x")
        await pilot.press("escape", "q")

    play(app, scenario, size)
    assert not app.return_code


def test_results_are_looked_through_evaluated_and_explained(home: Path) -> None:
    write_results(home / "work" / "results")
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("R")
        await sees(pilot, "3 results.")
        screen = app.screen
        assert isinstance(screen, ResultsScreen)
        assert screen.path == home / "work" / "results"
        await pilot.press("e")
        await sees(pilot, "This is not a result")
        app.clear_notifications()
        screen._table.find(lambda row: row.source.endswith("perfect.json"), 1)
        await pilot.press("e")
        await sees(pilot, "avg_pairwise")
        await pilot.press("escape")
        await sees(pilot, "OMQ 1.0000")
        await pilot.press("F")
        screen.query_one("#folder", Input).value = "no/such/folder"
        await pilot.press("enter")
        await sees(pilot, "There is no")
        screen.query_one("#folder", Input).value = "results"
        await pilot.press("enter")
        screen.path = Path("results")
        screen.action_read()
        await sees(pilot, "3 results. results/")
        app.clear_notifications()
        await everywhere(app, pilot, "results")
        await pilot.press("i")
        await sees(pilot, "This is not a result")
        app.clear_notifications()
        screen._table.find(lambda row: row.source.endswith("perfect.json"), 1)
        await pilot.press("i")
        await sees(pilot, "this shows the truth", "match")
        await matches(app, pilot, "explanation")
        await pilot.press("escape", "o")
        await sees(pilot, "The report is written.")
        assert (home / "work" / "results" / "perfect-report.html").is_file()
        app.clear_notifications()
        await pilot.press("m")
        await sees(pilot, "Mean score", "OMQ 1.0000 of 1")
        await pilot.press("m", "m", "m", "m", "slash", *"perfect", "enter")
        await sees(pilot, "1 of 3 results with “perfect”")
        await pilot.press("home", "space", "M")
        await sees(pilot, "Map · with the truth")
        await pilot.press("escape", "greater_than_sign", "k")
        await until(pilot, lambda: app.screen is screen)
        await pilot.press("escape")
        assert isinstance(app.screen, HomeScreen)

    play(app, scenario)


def test_a_submission_is_told_of_while_it_runs_and_afterwards(home: Path) -> None:
    job = Job(Path("jobs/1"), WORDS, 2**22 + 1, 0.0, Path("results/result.json"))
    job.folder.mkdir(parents=True)
    job.log.write_text("Task         sample:passive\nError: The solution failed.\n\n  It ended with exit status 1.")
    app = BenchbotApp(look=Alive)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        app.push_screen(JobScreen(job))
        await sees(pilot, "The solution failed.", "exit status 1")
        await everywhere(app, pilot, "submission")
        for key, answer in (("w", "not alive"), ("R", "no result")):
            await pilot.press(key)
            await sees(pilot, answer)
        app.push_screen(SubmitScreen(ALIVE.runs[0]))
        await sees(pilot, "Submit to miniroom:1", "a command of mine")
        await pilot.press("ctrl+s")
        await sees(pilot, "There is nothing to submit")
        app.clear_notifications()
        await everywhere(app, pilot, "submit")
        app.screen.query_one("#command", Input).value = "python mine.py"
        await sees(pilot, "$ benchbot submit '--native=python mine.py'", f"--run={ALIVE.runs[0].name}")

    play(app, scenario)
