"""`benchbot replay`: `benchbot submit`, with task, robot, environment, seed and settings of a recording."""

import json
import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError, Catalog, load_plugins
from benchbot_replay import source

FLAGS = {
    "task": ("--task", "-t"),
    "robot": ("--robot",),
    "environment": ("--env", "--environment"),
    "every": ("--every",),
}

app = typer.Typer(add_completion=False, rich_markup_mode=None)


@app.command(
    "replay",
    # What follows RECORDING is for another command to read.
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
    no_args_is_help=True,
)
def replay(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING", help="A folder or file of --record mcap, or a ROS 2 bag.")
    ],
    words: Annotated[
        list[str],
        typer.Argument(metavar="OPTIONS", help="Of benchbot submit: at least --native COMMAND, or another mode."),
    ],
) -> None:
    """Run a solution on what a robot has recorded, without driving anew.

    \b
    benchbot replay result-recordings/mcap --native python my_solution.py --evaluate-with omq

    One recorded step is one move_next; the last one ends the scene. What follows RECORDING is for benchbot submit,
    which is started with the recording's own task, environment, settings and seed.

    \b
    Of a ROS 2 bag it must be said which robot's topics it holds, and where that was:
    benchbot replay BAG --robot carter_ros2 --task T --env E --every 1 --native python my_solution.py
    """
    from benchbot_replay import recordings

    robot = given(words, FLAGS["robot"])
    if robot in (None, source.ROBOT):
        recorded = recordings.read(recording)
    else:
        recorded = recordings.read(_of_bag(recording, words))
        words = without(words, (*FLAGS["robot"], *FLAGS["every"]))
    _require_fit(recorded, words)
    source.use([recorded.path])
    console.note(*told(recorded))
    command = [sys.executable, "-m", "benchbot", "submit", *defaults(recorded, words), *words]
    sys.stderr.flush()
    os.execv(sys.executable, command)  # noqa: S606 - no shell; its exit code and signals are those of submit


def given(words: Sequence[str], names: Sequence[str]) -> str | None:
    """Return the value of an option among the words of a command, by its names; None when it is not there."""
    for word, following in pairwise([*_ours(words), ""]):
        name, equals, value = word.partition("=")
        if name in names:
            return value if equals else following
    return None


def without(words: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return the words of a command without an option and its value."""
    ours = _ours(words)
    left, rest = list(ours), list[str]()
    while left:
        word = left.pop(0)
        if word in names:
            del left[:1]
        elif word.partition("=")[0] not in names:
            rest.append(word)
    return [*rest, *words[len(ours) :]]


def _ours(words: Sequence[str]) -> Sequence[str]:
    """Return the words before `--`: those behind are the solution's."""
    return words[: list(words).index("--")] if "--" in words else words


def _of_bag(path: Path, words: Sequence[str]) -> Path:
    """Return the recording of a bag, by what is said of it."""
    robot, task, environment = (given(words, FLAGS[name]) for name in ("robot", "task", "environment"))
    if robot is None or task is None or environment is None:
        raise BenchbotError(
            "It is not said of what the bag is.",
            "A bag of ROS 2 names neither a task nor a place.",
            "Say it: benchbot replay BAG --robot NAME --task TASK --env ENVIRONMENT …",
        )
    if find_spec("benchbot_robot_ros2") is None:
        raise BenchbotError(
            "Bags of ROS 2 cannot be read here.",
            "Their messages are read as the robot's driver reads them, and benchbot-robot-ros2 is not installed.",
            "Install it: benchbot install benchbot-robot-ros2",
        )
    from benchbot_replay import bag, ros_bag

    every = given(words, FLAGS["every"]) or "0"
    try:
        every_s = float(every)
    except ValueError:
        every_s = -1.0
    if not 0 <= every_s < float("inf"):
        raise BenchbotError("--every is no number of seconds.", f"It is {every!r}.", "Write it like this: --every 1")
    catalog = Catalog(load_plugins())
    place = catalog.environments(environment)
    if len(place) != 1:
        raise BenchbotError("A bag is of one scene.", f"{environment} names {len(place)}.", "Name one: --env NAME:1")
    about = bag.Bag(path, catalog.get("robots", robot), catalog.get("tasks", task), place[0], every_s)
    folder, odd = ros_bag.converted(about)
    for sentence in odd:
        console.note(f"Warning: {sentence}")
    return folder


def defaults(recorded: Any, words: Sequence[str]) -> list[str]:
    """Return the options of `benchbot submit` that a recording says, without those that are given."""
    chosen = recorded.run["selection"]
    settings = [f"{key}={_yaml(value)}" for key, value in chosen["settings"].items()]
    options = {
        FLAGS["robot"]: [source.ROBOT],
        FLAGS["task"]: [chosen["task"]],
        FLAGS["environment"]: [chosen["environment"]],
        ("--seed",): [str(recorded.run["seed"])] if "seed" in recorded.run else [],
        ("--set",): settings,
    }
    left = {names: values for names, values in options.items() if given(words, names) is None}
    return [word for names, values in left.items() for value in values for word in (names[0], value)]


def _require_fit(recorded: Any, words: Sequence[str]) -> None:
    """Raise BenchbotError when another task is asked for whose poses are others; `submit` tells an unknown one."""
    name = given(words, FLAGS["task"])
    tasks = Catalog(load_plugins()).pool("tasks")
    if name is not None and name in tasks:
        noisy = tasks[name].data.get("localisation") == "noisy"
        recorded.require_localisation("noisy" if noisy else "ground_truth")


def told(recorded: Any) -> list[str]:
    """Return what is replayed, in words, and what there is to know of it."""
    scenes = "; ".join(f"{scene.name}, {scene.steps} steps" for scene in recorded.scenes)
    lines = [f"Replays {recorded.path}: {recorded.robot['name']} in {scenes}."]
    if recorded.lossy:
        lines.append(f"Warning: not what the sensor gave, but compressed with loss: {', '.join(recorded.lossy)}")
    return lines


def _yaml(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
