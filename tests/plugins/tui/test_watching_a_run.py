"""A real run that is watched on its screen, held, driven by hand, followed to its end, and left, by keys."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from textual.pilot import Pilot

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.plugins.drawing.scene_maps import installed_map
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.jobs import Alive
from benchbot.plugins.tui.map_panel import Surroundings
from benchbot.plugins.tui.run_screen import RunScreen
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import RunView
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState
from tests.command_line import CommandLine
from tests.plugins.tui import playing
from tests.plugins.tui.playing import Scenario, play, sees, shown, until
from tests.supervisor.harness import eventually

PATIENCE_S = 120.0
BY_HAND_FIRST = """\
import json, pathlib, time
from benchbot.api import BenchBot

def until(name):
    while not pathlib.Path(name).exists():
        time.sleep(0.02)

until("go")
benchbot = BenchBot()
print("mapping \\x1b[31mstarts", flush=True)
benchbot.reset()
for _ in range(3):
    benchbot.step("move_distance", distance=0.1)
until("end")
empty = benchbot.empty_results()
box = {"label_probs": [1.0, 0.0], "centroid": [1.5, 1.2, 0.5], "extent": [0.6, 0.6, 1.0], "prob": 1.0}
empty["results"] = {"class_list": ["chair", "background"], "objects": [box]}
with open(benchbot.result_filename, "w") as file:
    json.dump(empty, file)
"""


def watch(screen: RunScreen, scenario: Scenario, size: tuple[int, int] = (100, 30)) -> None:
    async def watched(app: BenchbotApp, pilot: Pilot[None]) -> None:
        app.push_screen(screen)
        await scenario(app, pilot)

    play(BenchbotApp(look=Alive), watched, size)


def test_a_real_run_is_driven_held_followed_and_left(
    cli: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR"):
        monkeypatch.setenv(name, cli.variables[name])
    monkeypatch.setattr(playing, "PATIENCE_S", PATIENCE_S)
    words = ("--task", "sample:active", "--robot", "sample_robot", "--env", "faulty:asks", "--max-steps", "40")
    native = ("--native", cli.script("mapper.py", BY_HAND_FIRST), "--results-location", "result.json")
    submitted = cli.start("submit", *words, *native, "--display", "json")
    assert eventually(lambda: bool(run_state.live()), PATIENCE_S)
    (state,) = run_state.live()
    opened: list[Path] = []
    begun: list[RunState] = []
    screen = RunScreen(
        RunFeed(state),
        again=begun.append,
        report=opened.append,
        surroundings=installed(),
        snapshots=tmp_path / "pictures",
    )

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "NO SOLUTION YET", "faulty:asks")

        # Its host drives before the solution has begun; the robot is carried to its start first.
        await pilot.press("d", "d")
        await sees(pilot, "DRIVEN BY HAND")
        await pilot.press("w")
        await sees(pilot, "THE ROBOT ASKS YOU", "Carry the robot to its start.", "Driving")
        await pilot.press("s")  # the step before is still under way: nothing more is begun
        await pilot.press("y")
        await until(pilot, lambda: screen.feed.view.driven_by_hand == 1 and "Driving" not in shown(pilot), "the step")
        await pilot.press("comma", "left")
        await sees(pilot, "2 steps by hand", "move_angle(angle=5) by hand")
        await pilot.press("enter")  # there is no trajectory to follow: the key means nothing
        await pilot.press("escape")

        # The solution is held at its first request, and let through step by step.
        await pilot.press("space")
        await until(pilot, lambda: screen.feed.view.paused)
        (cli.folder / "go").touch()
        await sees(pilot, " PAUSED ")
        await pilot.press("1")
        await sees(pilot, "THE ROBOT ASKS YOU")
        await pilot.press("y")
        await until(pilot, lambda: screen.feed.view.held and "Confirming" not in shown(pilot), "the gate")
        await pilot.press("1")
        await sees(pilot, "move_distance(distance=0.1)", "1/40")
        await pilot.press("c")
        await sees(pilot, "depth")
        await until(pilot, lambda: "image_depth" in channels_of(screen.feed.view), "depth")
        await pilot.press("p")
        await until(pilot, lambda: len(list((tmp_path / "pictures").glob("*.png"))) == 2, "the snapshot")
        await pilot.press("slash", *"mapping", "enter")
        await sees(pilot, "with “mapping”", "mapping starts")
        await pilot.press("v")
        await pilot.press("L", "home", "pageup", "end")

        # It goes on to its end, and hands in what it has mapped.
        await pilot.press("space")
        await sees(pilot, "3/40")
        (cli.folder / "end").touch()
        await sees(pilot, "ENDED", "Its result is in")
        await pilot.press("o", "r", "0", "plus")
        await until(pilot, lambda: opened == [Path(state.result)] and begun == [state])
        await until(pilot, lambda: len(screen._scenery.estimates(Path(state.result))) == 1, "what was mapped")
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is not screen)

    watch(screen, scenario)
    output, printed = submitted.communicate(timeout=PATIENCE_S)
    assert (submitted.returncode, output) == (0, "result.json\n"), printed
    assert json.loads((cli.folder / "result.json").read_text())["provenance"]["driven_by_hand"] == 2
    shots = sorted((tmp_path / "pictures").glob("*.png"))
    assert [re.sub(r".*-", "", path.name) for path in shots] == ["depth.png", "map.png"]
    assert len(np.unique(np.asarray(Image.open(shots[1])).reshape(-1, 3), axis=0)) > 2


def test_a_run_is_ended_by_the_same_key_twice(
    cli: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR"):
        monkeypatch.setenv(name, cli.variables[name])
    monkeypatch.setattr(playing, "PATIENCE_S", PATIENCE_S)
    running = cli.start("run", "--task", "sample:active", "--robot", "sample_robot", "--env", "arena:1")
    assert eventually(lambda: bool(run_state.live()), PATIENCE_S)
    screen = RunScreen(RunFeed(run_state.live()[0]), surroundings=installed())

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await sees(pilot, "NO SOLUTION YET")
        await pilot.press("x", "q")  # leaving is not ending
        await until(pilot, lambda: app.screen is not screen)
        assert running.poll() is None
        last = RunScreen(RunFeed(run_state.live()[0]), surroundings=installed())
        app.push_screen(last)
        await sees(pilot, "NO SOLUTION YET")
        await pilot.press("x", "x")
        await sees(pilot, "ENDED")

    watch(screen, scenario)
    running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 0


def channels_of(view: RunView) -> set[str]:
    return set() if view.snapshot is None else set(view.snapshot.images)


def installed() -> Surroundings:
    catalog = Catalog(load())
    return lambda environment: installed_map(catalog, environment)
