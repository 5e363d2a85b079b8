"""`benchbot replay`: `benchbot submit`, with task, robot, environment, seed and settings of a recording."""

import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.plugin import Catalog, load_plugins
from benchbot_replay import source

FLAGS = {"task": ("--task", "-t"), "environment": ("--env", "--environment")}

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

    recorded = recordings.read(recording)
    source.use([recorded.path])
    _require_fit(recorded, words)
    console.note(*told(recorded))
    command = [sys.executable, "-m", "benchbot", "submit", *defaults(recorded, words), *words]
    sys.stderr.flush()
    os.execv(sys.executable, command)  # noqa: S606 - no shell; its exit code and signals are those of submit


def defaults(recorded: Any, words: Sequence[str]) -> list[str]:
    """Return the options of `benchbot submit` that a recording says, without those that are given."""
    chosen = recorded.run["selection"]
    settings = [f"{key}={_yaml(value)}" for key, value in chosen["settings"].items()]
    options = {
        ("--robot",): [source.ROBOT],
        FLAGS["task"]: [chosen["task"]],
        FLAGS["environment"]: [chosen["environment"]],
        ("--seed",): [str(recorded.run["seed"])] if "seed" in recorded.run else [],
        ("--set",): settings,
    }
    ours = list(words)[: list(words).index("--")] if "--" in words else words
    given = {word.partition("=")[0] for word in ours}
    return [
        word
        for names, values in options.items()
        if not given.intersection(names)
        for v in values
        for word in (names[0], v)
    ]


def _require_fit(recorded: Any, words: Sequence[str]) -> None:
    """Raise BenchbotError when another task is asked for whose poses are others; `submit` tells an unknown one."""
    given = dict(pairwise(words))
    name = next((given[flag] for flag in FLAGS["task"] if flag in given), None)
    tasks = Catalog(load_plugins()).pool("tasks")
    if name in tasks:
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
    import json

    return value if isinstance(value, str) else json.dumps(value)
