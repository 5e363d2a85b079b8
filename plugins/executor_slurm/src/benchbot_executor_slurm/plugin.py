"""The plug-in's hook: one executor."""

from collections.abc import Iterable

from benchbot.plugin import Check, Executor, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_executors() -> Iterable[Executor]:
    """Yield `slurm`."""
    yield Executor(
        "slurm",
        launch=target("benchbot_executor_slurm.submission:launch"),
        attach=target("benchbot_executor_slurm.array_job:ArrayJob.attach"),
        description="An array job of a Slurm cluster; the folder must be on its shared disk.",
    )


@hookimpl
def benchbot_checks() -> Iterable[Check]:
    """Yield whether there is a cluster that could run the workers."""
    yield Check("slurm", target("benchbot_executor_slurm.submission:check"))
