"""`benchbot batch`: many episodes, unattended: every robot in every environment, over night."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from benchbot.cli.kit import console, requirement
from benchbot.cli.kit.holding import (
    Containerised,
    CpuTime,
    FileSize,
    Memory,
    Processes,
    Readable,
    SandboxCommand,
)
from benchbot.cli.kit.options import (
    QUICK,
    Display,
    Json,
    MaxSimulatedTime,
    MaxSteps,
    MaxWallTime,
    Requirements,
)
from benchbot.cli.legacy_options import listing, showing
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.batch import following, solution_options
from benchbot.plugins.batch.following import Detach, Jobs

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.finishing import Profile
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.plan import Plan
    from benchbot.plugins.batch.preparation import Preview
    from benchbot.plugins.batch.worker_pool import Crew

DEFAULT = "run"


class RunsByDefault(TyperGroup):
    """A group whose sub-command `run` need not be named: `benchbot batch --task …`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take what is no sub-command for the words of `run`."""
        if args and args[0] not in self.commands and args != ["--help"]:
            args = [DEFAULT, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=RunsByDefault,
    help="Compute many episodes: every robot in every environment, with every seed and setting.",
    epilog="Without a command it is `run`: benchbot batch --task … (benchbot batch run --help lists the options).",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)

for _command in (following.status, following.logs, following.cancel, following.attach, following.retry):
    app.command()(_command)


@app.command(DEFAULT)
def run(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE.yaml]", help="A batch file that holds any of the options below.")
    ] = None,
    task: Annotated[str | None, typer.Option("--task", "-t", metavar="TASK", help="The task.")] = None,
    robots: Annotated[
        str | None, typer.Option("--robots", "--robot", "-r", metavar="ROBOT,ROBOT", help="The robots.")
    ] = None,
    environments: Annotated[
        str | None, typer.Option("--envs", "--env", "-e", metavar="ENV,ENV", help="The environments, or")
    ] = None,
    envs_batch: Annotated[
        str | None, typer.Option("--envs-batch", "-E", metavar="BATCH", help="those that a declared batch names.")
    ] = None,
    seeds: Annotated[
        str | None, typer.Option("--seeds", "--seed", metavar="0..4", help="The seeds: 0..4 or 0,3,7. [default: 0]")
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Compute each N times: for solutions that differ.")
    ] = None,
    episodes: Annotated[
        str | None,
        typer.Option("--episodes", "--episode", metavar="0..4", help="Starts and goals, in a task that has a list."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=V,V", help="Change the environments: one episode for each value; repeatable."
        ),
    ] = None,
    native: Annotated[
        str | None, typer.Option("--native", "-n", metavar="COMMAND", help="Run this command on this machine, or")
    ] = None,
    example: Annotated[str | None, typer.Option("--example", metavar="NAME", help="an example solution.")] = None,
    sandbox: SandboxCommand = None,
    sandboxed: Annotated[bool | None, typer.Option("--sandboxed", help="Hold the example in a sandbox, too.")] = None,
    readable: Readable = None,
    containerised: Containerised = None,
    example_containerised: Annotated[
        bool | None, typer.Option("--example-containerised", help="Run the example in a container instead.")
    ] = None,
    weak_limits: Annotated[
        bool | None, typer.Option("--weak-limits", help="Run it even where the engine ignores limits, if you trust it.")
    ] = None,
    memory: Memory = None,
    processes: Processes = None,
    cpu_time: CpuTime = None,
    file_size: FileSize = None,
    args: Annotated[
        str | None, typer.Option("--args", "-a", metavar="WORDS", help="Words to append to the command, in quotes.")
    ] = None,
    evaluate_with: Annotated[
        str | None, typer.Option("--evaluate-with", metavar="METHOD", help="Score the results with this method.")
    ] = None,
    require: Requirements = None,
    archive: Annotated[bool, typer.Option("--zip", "-z", help="Put the results into a ZIP archive, too.")] = False,
    record: Annotated[
        list[str] | None,
        typer.Option("--record", metavar="RECORDER", help="Record beside each result, e.g. mcap,video; repeatable."),
    ] = None,
    max_steps: MaxSteps = None,
    max_simulated_time: MaxSimulatedTime = None,
    max_wall_time: MaxWallTime = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0, help="End a solution that runs longer than this.")
    ] = None,
    stall_after: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0,
            help="End a solution that makes no progress for so long; 0: never. [default: 1800]",
        ),
    ] = None,
    retries: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            help="Try again after failures of simulator or machine, never of the agent. [default: 2]",
        ),
    ] = None,
    rerun_collided: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, help="Try again after collisions, as BenchBot v2 did. [default: 0]"),
    ] = None,
    stale_after: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=1, help="A worker that is silent for so long is lost. [default: 30]"),
    ] = None,
    min_free_gb: Annotated[
        float | None,
        typer.Option(metavar="GIB", min=0, help="Begin nothing while less is free on the disk. [default: 0.2]"),
    ] = None,
    jobs: Jobs = None,
    executor: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Where: see benchbot list executors. [default: local]"),
    ] = None,
    executor_options: Annotated[
        list[str] | None,
        typer.Option("--executor-option", metavar="KEY=VALUE", help="What the executor is told beside; repeatable."),
    ] = None,
    cpus: Annotated[int | None, typer.Option(metavar="N", min=1, help="Processor cores for each worker.")] = None,
    gpus: Annotated[int | None, typer.Option(metavar="N", min=0, help="GPUs for each worker. [default: 0]")] = None,
    memory_gb: Annotated[float | None, typer.Option(metavar="GIB", min=0, help="Memory for each worker.")] = None,
    time_limit: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0, help="How long a worker may run, on a cluster.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output-location", "-o", metavar="DIR", help="The folder. [default: batch-HASH here]"),
    ] = None,
    prefix: Annotated[
        str | None,
        typer.Option("--prefix", "-p", metavar="TEXT", help="Leave TEXT_0.json … here as well, as BenchBot v2 does."),
    ] = None,
    update: Annotated[
        bool, typer.Option("--update", help="Go on in a folder whose batch was another one; keep what is the same.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be computed, and end.")] = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
    list_batches: Annotated[bool, listing("batches", "--list-batches")] = False,
    show_batch: Annotated[str | None, showing("batches", "--show-batch")] = None,
) -> None:
    """Compute every combination of robots, environments, seeds and settings; the default.

    The same command again goes on where it was ended. Ctrl-C ends it in order; what is finished stays.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch import file as files
    from benchbot.plugins.batch import matrix, preparation
    from benchbot.plugins.batch.folder import Folder

    requirements = requirement.parse(require)
    catalog = Catalog(load())
    told = files.read(file) if file is not None else {}
    given = {
        "task": task,
        "robots": robots,
        "environments": _environments(catalog, environments, envs_batch),
        "seeds": seeds,
        "repeats": repeats,
        "episodes": episodes,
        "set": settings,
        "native": native,
        "example": example,
        "sandbox": sandbox,
        "sandboxed": sandboxed,
        "readable": None if readable is None else [str(path) for path in readable],
        "containerised": None if containerised is None else str(containerised),
        "example_containerised": example_containerised,
        "weak_limits": weak_limits,
        "memory": memory,
        "processes": processes,
        "cpu_time_s": cpu_time,
        "file_size": file_size,
        "args": args,
        "evaluate_with": evaluate_with,
        "record": None if record is None else [name for text in record for name in text.split(",")],
        "limits": {"steps": max_steps, "simulated_time_s": max_simulated_time, "wall_time_s": max_wall_time},
        "timeout_s": timeout,
        "stall_s": stall_after,
        "retries": retries,
        "rerun_collided": rerun_collided,
        "stale_s": stale_after,
        "minimum_free_bytes": None if min_free_gb is None else int(min_free_gb * 2**30),
        "zip": archive or None,
        "jobs": jobs,
        "executor": executor,
        "executor_options": _options(executor_options),
        "cpus": cpus,
        "gpus": gpus,
        "memory_gb": memory_gb,
        "time_limit_s": time_limit,
    }
    wanted = files.merged(told, given)
    request = replace(files.request(wanted), hold=solution_options.hold_of(catalog, wanted))
    if requirements and request.method is None:
        raise BenchbotError(
            "There will be no score.",
            "--require is about scores, and no method was named.",
            "Name one: --evaluate-with omq",
        )
    plan = matrix.make(request, catalog, Path.cwd())
    folder = Folder((output or preparation.default_folder(plan, prefix or "batch")).absolute())
    sources = matrix.files_of(plan, catalog)
    if dry_run or sources.unread:
        console.note(sources.text)
    if dry_run:
        _show_plan(preparation.preview(folder, plan), folder, as_json=as_json)
        return
    crew = _crew(wanted, len(plan.episodes))
    if crew.executor == "local":
        solution_options.check_here(plan, catalog, crew.resources.gpus)
    found = preparation.prepare(folder, plan, update=update)
    console.note(f"Batch {plan.hash[:8]} in {folder.path}\n{found.text}")
    profile = following.drive(
        folder, crew, catalog, plan, archive=bool(wanted.get("zip")), detach=detach, display=display, as_json=as_json
    )
    if profile is not None and prefix is not None:
        _write_v2(folder, plan, profile, prefix)
    if profile is not None and profile.scores is not None:
        requirement.check(requirements, profile.scores["scores"])
    following.exit_as_it_ended(folder, plan, detached=detach)


def _environments(catalog: "Catalog", names: str | None, batch: str | None) -> Sequence[str] | None:
    if names is not None and batch is not None:
        raise BenchbotError(
            "The environments are named twice.", "--envs and --envs-batch exclude each other.", "Leave one of them out."
        )
    if batch is not None:
        found: list[str] = catalog.get("batches", batch).data["environments"]
        return found
    return None if names is None else [name.strip() for name in names.split(",") if name.strip()]


def _options(texts: Sequence[str] | None) -> dict[str, str] | None:
    if texts is None:
        return None
    found = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator or not key:
            raise BenchbotError(
                f"--executor-option {text} sets nothing.",
                "An option is a name, an equals sign and a value.",
                "Write it like this: --executor-option partition=gpu",
            )
        found[key] = value
    return found


def _crew(wanted: dict[str, Any], episodes: int) -> "Crew":
    """Return the crew that was asked for: locally, no more workers than there is room for."""
    from benchbot.core.records import Resources
    from benchbot.plugins.batch import capacity
    from benchbot.plugins.batch.worker_pool import Crew

    executor = str(wanted.get("executor", "local"))
    memory = int(wanted["memory_gb"] * 2**30) if "memory_gb" in wanted else None
    here = capacity.of_this_machine()
    room = here.jobs(memory or capacity.MEMORY_PER_WORKER_BYTES)
    jobs = min(int(wanted.get("jobs", room if executor == "local" else 1)), episodes)
    if executor == "local" and memory is not None and jobs > room:
        console.note(
            f"There is memory for {room} workers of {wanted['memory_gb']:g} GiB: {room} are started, not {jobs}."
        )
        jobs = room
    cpus = int(wanted.get("cpus", max(1, here.cpus // jobs) if executor == "local" else 1))
    resources = Resources(cpus, int(wanted.get("gpus", 0)), memory, wanted.get("time_limit_s"))
    options = {str(key): str(value) for key, value in wanted.get("executor_options", {}).items()}
    return Crew(executor, jobs, resources, options)


def _show_plan(found: "Preview", folder: "Folder", *, as_json: bool) -> None:
    done = {episode.key for episode in found.done}
    if as_json:
        document = found.plan.as_dict()
        rows = [{**episode, "done": episode["key"] in done} for episode in document["episodes"]]
        console.data_json({**document, "episodes": rows, "folder": str(folder.path)})
    else:
        states = [(episode.name, "done" if episode.key in done else "to do") for episode in found.plan.episodes]
        console.table(("episode", "state"), states)
    console.note(f"Batch {found.plan.hash[:8]} in {folder.path}\n{found.text}")


def _write_v2(folder: "Folder", plan: "Plan", profile: "Profile", prefix: str) -> None:
    from benchbot.plugins.batch import finishing

    try:
        for path in finishing.write_v2(folder, plan, profile, prefix):
            console.note(f"Wrote {path}")
    except OSError as error:
        raise BenchbotError(
            f"The results cannot be written as {prefix}_0.json and so on.",
            f"{error.strerror}.",
            f"They are safe in {folder.path}; choose another --prefix.",
            exit_code=ExitCode.INTERNAL,
        ) from error
