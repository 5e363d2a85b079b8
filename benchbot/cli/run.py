"""`benchbot run`: a robot in an environment, ready for a solution."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console, options
from benchbot.cli.show import listing, showing
from benchbot.core.errors import ExitCode

if TYPE_CHECKING:
    from benchbot.core.episodes import Episode
    from benchbot.core.progress import Progress
    from benchbot.core.request import Limits
    from benchbot.core.selection import Selection
    from benchbot.wire.run_state import RunState

Task = Annotated[str, typer.Option("--task", "-t", metavar="TASK", help="What the solution is asked to do.")]
Robot = Annotated[
    str, typer.Option("--robot", "-r", metavar="ROBOT", help="The robot; one of a fleet: NAME@NAMESPACE.")
]
Environment = Annotated[
    str,
    typer.Option(
        "--env", "-e", "--environment", metavar="NAME:VARIANT", help="Where; a task with scenes: NAME:VARIANT:VARIANT."
    ),
]


def run(
    task: Task,
    robot: Robot,
    environment: Environment,
    episode: options.EpisodeNumber = None,
    settings: options.Settings = None,
    device: options.Device = "auto",
    seed: options.Seed = 0,
    secret: options.Secret = None,
    port: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="Listen on this port of 127.0.0.1; 0 is any free one. [default: 10000, none with --unix-socket]",
        ),
    ] = None,
    unix_socket: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Listen on a unix socket that only you can use.")
    ] = None,
    no_token: Annotated[
        bool,
        typer.Option("--no-token", help="Let solutions in that use the client of BenchBot v2: it knows no token."),
    ] = False,
    max_steps: options.MaxSteps = None,
    max_simulated_time: options.MaxSimulatedTime = None,
    max_wall_time: options.MaxWallTime = None,
    max_restarts: options.MaxRestarts = None,
    record: options.Record = None,
    despite: options.Despite = None,
    display: options.Display = "auto",
    force_updateless: Annotated[
        bool, typer.Option("--force-updateless", "-f", hidden=True, help="BenchBot v2's; nothing is updated here.")
    ] = False,
    list_tasks: Annotated[bool, listing("tasks", "--list-tasks")] = False,
    list_robots: Annotated[bool, listing("robots", "--list-robots")] = False,
    list_envs: Annotated[bool, listing("environments", "--list-envs", "--list-environments")] = False,
    list_formats: Annotated[bool, listing("formats", "--list-formats")] = False,
    show_task: Annotated[str | None, showing("tasks", "--show-task")] = None,
    show_robot: Annotated[str | None, showing("robots", "--show-robot")] = None,
    show_env: Annotated[str | None, showing("environments", "--show-env", "--show-environment")] = None,
    show_format: Annotated[str | None, showing("formats", "--show-format")] = None,
) -> None:
    """Start a robot in an environment, ready for a solution; Ctrl-C ends it (exit code 130), so does benchbot stop."""
    from benchbot.wire import joining

    starting = ExitStack()
    starting.enter_context(joining.starting())  # imports take their time
    from benchbot.cli.kit.preflight import Intent, Preflight, scenes_of
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.core import overrides
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.core.request import Limits, RunRequest
    from benchbot.core.selection import device_here, select
    from benchbot.supervisor.description import progress_document
    from benchbot.supervisor.serve import serve
    from benchbot.wire.run_state import DEFAULT_PORT

    limits = Limits(max_steps, max_simulated_time, max_wall_time, max_restarts)
    recorded = options.recordings(record)
    changed = overrides.parse(settings or ())
    hidden, overridden = options.secret(secret), tuple(despite or ())
    what = (task, robot, environment, seed, episode, changed, limits)
    request = RunRequest(*what, secret=hidden, despite=overridden, device=device)
    catalog, flight = Catalog(load()), Preflight("This run")
    scenes = scenes_of(catalog, [environment])
    selection = flight.take(select, catalog, request)
    runs_on = None if selection is None else flight.take(device_here, catalog, selection)
    flight.prove(catalog, Intent(scenes, record=recorded))
    console.note(*summary(selection, runs_on))
    if port is None and unix_socket is None:
        port = DEFAULT_PORT

    def announce(state: "RunState") -> None:
        starting.close()
        _announce(state, no_token=no_token)

    with starting, StatusLine(display) as status:

        def show(progress: "Progress") -> None:
            status.show_progress(progress_document(progress, with_pose=True), len(selection.environments))

        ended_by = serve(
            selection,
            port=port,
            unix_socket=unix_socket,
            open_to_v2=no_token,
            record=recorded,
            on_ready=announce,
            on_progress=show,
        )
    console.note("The back end has ended.")
    options.tell_recordings(recorded)
    if ended_by is not None:
        raise typer.Exit(ExitCode.INTERRUPTED)


def summary(selection: "Selection", device: str | None = None) -> list[str]:
    """Return a summary of the run, a line for each part; `device` is what it is computed on, None where nobody says."""
    from benchbot.core import overrides
    from benchbot.core.provenance import source_of_pose

    real = source_of_pose(selection) == "robot"
    rows = [
        ("Task", selection.task.name),
        ("Robot", f"{selection.robot.name} ({selection.robot.data['type']})"),
        ("Environment", selection.environment),
        *((f"  scene {number}", _scene(scene.data)) for number, scene in enumerate(selection.environments, 1)),
        *([("Settings", overrides.label(selection.settings))] if selection.settings else ()),
        *(() if selection.episode is None else [("Episode", _episode(selection.episode))]),
        ("Results", "any JSON" if selection.results_format is None else selection.results_format.name),
        ("Seed", str(selection.seed)),
        *(() if selection.commitment is None else [("Commitment", selection.commitment)]),
        ("Limits", _limits(selection.limits)),
        *([("Device", device)] if device else ()),
        *([("Diagnosis", "of the robot, before anything moves it")] if real else ()),
    ]
    return [f"{label:<13}{value}" for label, value in rows]


def _scene(environment: dict[str, object]) -> str:
    from benchbot.core.platform import Scene

    scene = Scene(environment, Path())
    x, y, _ = scene.start_pose.translation_xyz
    trajectory = f", trajectory of {len(scene.trajectory)} poses" if scene.trajectory else ""
    return f"{environment['name']}:{environment['variant']}, starts at ({x:.2f}, {y:.2f}) m{trajectory}"


def _episode(episode: "Episode") -> str:
    goal = episode.goal
    last = len(episode.listed.data["episodes"]) - 1
    told = f"{episode.number} of 0 to {last}, {episode.data['id']}"
    if isinstance(goal, dict):
        return f"{told}: {goal['object']} to {goal['place']}"
    where = goal if isinstance(goal, str) else f"({goal[0]:.2f}, {goal[1]:.2f}) m from the start"
    return f"{told}: to {where}"


def _limits(limits: "Limits") -> str:
    asked = (
        (limits.steps, "steps"),
        (limits.simulated_time_s, "s of simulated time"),
        (limits.wall_time_s, "s of wall time"),
        (limits.restarts, "restarts"),
    )
    return ", ".join(f"{limit:g} {unit}" for limit, unit in asked if limit is not None) or "none"


def _announce(state: "RunState", *, no_token: bool) -> None:
    console.findings(state.findings)
    where = " and ".join(filter(None, (state.connection.url, state.connection.socket)))
    console.note(f"{'Listening':<13}{where}")
    console.note(f"{'Logs':<13}{state.folder}")
    if no_token:
        who = "every program of yours" if state.connection.url is None else "every user and program of this machine"
        console.note(
            f"{'Token':<13}not needed by BenchBot v2's client, which has none: {who} can move the robot, "
            "and see what it sees."
        )
        if state.connection.url is not None:
            console.note(f"{'':<13}It finds this run by: http_proxy={state.connection.url} python my_solution.py")
    console.note(
        "", "Ready. In another terminal: benchbot submit --native python my_solution.py   (Ctrl-C ends the run)"
    )
