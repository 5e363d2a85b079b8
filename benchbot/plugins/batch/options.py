"""The options of `benchbot batch run` that a batch file can hold as well: each is declared once, by its key there."""

import inspect
from collections import defaultdict
from collections.abc import Callable
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperCommand

from benchbot.cli.kit.holding import CpuTime, FileSize, LogLimit, Memory, Processes
from benchbot.cli.kit.options import MaxRestarts, MaxSimulatedTime, MaxSteps, MaxWallTime
from benchbot.plugins.batch.following import Jobs

LIMITS = ("steps", "simulated_time_s", "wall_time_s", "restarts")
"""The keys within a batch file's `limits`; in the table they begin with `limits_`."""


def _option(kind: Any, flags: str, metavar: str | None, text: str, **details: Any) -> Any:
    return Annotated[kind | None, typer.Option(*flags.split(), metavar=metavar, help=text, **details)]


def _gib_to_bytes(gib: float | None) -> int | None:
    return None if gib is None else int(gib * 2**30)


OPTIONS: dict[str, dict[str, Any]] = {
    "What to compute": {
        "task": _option(str, "--task -t", "TASK", "The task."),
        "robots": _option(str, "--robots --robot -r", "ROBOT,ROBOT", "The robots."),
        "environments": _option(str, "--envs --env -e", "ENV,ENV", "The environments, or"),
        "envs_batch": _option(str, "--envs-batch -E", "BATCH", "those that a declared batch names."),
        "seeds": _option(str, "--seeds --seed", "0..4", "The seeds: 0..4 or 0,3,7. [default: 0]"),
        "secret": _option(str, "--secret", "FILE", "Draw from this, too: 128 bits that a solution cannot know."),
        "repeats": _option(int, "--repeats", "N", "Compute each N times: for solutions that differ.", min=1),
        "episodes": _option(str, "--episodes --episode", "0..4", "Starts and goals, in a task that has a list."),
        "set": _option(
            list[str], "--set", "KEY=V,V", "Change the environments: one episode for each value; repeatable."
        ),
        "device": _option(
            Literal["auto", "cpu", "cuda"],
            "--device",
            "auto|cpu|cuda",
            "What to simulate on; auto: a GPU, if there is one for the worker and it is free. [default: auto]",
        ),
        "limits_steps": MaxSteps,
        "limits_simulated_time_s": MaxSimulatedTime,
        "limits_wall_time_s": MaxWallTime,
        "limits_restarts": MaxRestarts,
    },
    "The solution": {
        "native": _option(str, "--native -n", "COMMAND", "Run this command on this machine, or"),
        "example": _option(str, "--example", "NAME", "an example solution."),
        "solutions": _option(
            list[str],
            "--solution",
            "NAME=COMMAND",
            "One of several to compare, also NAME=example:E, sandbox:COMMAND, containerised:FOLDER; repeatable.",
        ),
        "args": _option(str, "--args -a", "WORDS", "Words to append to the command, in quotes."),
        "source": _option(
            list[str], "--source", "GLOB", "Files that belong to it, beside those that it imports or names; repeatable."
        ),
        "timeout_s": _option(float, "--timeout", "SECONDS", "End a solution that runs longer than this.", min=0),
        "sandbox": _option(str, "--sandbox", "COMMAND", "Run this command, held in a sandbox."),
        "sandboxed": _option(bool, "--sandboxed", None, "Hold the example in a sandbox, too."),
        "readable": _option(
            list[str], "--readable", "PATH", "Let it read this file or folder in the sandbox; repeatable."
        ),
        "containerised": _option(
            str, "--containerised -c", "FOLDER", "Build the Dockerfile in this folder, and run the container."
        ),
        "example_containerised": _option(
            bool, "--example-containerised", None, "Run the example in a container instead."
        ),
        "weak_limits": _option(
            bool, "--weak-limits", None, "Run it even where limits would not hold, if you trust it."
        ),
        "memory": Memory,
        "processes": Processes,
        "cpu_time_s": CpuTime,
        "file_size": FileSize,
    },
    "Results": {
        "evaluate_with": _option(str, "--evaluate-with", "METHOD", "Score the results with this method."),
        "log_limit": LogLimit,
        "zip": _option(bool, "--zip -z", None, "Put the results into a ZIP archive, too."),
        "record": _option(list[str], "--record", "RECORDER", "Record beside each result, e.g. mcap,video; repeatable."),
    },
    "When something goes wrong": {
        "stall_s": _option(
            float,
            "--stall-after",
            "SECONDS",
            "End a solution that makes no progress for so long; 0: never. [default: 1800]",
            min=0,
        ),
        "canary": _option(
            bool,
            "--canary/--no-canary",
            None,
            "Compute one episode first, and end when it fails as all others would. [default: canary]",
        ),
        "fail_on_error": _option(
            str, "--fail-on-error", "N|FRACTION", "End when so many episodes, or such a part of all, have failed."
        ),
        "retries": _option(
            int,
            "--retries",
            "N",
            "Try again after failures of simulator or machine, never of the agent. [default: 2]",
            min=0,
        ),
        "rerun_collided": _option(
            int, "--rerun-collided", "N", "Try again after collisions, as BenchBot v2 did. [default: 0]", min=0
        ),
        "stale_s": _option(
            float, "--stale-after", "SECONDS", "A worker that is silent for so long is lost. [default: 30]", min=1
        ),
        "minimum_free_bytes": _option(
            float,
            "--min-free-gb",
            "GIB",
            "Begin nothing while less is free on the disk. [default: 0.2]",
            min=0,
            callback=_gib_to_bytes,
        ),
    },
    "Workers": {
        "jobs": Jobs,
        "executor": _option(str, "--executor", "NAME", "Where: see benchbot list executors. [default: local]"),
        "executor_options": _option(
            list[str], "--executor-option", "KEY=VALUE", "What the executor is told beside; repeatable."
        ),
        "cpus": _option(int, "--cpus", "N", "Processor cores for each worker.", min=1),
        "gpus": _option(int, "--gpus", "N", "GPUs for each worker. [default: 0]", min=0),
        "memory_gb": _option(float, "--memory-gb", "GIB", "Memory for each worker.", min=0),
        "time_limit_s": _option(float, "--time-limit", "SECONDS", "How long a worker may run, on a cluster.", min=0),
    },
}
"""The types of the options, with flags and help, by the title of their group and by key; None is not given."""


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command, whose parameters are an argument, options and `**given`, the options of the table as well."""
    signature = inspect.signature(command)
    argument, *own, _ = signature.parameters.values()
    added = [
        inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
        for group in OPTIONS.values()
        for key, kind in group.items()
    ]
    # Typer reads the parameters of a command from its signature.
    vars(command)["__signature__"] = signature.replace(parameters=[argument, *added, *own])
    return command


class GroupedCommand(TyperCommand):
    """A command whose help shows its options by the groups of the table, and its others as `Options`."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the sections of the help."""
        titles = {key: title for title, group in OPTIONS.items() for key in group}
        sections: dict[str, list[tuple[str, str]]] = defaultdict(list)
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                other = "Arguments" if parameter.param_type_name == "argument" else "Options"
                sections[titles.get(str(parameter.name), other)].append(record)
        for title, rows in sections.items():
            with formatter.section(title):
                formatter.write_dl(rows)
