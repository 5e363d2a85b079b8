"""A person's day, in a real terminal and by keys alone: from the search for a plug-in to the report of a comparison."""

import json
import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from benchbot.plugins.batch.claims import Claim
from tests.plugins.installer import environments, wheels
from tests.plugins.installer.environments import Environment
from tests.plugins.installer.wheels import Index
from tests.plugins.tui.test_tmux import Terminal, until

SAMPLE = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample"
HOOKS = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_tasks():
    yield Path(__file__).parent / "tasks"

@hookimpl
def benchbot_ground_truths():
    yield Path(__file__).parent / "truths"

print_nothing = len
"""
"""Its last line is code, for which consent is asked."""
BOX = {"class": "bottle", "centroid": [2.2, -1.2, 0.5], "extent": [1, 1, 1]}
SOLUTION = """\
import json, sys, time
from pathlib import Path
from benchbot_api import ActionResult, Agent, BenchBot

work = Path({work!r})

class Mapper(Agent):
    def is_done(self, result):
        return result != ActionResult.SUCCESS

    def pick_action(self, observations, actions):
        while not (work / "gate").exists():
            time.sleep(0.05)
        return "move_next", {{}}

    def save_result(self, filename, empty_results, functions):
        {broken}
        empty_results["results"] = {{
            "objects": [{{**box, "label_probs": [1.0, 0.0]}} for box in {boxes!r}],
            "class_list": ["bottle", "background"],
        }}
        json.dump(empty_results, open(filename, "w"))

BenchBot(agent=Mapper()).run()
"""
BROKEN = 'assert not (work / "broken").exists(), "There is something to be mended."'


@pytest.fixture
def day(tmp_path: Path) -> Iterator[tuple[Environment, Index]]:
    """An environment to install into, an index on loopback, and two solutions, one of which fails at first."""
    environment = environments.make(
        tmp_path / "day", ("uv", "benchbot-sim-taichi", "benchbot-assets-household", "benchbot-eval-omq")
    )
    environments.add_uv(environment)
    truths = {}
    for variant in (1, 2):
        place = yaml.safe_load((SAMPLE / "environments" / f"arena_{variant}.yaml").read_text())
        truth = {"objects": [{**BOX, "ID_name": "b", "isgroup": False}], "class_list": ["bottle", "background"]}
        document = {
            "environment": place,
            "format": {"name": "object_map_ground_truth", "functions": {"create": "json:loads"}},
            "ground_truth": {**truth, "synonyms": {}},
        }
        truths[f"benchbot_task_day/truths/arena_{variant}.json"] = json.dumps(document)
    files = {"benchbot_task_day/tasks/day.yaml": wheels.TASK.format(name="day"), **truths}
    for name, boxes, broken in (
        ("ours", [{k: v for k, v in BOX.items() if k != "class"}], "pass"),
        ("base", [], BROKEN),
    ):
        text = SOLUTION.format(work=str(environment.home), boxes=boxes, broken=broken)
        (environment.home / f"{name}.py").write_text(text)
    (environment.home / "broken").touch()
    with wheels.serving(tmp_path / "index") as index:
        index.publish(wheels.make(tmp_path, "benchbot-task-day", code=HOOKS, files=files))
        index.publish(wheels.make(tmp_path, "benchbot-other"))
        yield environment, index


@pytest.fixture
def terminal(day: tuple[Environment, Index], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminal]:
    environment, index = day
    variables = environment.environ({"UV_DEFAULT_INDEX": index.url, "LANG": "C.UTF-8", "TERM": "screen-256color"})
    variables["PATH"] = os.pathsep.join([str(environment.python.parent), variables["PATH"]])
    variables.pop("COLUMNS")
    terminal = Terminal(tmp_path_factory.mktemp("t"), environment.home, variables)
    yield terminal
    terminal.close()


@pytest.mark.slow
def test_a_day_without_leaving_the_screens(day: tuple[Environment, Index], terminal: Terminal) -> None:
    environment, _ = day
    home = environment.home
    terminal.open(*environment.words("tui"))
    terminal.sees("No run and no batch")

    # A plug-in is looked for, and what it brings is shown before it is installed.
    terminal.press("P")
    terminal.sees("Plug-ins", "benchbot-eval-omq")
    terminal.press("/")
    terminal.sees("$ benchbot plugins search WORD")
    terminal.press("day", "Enter")
    terminal.sees("benchbot-task-day", "$ benchbot install benchbot-task-day")
    terminal.press("i")
    terminal.sees("+ benchbot-task-day 1.0", "runs with all your rights", "and let its code run")
    terminal.press("y")
    terminal.sees("Done, and checked", "✓  benchbot-task-day")
    _go_home(terminal)

    # An environment is generated, looked at, and installed.
    terminal.press("V")
    terminal.sees("generate one")
    _step(terminal, "1", "Tab", "3")
    terminal.press("C-s")
    terminal.sees("Made in apartment_3", "living room", "▀▀▀")
    terminal.press("i")
    terminal.sees("Install apartment_3?")
    terminal.press("y")
    terminal.sees("✓ Installed")
    _go_home(terminal)

    # A batch of two solutions in two environments with three seeds is checked and started.
    terminal.press("B")
    terminal.sees("arena:1", "apartment_3:1", "Task            day")
    _step(terminal, "End", "Space")
    _step(terminal, "Tab", "Down", "Space", "Down", "Space")
    _step(terminal, "Tab", "Tab", "ours=python ours.py; base=python base.py")
    terminal.sees("base=python base.py", "2 solutions")
    _step(terminal, "Tab", "0..2")
    terminal.sees("= 12 episodes", "✓ sample_robot in arena:2")
    terminal.press("C-t")
    terminal.sees("Nothing is in the way: 12 episodes")
    terminal.press("C-s")
    terminal.sees("RUNNING", "0 of 12")

    # One of its runs is watched, and its worker is killed.
    (batch,) = home.glob("batch-*")
    until(lambda: len(_claims(batch)) >= 1, lambda: terminal.screen)
    terminal.press("Right", "Home")
    terminal.sees("running on", "w Watch its run")
    terminal.press("w")
    terminal.sees("arena:1", "sample_robot", "Log")
    _go_home(terminal)
    victim = _claims(batch)[0]
    os.kill(victim.process.pid, signal.SIGKILL)
    (home / "gate").touch()
    terminal.sees("6 failed")
    terminal.press("Enter")
    terminal.sees("6 OF 12 FAILED")

    # What failed is mended, and computed once more.
    (home / "broken").unlink()
    terminal.press("r")
    terminal.sees("all that failed (6)")
    terminal.press("a")
    terminal.sees("ALL 12 COMPLETE")
    until((batch / "comparison.json").is_file, lambda: terminal.screen)

    # One more seed is added; what is finished stays, and the comparison says that the size was not fixed before.
    terminal.press("A")
    terminal.sees("12 episodes + 3 seeds × 4 = 24 episodes")
    _step(terminal, "C-u", "3")
    terminal.sees("12 episodes + 1 seed × 4 = 16 episodes", "batch extend", "--seeds=3")
    terminal.press("C-s")
    terminal.sees("ALL 16 COMPLETE")
    until(lambda: "added to" in (batch / "comparison.json").read_text(), lambda: terminal.screen)

    # The solutions are compared, and the report is made.
    terminal.press("C")
    terminal.sees("[ ] base", "[ ] ours")
    _step(terminal, "Space", "Down", "Space")
    terminal.press("C-s")
    terminal.sees("pair by pair", "OMQ")
    terminal.press("O")
    terminal.sees("The report is written.")
    assert list(batch.rglob("report.html"))
    terminal.press("Escape")
    terminal.sees("ALL 16 COMPLETE")
    _go_home(terminal)
    terminal.sees("✓ batch-", "16 of 16")
    terminal.press("q")
    terminal.sees("ended with 0")

    lost = [path for path in batch.glob("episodes/*/attempts.jsonl") if len(_numbers(path)) > 1]
    assert lost, "The killed worker's episode was begun once only."


@pytest.mark.slow
def test_a_plugin_is_upgraded_and_an_upgrade_that_does_not_work_is_undone(
    day: tuple[Environment, Index], terminal: Terminal, tmp_path: Path
) -> None:
    environment, index = day
    terminal.open(*environment.words("tui"))
    terminal.sees("No run and no batch")
    terminal.press("P")
    terminal.sees("benchbot-eval-omq")
    terminal.press("/")
    terminal.sees("$ benchbot plugins search WORD")
    terminal.press("other", "Enter")
    terminal.sees("$ benchbot install benchbot-other")
    terminal.press("i")
    terminal.sees("+ benchbot-other 1.0")
    terminal.press("y")
    terminal.sees("Done, and checked", "✓  benchbot-other")

    index.publish(wheels.make(tmp_path, "benchbot-other", "1.1"))
    terminal.sees("$ benchbot plugins show benchbot-other")
    terminal.press("u")
    terminal.sees("benchbot-other 1.0 -> 1.1", "upgrade it")
    terminal.press("y")
    terminal.sees("Done, and checked")
    assert [path.name for path in environment.site.glob("benchbot_other-*")] == ["benchbot_other-1.1.dist-info"]

    # The next one cannot be used: all is as it was before, and the reason stands there.
    broken = {"benchbot_other/tasks/other.yaml": "name: other\nactions: [fly]\n"}
    index.publish(wheels.make(tmp_path, "benchbot-other", "2.0", files=broken))
    terminal.sees("$ benchbot plugins show benchbot-other")
    terminal.press("u")
    terminal.sees("benchbot-other 1.1 -> 2.0")
    terminal.press("y")
    terminal.sees("✗ ", "fly")
    assert [path.name for path in environment.site.glob("benchbot_other-*")] == ["benchbot_other-1.1.dist-info"]


def _step(terminal: Terminal, *keys: str) -> None:
    """Press keys that all show on the screen, each when the one before has: a key typed ahead may go elsewhere."""
    for key in keys:
        before = terminal.painted
        terminal.press(key)
        until(lambda before=before: _has_settled(terminal, before), lambda: terminal.screen)  # type: ignore[misc]


def _has_settled(terminal: Terminal, before: str) -> bool:
    """Say whether the screen is another one than before, and stays so."""
    now = terminal.painted
    time.sleep(0.1)
    return now != before and now == terminal.painted


def _go_home(terminal: Terminal) -> None:
    """Leave a screen; a key at once after Escape would be one with Alt."""
    terminal.press("Escape")
    terminal.sees("New run")


def _claims(batch: Path) -> list[Claim]:
    return [claim for claim in map(Claim.read, batch.glob("claims/*")) if claim is not None]


def _numbers(journal: Path) -> set[str]:
    return set(re.findall(r'"attempt": ?(\d+)', journal.read_text()))
