"""`benchbot submit`: a solution, run against a back end, its result checked, kept and scored."""

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli import run
from benchbot.cli.kit import console, holding, options, requirement
from benchbot.cli.show import listing, showing
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import Plugins
    from benchbot.core.request import RunRequest
    from benchbot.submission.episode import EndedEpisode
    from benchbot.submission.modes import Mode
    from benchbot.wire.run_state import Connection, RunState

START_PERIOD_S = 0.1


def submit(
    words: Annotated[
        list[str] | None, typer.Argument(metavar="WORDS", help="More words of the command; options go after --.")
    ] = None,
    native: Annotated[
        str | None, typer.Option("--native", "-n", metavar="COMMAND", help="Run this command on this machine.")
    ] = None,
    example: Annotated[
        str | None, typer.Option("--example", "-E", metavar="NAME", help="Run an example solution.")
    ] = None,
    sandbox: holding.SandboxCommand = None,
    sandboxed: holding.Sandboxed = False,
    readable: holding.Readable = None,
    containerised: holding.Containerised = None,
    example_containerised: holding.ExampleContainerised = False,
    submission: Annotated[
        Path | None,
        typer.Option(
            "--submission",
            "-s",
            metavar="FOLDER",
            help="Run nothing: pack this folder as v2 did, into submission.tgz beside it, or what --args names.",
        ),
    ] = None,
    v2_client: holding.V2Client = False,
    cpus: holding.Cpus = None,
    gpus: holding.Gpus = 0,
    weak_limits: holding.WeakLimits = False,
    mode_name: Annotated[
        str | None,
        typer.Option("--mode", metavar="MODE", help="Hold it in a mode that a plug-in brings: benchbot list modes."),
    ] = None,
    mode_options: Annotated[
        list[str] | None,
        typer.Option("--mode-option", metavar="KEY=VALUE", help="What that mode is told beside; repeatable."),
    ] = None,
    memory: holding.Memory = None,
    processes: holding.Processes = None,
    cpu_time: holding.CpuTime = None,
    file_size: holding.FileSize = None,
    log_limit: holding.LogLimit = None,
    args: Annotated[
        str | None, typer.Option("--args", "-a", metavar="WORDS", help="Words to append to the command, in quotes.")
    ] = None,
    results_location: Annotated[
        Path | None, typer.Option("--results-location", "-r", metavar="PATH", help="Write the result here.")
    ] = None,
    evaluate_with: Annotated[
        str | None, typer.Option("--evaluate-with", "-e", metavar="METHOD", help="Score the result with this method.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output-location", "-o", metavar="PATH", help="Write the scores here, not beside the result."),
    ] = None,
    require: options.Requirements = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0, help="End a solution that runs longer than this.")
    ] = None,
    joined: Annotated[
        str | None,
        typer.Option("--run", metavar="ID", help="Join this run of yours: a part of its name that no other has."),
    ] = None,
    task: Annotated[
        str | None, typer.Option("--task", "-t", metavar="TASK", help="Start a back end for this submission: the task,")
    ] = None,
    robot: Annotated[
        str | None, typer.Option("--robot", metavar="ROBOT", help="the robot (one of a fleet: NAME@NAMESPACE),")
    ] = None,
    environment: Annotated[
        str | None, typer.Option("--env", "--environment", metavar="NAME:VARIANT", help="and the environment.")
    ] = None,
    episode_number: options.EpisodeNumber = None,
    settings: options.Settings = None,
    device: options.Device = "auto",
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed", metavar="N", min=0, max=2**63 - 1, help="Everything stochastic draws from it. [default: 0]"
        ),
    ] = None,
    secret: options.Secret = None,
    max_steps: options.MaxSteps = None,
    max_simulated_time: options.MaxSimulatedTime = None,
    max_wall_time: options.MaxWallTime = None,
    max_restarts: options.MaxRestarts = None,
    record: options.Record = None,
    despite: options.Despite = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Prove that it is possible, say what would be run, and end.")
    ] = False,
    display: options.Display = "auto",
    as_json: options.Json = False,
    list_examples: Annotated[bool, listing("examples", "--list-examples")] = False,
    show_example: Annotated[str | None, showing("examples", "--show-example")] = None,
) -> None:
    """Run a solution and keep its result: in the run of yours that is alive, or with a back end of its own.

    \b
    Two terminals:  benchbot run --task T --robot R --env E
                    benchbot submit --native python my_solution.py
    One command:    benchbot submit --task T --robot R --env E --example hello_passive

    Somebody else's solution belongs into a sandbox: --sandbox python their_solution.py; or into a container, built
    from its Dockerfile: --containerised their_folder

    The solution finds the robot through BENCHBOT_URL, BENCHBOT_SOCKET and BENCHBOT_TOKEN, and saves its result to
    BENCHBOT_RESULT. The result's path goes to stdout, or the score when one was asked for.
    """
    from benchbot.api.client import Client
    from benchbot.cli.kit.preflight import Intent, Preflight, Submission, scenes_of
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.core import overrides
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.core.request import AUTO, Limits, RunRequest
    from benchbot.core.selection import device_here, select
    from benchbot.submission import episode
    from benchbot.submission.modes import LOG_LIMIT_BYTES, SolutionSpec, holder_of, spec_of, split_words

    if submission is not None:
        others = {"--native": native, "--sandbox": sandbox, "--example": example, "--containerised": containerised}
        others |= {"--evaluate-with": evaluate_with, "--results-location": results_location, "--task": task}
        _pack(load(), submission, args, others)
        return
    requirements = requirement.parse(require)
    catalog, flight = Catalog(load()), Preflight("This run")
    if evaluate_with is not None:
        flight.take(catalog.plugins.record, "evaluators", evaluate_with)
    elif requirements or output:
        raise BenchbotError(
            "There will be no score.",
            "--require and --output-location are about scores, and no method was named.",
            "Name one: --evaluate-with omq",
        )
    for path in (results_location, output):
        console.check_output(path)
    more_words = [*(words or ()), *split_words("--args", args)]
    log_limit_bytes = holding.size_in_bytes("--log-limit", log_limit) or LOG_LIMIT_BYTES
    bounds = holding.process_limits(memory, processes, cpu_time, file_size)
    contained = holding.container_options(catalog, containerised, example, (native, sandbox), example_containerised)
    held_in_sandbox = sandboxed or sandbox is not None
    mode, asked = holding.plugin_mode(mode_name, mode_options, contained is not None or held_in_sandbox or v2_client)
    if contained is not None:
        mode, asked = holding.CONTAINER, {**contained, "processors": cpus, "gpus": gpus}
    elif held_in_sandbox:
        mode, asked = holding.SANDBOX, {"readable": readable or ()}
    elif v2_client:
        mode = holding.V2_CLIENT
    asked |= {} if mode_name is not None else {"weak_limits": weak_limits, "v2_client": v2_client}
    holding.check_options(mode, readable, bounds, weak_limits, cpus, gpus)
    resolved = {} if mode == holding.NATIVE else holder_of(catalog.plugins, mode).resolved(asked)
    if contained is None:
        spec = flight.take(spec_of, catalog, native, example, more_words, timeout, sandbox)
    else:
        spec = SolutionSpec(more_words, Path.cwd(), timeout_s=timeout)
    if spec is not None:
        spec = replace(spec, limits=bounds, log_limit_bytes=log_limit_bytes)
        if mode != holding.NATIVE:
            holding.check_secret(secret, Path(asked.get("folder", spec.folder)))
    limits = Limits(max_steps, max_simulated_time, max_wall_time, max_restarts)
    names = _names(task, robot, environment)
    if names is not None and joined is not None:
        raise BenchbotError(
            "--run and --task exclude each other.",
            "The one joins a run that is alive, the others start a back end for this submission.",
            "Leave one of them out.",
        )
    recorded = options.recordings(record, results_location)
    changed = overrides.parse(settings or ())
    chosen = seed is not None or episode_number is not None or device != AUTO
    own = (chosen, secret, recorded, changed, limits != Limits(), despite)
    if names is None and any(own):
        raise BenchbotError(
            "The run that is joined has a device, episode, settings, seed, secret, limits, recordings and diagnosis.",
            "--device, --episode, --set, --seed, --secret, --max-…, --record, --despite: for one of submit's own.",
            "Give them to benchbot run, or give --task, --robot and --env as well.",
        )
    scenes = scenes_of(catalog, [environment] if environment is not None else ())
    target: RunRequest | RunState | Connection
    if names is not None:
        folders = {name: str(folder.absolute()) for name, folder in recorded.items()}
        hidden = options.secret(secret)
        what = (*names, seed or 0, episode_number, changed, limits, evaluate_with, folders, hidden)
        target = RunRequest(*what, tuple(despite or ()), device)
        selection = flight.take(select, catalog, target)
        runs_on = None if selection is None else flight.take(device_here, catalog, selection)
        summary = [] if selection is None else run.summary(selection, runs_on)
    intent = Intent(
        scenes=scenes,
        submissions=[] if spec is None else [Submission(spec, mode, resolved)],
        method=evaluate_with,
        record=recorded,
        folders=[path if path.is_dir() else path.parent for path in (results_location, output) if path is not None],
    )
    # Before anything is built or started.
    flight.prove(catalog, intent, tell_all=dry_run)
    if names is None:
        target, summary = _joined(joined, display)
    if dry_run:
        console.note(*summary)
        return
    with ExitStack() as stack:
        stack.enter_context(console.interruptible("the solution and its back end have been ended."))
        spec = stack.enter_context(holding.held(catalog, spec, mode, resolved))
        console.note(*summary)
        connection, died, state = _back_end(stack, target, spec.mode)
        console.findings(() if state is None else state.findings)
        if names is None and evaluate_with is not None:
            there = Client(connection).session()["selection"]["environment"]
            flight.prove(catalog, Intent(scenes_of(catalog, [there]), method=evaluate_with))
        needed, watcher = results_location or evaluate_with, stack.enter_context(StatusLine(display))
        ended = episode.run(spec, connection, died, watcher, state=state, needs_result=needed is not None)
    kept = _kept(ended, results_location)
    options.tell_recordings(recorded)
    if ended.problem is not None or kept is None or evaluate_with is None:
        if as_json:
            console.data_json(_summary(ended, kept))
        elif ended.problem is None:
            console.data(str(kept))
    else:
        _score(catalog, ended, kept, evaluate_with, output, requirements, as_json)
    if ended.problem is not None:
        raise ended.problem


def _pack(plugins: "Plugins", folder: Path, target: str | None, others: Mapping[str, object]) -> None:
    """Pack a solution's folder, by the command `pack`; `others` are options that go together with running one."""
    import pkgutil

    given = [name for name, value in others.items() if value]
    if given:
        raise BenchbotError(
            f"--submission and {given[0]} exclude each other.",
            "With --submission nothing is run: there is no result.",
            "Give one of them. Results and their solution in one file: benchbot bundle",
        )
    pkgutil.resolve_name(plugins.record("commands", "pack").target)(folder, None if target is None else Path(target))


def _kept(ended: "EndedEpisode", location: Path | None) -> Path | None:
    """Write the result where it was asked for; return where it is now, and say so."""
    from benchbot.core import results

    path = ended.path
    if location is not None:
        path = location / "result.json" if location.is_dir() else location
        try:
            results.write_json(path, ended.document)
        except BenchbotError as error:
            if ended.path is not None:
                error.fix += f" The result itself is safe: {ended.path}"
            raise
    if path is not None:
        console.note(f"Result: {path}")
    if ended.problem is None and "results" not in ended.document:
        console.note("The solution saved no results, and nothing asked for them: there will be no score.")
    provenance = ended.document["provenance"]
    if "episode" in provenance["selection"] and provenance.get("restarts"):
        console.note("The robot was put back after it had moved: an episode is one attempt, so this one is no success.")
    if over := provenance.get("taken_over"):
        times = "once" if over["times"] == 1 else f"{over['times']} times"
        console.note(f"A person took the robot over {times}, for {over['duration_s']:.0f} s: the result says so.")
    if provenance.get("driven_by_hand"):
        console.note(f"{provenance['driven_by_hand']} of its actions were taken by hand: the result says so.")
    changed = (provenance["solution"] or {}).get("changed_files")
    if changed:
        console.note(f"Changed while it ran, so the result does not say of which content it is: {', '.join(changed)}")
    failure = provenance["failure"]
    if failure is not None and ended.problem is None:
        console.note(f"The episode ended early ({failure['class']}): {failure['why']}")
    return path


def _score(
    catalog: "Catalog",
    ended: "EndedEpisode",
    result: Path,
    method: str,
    output: Path | None,
    requirements: list[requirement.Requirement],
    as_json: bool,
) -> None:
    from benchbot.cli.kit import scoring
    from benchbot.core.results import write_scores
    from benchbot.evaluation import evaluate_files

    document = evaluate_files([result], method=method, catalog=catalog)
    path = output or result.parent / "scores.json"
    write_scores(path, document)
    console.note(*scoring.table(document))
    console.note(f"Scores: {path}")
    if as_json:
        console.data_json({**_summary(ended, result), "scores_path": str(path), "scores": document["scores"]})
    else:
        console.data(scoring.headline(document))
    requirement.check(requirements, document["scores"])


def _summary(ended: "EndedEpisode", result: Path | None) -> dict[str, Any]:
    return {
        "result_path": None if result is None else str(result),
        "provenance": ended.document["provenance"],
        "error": None if ended.problem is None else ended.problem.as_dict(),
    }


def _names(task: str | None, robot: str | None, environment: str | None) -> tuple[str, str, str] | None:
    """Return what the back end to start is of, or None when a running one is to be used."""
    missing = [flag for flag, value in (("--task", task), ("--robot", robot), ("--env", environment)) if value is None]
    if task is not None and robot is not None and environment is not None:
        return task, robot, environment
    if len(missing) < 3:
        raise BenchbotError(
            "The selection is not complete.",
            f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing.",
            "Give --task, --robot and --env to start a back end, or none of them to use the running one.",
        )
    return None


def _joined(name: str | None, display: options.Display) -> tuple["RunState | Connection", list[str]]:
    """Return the run to join, or how to reach it where no more is known, and which that is.

    Waits for one that is starting. Raises BenchbotError when it is taken, or not clear.
    """
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.supervisor.backend import START_TIMEOUT_S
    from benchbot.wire import joining
    from benchbot.wire.run_state import RUN, live

    there = joining.given() if name is None else None
    addressed = [state for state in live() if state.owner == RUN and state.connection == there]
    if there is not None and not addressed:
        return there, [f"Joins the run at {there.url or there.socket}, which the environment names."]
    if not addressed:
        until_s = time.monotonic() + START_TIMEOUT_S
        with StatusLine(display) as line:
            while joining.is_starting() and (left_s := until_s - time.monotonic()) > 0:
                line.show(f"A run is starting. Waiting for it: {left_s:.0f} s at most", round(left_s))
                time.sleep(START_PERIOD_S)
    state = addressed[0] if addressed else joining.chosen(name)
    lease = joining.lease_of(Path(state.folder))
    if lease is not None:
        raise joining.taken(lease)
    return state, [f"Joins {state.about}."]


def _back_end(
    stack: ExitStack, target: "RunRequest | RunState | Connection", mode: "Mode"
) -> tuple["Connection", Callable[[], BenchbotError | None], "RunState | None"]:
    """Return how to reach the back end, what tells why it died, and its state; it is started here, or joined.

    One that is started ends with `stack`. The state is None for a back end that only its address is known of.
    """
    from benchbot.core.request import RunRequest
    from benchbot.submission.modes import private_socket, unix_socket_of
    from benchbot.supervisor.backend import Backend
    from benchbot.wire import joining
    from benchbot.wire.run_state import SUBMIT, Connection

    if not isinstance(target, RunRequest):
        connection = target if isinstance(target, Connection) else joining.join(target, by_command=True)
        if mode.needs_socket:
            unix_socket_of(mode, connection)
        return connection, lambda: None, None if isinstance(target, Connection) else target
    socket = stack.enter_context(private_socket()) if mode.needs_socket else None
    port = 0 if socket is None else None
    backend = stack.enter_context(Backend.start(target, owner=SUBMIT, port=port, unix_socket=socket))
    return backend.state.connection, backend.died, backend.state
