"""Workers as an array job."""

import shlex
import uuid
from collections.abc import Iterator
from pathlib import Path

from benchbot.cli.kit.preflight import Intent
from benchbot.plugin import BenchbotError, Catalog, Finding, Level, WorkOrder, did_you_mean
from benchbot_executor_slurm import nodes, options, script
from benchbot_executor_slurm.array_job import ArrayJob
from benchbot_executor_slurm.commands import Answer, ask, check_here


def launch(order: WorkOrder) -> ArrayJob:
    """Submit the workers; raise BenchbotError with Slurm's message if it rejects them."""
    check_here()
    options.check(order)
    workers = order.logs
    workers.mkdir(parents=True, exist_ok=True)
    path = workers / f"slurm-{uuid.uuid4().hex[:8]}.sh"
    path.write_text(script.text(order, _setup(order)), "utf-8")
    command = [*_command(order), f"--output={_literally(workers)}/slurm-%A-%a.log", str(path)]
    answer = ask(*command)
    if answer.code != 0:
        path.unlink()
        raise _rejected(answer, order, command)
    # With several clusters sbatch says `JOB;CLUSTER`.
    return ArrayJob(answer.said.split(";")[0], order.count)


def check(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield when Slurm would run the workers; raises BenchbotError as `launch` does, and submits nothing."""
    order = intent.order
    if intent.executor != "slurm" or order is None:
        return
    check_here()
    options.check(order)
    _setup(order)
    command = [*_command(order), "--test-only", "--output=/dev/null", "--wrap=true"]
    answer = ask(*command)
    if answer.code != 0:
        raise _rejected(answer, order, command)
    yield Finding(Level.OK, "Slurm", answer.complaint.removeprefix("sbatch: ") or "takes the workers")


def _command(order: WorkOrder) -> list[str]:
    """Return the words of `sbatch`, without its script."""
    return [
        "sbatch",
        "--parsable",
        f"--array=0-{order.count - 1}",
        f"--job-name=benchbot-{order.folder.name}",
        "--open-mode=append",
        "--requeue",
        f"--signal=B:TERM@{options.WARNING_S}",
        "--export=ALL",
        "--nodes=1",
        "--ntasks=1",
        *options.flags(order),
    ]


def _setup(order: WorkOrder) -> Path | None:
    chosen = order.options.get(options.SETUP)
    if chosen is None:
        return None
    path = Path(chosen).resolve()
    if not path.is_file():
        raise BenchbotError(
            "The file that workers are to read first is not there.",
            f"{path} is not a file.",
            "Correct --executor-option setup=FILE.",
        )
    return path


def _literally(path: Path) -> str:
    """Return a path in which Slurm replaces nothing."""
    return str(path).replace("%", "%%")


def _rejected(answer: Answer, order: WorkOrder, command: list[str]) -> BenchbotError:
    said = " ".join(
        line.removeprefix("sbatch: error: ").removeprefix("allocation failure: ")
        for line in answer.complaint.splitlines()
    )
    return BenchbotError("Slurm does not take the batch.", said or "It does not say why.", _fix(said, order, command))


def _fix(said: str, order: WorkOrder, command: list[str]) -> str:
    if "partition" in said.lower():
        known = nodes.partitions()
        choice = f"Choose one of its partitions: --executor-option partition=NAME, of {', '.join(known)}."
        return choice + did_you_mean(order.options.get("partition", ""), known)
    if "configuration" in said:
        return f"{nodes.ADVICE} {nodes.offer()}"
    return f"Correct what it names, by --executor-option NAME=VALUE. The command was: {shlex.join(command)}"
