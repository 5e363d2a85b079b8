"""`benchbot batch`: many episodes, unattended: every robot in every environment, over night."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from benchbot.cli.kit import console, requirement
from benchbot.cli.kit.options import QUICK, Display, Json, Requirements
from benchbot.cli.show import listing, showing
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.batch import extension, following, solution_options
from benchbot.plugins.batch.following import Detach
from benchbot.plugins.batch.options import LIMITS, GroupedCommand, with_options

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.folder import Folder, Preview
    from benchbot.plugins.batch.plan import Plan
    from benchbot.plugins.batch.source_files import SourceFiles
    from benchbot.plugins.batch.worker_pool import WorkerPool

DEFAULT = "run"


class RunsByDefault(TyperGroup):
    """A group whose sub-command `run` need not be named: `benchbot batch --task …`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take words that begin with no sub-command, nor with what is nearly one, for those of `run`."""
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            mistyped = not Path(args[0]).exists() and did_you_mean(args[0], list(self.commands))
            args = args if mistyped else [DEFAULT, *args]
        return super().parse_args(ctx, args)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options of `run`, then the sub-commands."""
        self.commands[DEFAULT].format_options(ctx, formatter)
        self.format_commands(ctx, formatter)


app = typer.Typer(
    cls=RunsByDefault,
    help="Compute many episodes: every robot in every environment, with every seed and setting.",
    epilog="Without a command it is `run`, which has these options: benchbot batch --task …",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)

for _command in (
    following.status,
    following.logs,
    following.cancel,
    following.attach,
    following.retry,
    extension.extend,
):
    app.command()(_command)


@app.command(DEFAULT, cls=GroupedCommand)
@with_options
def run(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE.yaml]", help="A batch file that holds any of the options below.")
    ] = None,
    *,
    require: Requirements = None,
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
    **given: Any,
) -> None:
    """Compute every combination of robots, environments, seeds and settings; the default.

    The same command again goes on where it was ended. Ctrl-C ends it in order; what is finished stays.
    """
    from benchbot.cli.kit.preflight import Preflight, scenes_of
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch import matrix, solution_axis
    from benchbot.plugins.batch import request as requests
    from benchbot.plugins.batch.finalization import write_v2
    from benchbot.plugins.batch.folder import Folder, first_line, prepare, preview
    from benchbot.plugins.batch.plan import KEY_DIGITS

    requirements = requirement.parse(require)
    catalog = Catalog(load())
    given["limits"] = {key: given.pop(f"limits_{key}") for key in LIMITS}
    envs_batch = given.pop("envs_batch")
    if envs_batch is not None:
        if given["environments"] is not None:
            raise BenchbotError(
                "The environments are named twice.",
                "--envs and --envs-batch exclude each other.",
                "Leave one of them out.",
            )
        given["environments"] = catalog.get("batches", envs_batch).data["environments"]
    wanted = requests.merged({} if file is None else requests.read_file(file), given)
    request = requests.request_of(wanted)
    each = solution_axis.each(wanted)
    if prefix is not None and None not in each:
        raise BenchbotError(
            "BenchBot v2 knows no names of solutions.",
            "--prefix leaves the files of one solution here, and --solution names several.",
            "Leave --prefix out: the results of each are in the batch's folder, below results.",
        )
    if requirements and request.method is None:
        raise BenchbotError(
            "There will be no score.",
            "--require is about scores, and no method was named.",
            "Name one: --evaluate-with omq",
        )
    flight = Preflight("This batch")
    scenes = scenes_of(catalog, request.environments)
    device: str | None = None
    made = flight.take(solution_axis.plan, each, catalog, Path.cwd())
    plan, sources = (None, {}) if made is None else made
    if plan is None:
        flight.take(matrix.selections, request, catalog)
    # The same command finds its folder again.
    place = Path() if plan is None else Path(f"{prefix or 'batch'}-{plan.hash[:KEY_DIGITS]}")
    folder = Folder((output or place).absolute())
    pool = replace(_worker_pool(wanted, 1 if plan is None else len(plan.episodes)), detached=detach)
    if plan is not None and pool.executor == "local":
        device = flight.take(matrix.device_of, plan, catalog)
    flight.prove(catalog, solution_options.intent(request, plan, folder, pool, catalog, scenes), tell_all=dry_run)
    said = [f"Workers simulate on {device}"] if device else []
    said += [f"{name}: {line}" if name else line for name, one in sources.items() for line in one.lines]
    if dry_run:
        console.note(*said)
        _show_plan(preview(folder, plan), folder, as_json=as_json)
        return
    pool = replace(pool, archive=bool(wanted.get("zip")))
    if pool.executor == "local":
        solution_options.check_here(plan, catalog, pool.resources.gpus)
    found = prepare(folder, plan, update=update, keep=lambda: _keep(folder, plan, sources, catalog))
    plan = found.plan
    console.note(first_line(folder, plan), *found.lines, *said)
    ended = following.drive(folder, pool, catalog, plan, display=display, as_json=as_json)
    if ended.products is not None and prefix is not None:
        for path in write_v2(folder, plan, ended.products, prefix):
            console.note(f"Wrote {path}")
    for scores in [] if ended.products is None else ended.products.scores_of.values():
        requirement.check(requirements, scores["scores"])
    following.exit_as_it_ended(ended.status)


def _keep(folder: "Folder", plan: "Plan", sources: "Mapping[str | None, SourceFiles]", catalog: "Catalog") -> None:
    """Put what the plan is about into its folder; the workers of another plan there are ended."""
    from benchbot.plugins.batch import driver, matrix, solutions
    from benchbot.plugins.batch import plan as plans

    if folder.plan.exists() and plans.read(folder.plan).hash != plan.hash:
        driver.end_workers(folder)
    for name, alone in plan.each().items():
        command, ran_in = matrix.command_of(alone.solution, catalog)
        solutions.keep(sources[name], command, ran_in, folder.solutions, console.note)


def _worker_pool(wanted: dict[str, Any], episodes: int) -> "WorkerPool":
    """Return the pool that was asked for: locally, no more workers than there is room for."""
    from benchbot.core.records import Resources
    from benchbot.plugins.batch import machine
    from benchbot.plugins.batch.worker_pool import WorkerPool

    executor = str(wanted.get("executor", "local"))
    memory = int(wanted["memory_gb"] * 2**30) if "memory_gb" in wanted else None
    here = machine.free_capacity()
    room = here.jobs(memory or machine.MEMORY_PER_WORKER_BYTES)
    jobs = min(int(wanted.get("jobs", room if executor == "local" else 1)), episodes)
    if (
        jobs > 1
        and wanted.get("v2_client")
        and not (wanted.get("containerised") or wanted.get("example_containerised"))
    ):
        console.note("BenchBot v2's client saves each result to the same file: one worker is started.")
        jobs = 1
    if executor == "local" and memory is not None and jobs > room:
        console.note(
            f"There is memory for {room} workers of {wanted['memory_gb']:g} GiB: {room} are started, not {jobs}."
        )
        jobs = room
    cpus = int(wanted.get("cpus", max(1, here.cpus // jobs) if executor == "local" else 1))
    resources = Resources(cpus, int(wanted.get("gpus", 0)), memory, wanted.get("time_limit_s"))
    return WorkerPool(executor, jobs, resources, _executor_options(wanted.get("executor_options", {})))


def _executor_options(given: Mapping[str, object] | Sequence[str]) -> dict[str, str]:
    """Return the options of a file's mapping, or of texts such as `partition=gpu`."""
    if isinstance(given, Mapping):
        return {key: str(value) for key, value in given.items()}
    found = {}
    for text in given:
        key, separator, value = text.partition("=")
        if not separator or not key:
            raise BenchbotError(
                f"--executor-option {text} sets nothing.",
                "An option is a name, an equals sign and a value.",
                "Write it like this: --executor-option partition=gpu",
            )
        found[key] = value
    return found


def _show_plan(found: "Preview", folder: "Folder", *, as_json: bool) -> None:
    done = {episode.key for episode in found.done}
    if as_json:
        document = {key: value for key, value in found.plan.as_dict().items() if key != "secret"}
        rows = [{**episode, "done": episode["key"] in done} for episode in document["episodes"]]
        console.data_json({**document, "episodes": rows, "folder": str(folder.path)})
    else:
        states = [(episode.name, "done" if episode.key in done else "to do") for episode in found.plan.episodes]
        console.table(("episode", "state"), states)
    console.note(f"Batch {found.plan.hash[:8]} in {folder.path}", *found.lines)
