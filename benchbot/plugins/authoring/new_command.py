"""`benchbot new`: a new plug-in, complete and tested, to start from."""

from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console


def new(
    kind: Annotated[
        str,
        typer.Argument(metavar="KIND", help="plugin, task, robot, environment, evaluator, simulator, driver or agent."),
    ],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the distribution, such as acme-kitchen.")],
    origin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="gymnasium|mujoco|ros2",
            help="Of a simulator: what it is made of. A Gymnasium environment (MiniWorld's), a MuJoCo model (MJCF) or "
            "a simulator that speaks ROS 2, such as Gazebo. [default: nothing]",
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output-location", "-o", metavar="DIR", help="The folder that it is made in.")
    ] = Path(),
) -> None:
    """Make a new plug-in: a project with an example, tests, documentation and CI, ready to publish.

    Prints its folder. Nothing is overwritten.
    """
    from benchbot.core.errors import BenchbotError, did_you_mean
    from benchbot.plugins.authoring.scaffold.render import KINDS, ORIGINS, create

    if kind not in KINDS:
        raise BenchbotError(
            f"'{kind}' is nothing that can be made.",
            f"There is: {', '.join(KINDS)}.{did_you_mean(kind, list(KINDS))}",
            "Name one of these: benchbot new task acme-tasks",
        )
    if origin is not None and origin not in ORIGINS.get(kind, ()):
        known = ORIGINS.get(kind, ())
        raise BenchbotError(
            f"A new {kind} does not start from '{origin}'.",
            f"It can start from: {', '.join(known) or 'nothing'}.{did_you_mean(origin, list(known))}",
            "Leave --from out, or make a simulator: benchbot new simulator NAME --from mujoco",
        )
    folder = create(kind if origin is None else f"{kind}-{origin}", name, output)
    console.data(str(folder))
    console.note(f"Try it:         cd {folder} && make test")
    console.note("Use it:         pip install --editable .")
    console.note("Then read:      README.md, and docs/plugins.md of BenchBot")
