"""Moments of the screens that do what commands do, made from data: the same at every time and on every machine."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PIL import Image
from textual.pilot import Pilot
from textual.widgets import Input

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import estimate, machine
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch import screen as batch_screen
from benchbot.plugins.batch.estimate import Durations
from benchbot.plugins.batch.plan import PlannedEpisode
from benchbot.plugins.batch.screen import Choices, Matrix, NewBatchScreen
from benchbot.plugins.batch.seeds_screen import AddSeedsScreen
from benchbot.plugins.doctor.screen import DoctorScreen
from benchbot.plugins.installer import screen as installer_screen
from benchbot.plugins.installer.screen import PluginsScreen
from benchbot.plugins.report.screen import CompareScreen
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.widgets import CheckList, Table
from benchbot.plugins.tui import settings_screen
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.map_canvas import RunMap, paint
from benchbot.plugins.tui.settings_screen import SettingsScreen
from benchbot_scenes.screen import EnvironmentsScreen
from tests.plugins.tui.playing import sees, until
from tests.plugins.tui.watched import PLACE

Moment = Callable[[BenchbotApp, Pilot[None], pytest.MonkeyPatch], Any]
TASK = "semantic_slam:passive:ground_truth"


def outcome(document: object) -> Outcome:
    """Return the end of a command that printed a document."""
    return Outcome(0, json.dumps(document), ())


async def new_batch(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """A batch of two solutions, of which one place is impossible."""
    names = {
        "tasks": [TASK],
        "robots": ["carter", "carter_lowres", "carter_real"],
        "environments": ["house:1", "house:2", "miniroom:1", "office:1"],
        "examples": ["hello_active", "hello_passive"],
    }
    reason = BenchbotError(
        "The robot 'carter_real' is a real one.",
        "A batch runs unattended, and somebody must stand beside a robot that moves.",
        "Run its episodes one by one: benchbot submit",
    )
    patch.setattr(machine, "free_capacity", _Capacity)
    patch.setattr(batch_screen, "choices_of", lambda catalog: Choices(names, {TASK: ["omq"]}))
    patch.setattr(batch_screen, "reasons_against", lambda _, __, place: (reason,) * (place[0] == "carter_real"))
    known = {("carter", "house:1"): 74.0, ("carter", "house:2"): 91.0, ("carter_real", "house:1"): 80.0}
    patch.setattr(estimate, "durations", lambda task, places: Durations(known, 12))
    screen = NewBatchScreen()
    app.push_screen(screen)
    await sees(pilot, "[ ] carter_lowres")
    for name, chosen in (
        ("robots", ["carter", "carter_real"]),
        ("environments", ["house:1", "house:2"]),
        ("examples", ["hello_passive"]),
    ):
        screen.query_one(f"#{name}", CheckList).offer({each: each for each in names[name]}, chosen)
    screen._commands_field.value = "ours=python ours.py"
    screen._seeds_field.value = "0..4"
    screen._changed()
    await until(pilot, lambda: _is_known(screen._matrix))


class _Capacity:
    def jobs(self, *_: object) -> int:
        return 4


def _is_known(matrix: Matrix | None) -> bool:
    return matrix is not None and len(matrix.reasons) == len(matrix.places) == 4


async def compare(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """Three solutions, of which one is better than another."""
    sets = {"ours": Path("results/ours"), "base": Path("results/base"), "ours-old": Path("results/ours-old")}
    patch.setattr(app, "result_sets", lambda: sets)
    screen = CompareScreen()
    app.push_screen(screen)
    await sees(pilot, "[ ] ours-old")
    screen.query_one("#sets", CheckList).offer(
        {name: f"{name}  {path}" for name, path in sets.items()}, ["ours", "base"]
    )
    screen.show_words()
    screen._compared(outcome(COMPARISON))


async def plugins(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """What is installed, with what the marked one brings."""
    patch.setattr(installer_screen, "installed", lambda: {name: dict(row) for name, row in PLUGINS.items()})
    patch.setattr(installer_screen, "details", lambda name: DETAILS if name == "benchbot-eval-omq" else {})
    screen = PluginsScreen()
    app.push_screen(screen)
    await sees(pilot, "benchbot-eval-omq")
    await pilot.press("j")
    await until(pilot, lambda: screen.query_one(Table).marked == "benchbot-eval-omq")
    await sees(pilot, "benchbot plugins show benchbot-eval-omq")


async def environments(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """An environment that was generated, from above."""
    screen = EnvironmentsScreen()
    app.push_screen(screen)
    await sees(pilot, "benchbot generate-environment")
    run_map = RunMap(PLACE)
    picture = Image.fromarray(paint(run_map.scene, run_map.transform(240, 160), dark=True))
    screen._folder = Path("apartment_3")
    screen._tell(
        {
            "Environment": "apartment_3:1",
            "Rooms": "living room, kitchen, bedroom, bathroom",
            "Objects": "2 bed, 4 chair, 1 couch, 3 potted plant, 1 sink, 2 table",
            "Trajectory": "58 poses",
            "Folder": "apartment_3",
        },
        picture,
    )
    screen.say("✓ Made in apartment_3. i installs it; without that: --addons apartment_3", "green")


async def doctor(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """Something is broken; its fix stands beside it."""
    patch.setattr(DoctorScreen, "action_look", lambda self: None)
    screen = DoctorScreen()
    app.push_screen(screen)
    await sees(pilot, "this machine")
    screen._found(outcome(FINDINGS))


async def settings(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """The settings, with what is kept where."""
    patch.setattr(settings_screen, "folders", lambda: FOLDERS)
    for name in settings_screen.VARIABLES:
        patch.delenv(name, raising=False)
    app.push_screen(SettingsScreen())
    await sees(pilot, "214.3 MiB")


async def palette(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """The palette of commands, on the first screen."""
    await sees(pilot, "No run and no batch")
    await until(pilot, lambda: "arenas" in app._registered)  # those of other distributions are read a little later
    await pilot.press("ctrl+p")
    await sees(pilot, "Arenas", "Compare", "New batch")
    app.screen.query_one(Input).cursor_blink = False


PAIRS = {"house:1, seed": (0.112, 0.081, 0.143), "house:2, seed": (0.064, -0.021, 0.087)}
COMPARISON = {
    "score": "OMQ",
    "lower_is_better": False,
    "sets": [
        {"name": "ours", "score": 0.6214, "interval": {"low": 0.5561, "high": 0.6867}, "failures": {"collision": 1},
         "scored": 6, "expected": 6},
        {"name": "base", "score": 0.5437, "interval": {"low": 0.4890, "high": 0.5984}, "failures": {}, "scored": 6,
         "expected": 6},
    ],
    "comparisons": [
        {
            "a": "ours",
            "b": "base",
            "verdict": "higher",
            "sentence": "ours has a higher OMQ than base, by 0.0777 (95 % interval 0.0210 to 0.1344, p = 0.031).",
            "difference": 0.0777,
            "interval": {"low": 0.0210, "high": 0.1344},
            "rows": [
                {"pair": f"{place} {seed}", "a": 0.6, "b": 0.6 - difference, "difference": difference}
                for place, differences in PAIRS.items()
                for seed, difference in enumerate(differences)
            ],
        }
    ],
    "notes": ["The batch was added to: it had 4 episodes of 6 when results of it could be seen."],
}  # fmt: skip
PLUGINS = {
    "benchbot-assets-household": {"version": "0.4.0", "summary": "Furniture and objects for generated environments"},
    "benchbot-eval-omq": {"version": "0.4.0", "summary": "Object map quality, as in the Scene Understanding Challenge"},
    "benchbot-sim-taichi": {"version": "0.4.0", "summary": "The ray-traced simulator, on processors and GPUs"},
    "benchbot-task-navigation": {"version": "0.4.0", "summary": "Point and object goals, with success and path length"},
    "benchbot": {"version": "0.4.0", "summary": "Benchmarks for robot agents, simulated and real"},
}
PLUGINS = {name: {"name": name, **row} for name, row in PLUGINS.items()}
DETAILS = {
    "kind": "evaluator",
    "brings": "code",
    "code": ["benchbot_eval_omq"],
    "from": "the index",
    "requires": ["benchbot", "numpy", "scipy"],
    "entry_points": {"omq": "benchbot_eval_omq"},
    "path": "/home/ann/study/.venv/lib/python3.12/site-packages",
}
FINDINGS = [
    {"level": "ok", "subject": "Python", "detail": "3.12.4, 64 bit", "fix": ""},
    {"level": "ok", "subject": "simulator sim_taichi", "detail": "on processors, 16 threads", "fix": ""},
    {"level": "warning", "subject": "port 10000", "detail": "another program listens on it",
     "fix": "Say another one: benchbot run --port 10001"},
    {"level": "broken", "subject": "plugin benchbot-lost", "detail": "cannot be imported: No module named 'torch'",
     "fix": "pip install torch, or: benchbot uninstall benchbot-lost"},
    {"level": "ok", "subject": "disk", "detail": "212 GiB free in /home/ann/.cache/benchbot", "fix": ""},
]  # fmt: skip
FOLDERS = {
    "Caches, which are computed again": "/home/ann/.cache/benchbot  214.3 MiB; another one: export …",
    "Runs, logs and these settings": "/home/ann/.local/state/benchbot  12.9 MiB; another one: export …",
    "What was installed beside distributions": "/home/ann/.local/share/benchbot  0.4 MiB; another one: export …",
}


async def add_seeds(app: BenchbotApp, pilot: Pilot[None], patch: pytest.MonkeyPatch) -> None:
    """Seeds for a batch of three in four places."""
    episodes = [
        PlannedEpisode(f"{place}{seed}", "", "carter", f"house:{place}", seed)
        for place in range(1, 5)
        for seed in range(3)
    ]
    patch.setattr(plans, "read", lambda path: SimpleNamespace(episodes=episodes))
    app.push_screen(AddSeedsScreen(Path("/home/ann/study/lights")))
    await sees(pilot, "12 episodes + 3 seeds × 4 = 24 episodes")


MOMENTS: Mapping[str, Moment] = {
    "new-batch": new_batch,
    "compare": compare,
    "plugins": plugins,
    "environments": environments,
    "doctor": doctor,
    "settings": settings,
    "palette": palette,
    "add-seeds": add_seeds,
}
