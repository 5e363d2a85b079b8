"""The plug-in's hook: one executor. Ray is imported when workers are launched."""

from collections.abc import Iterable

from benchbot.plugin import Check, Executor, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_executors() -> Iterable[Executor]:
    """Yield `ray`."""
    yield Executor(
        "ray",
        launch=target("benchbot_executor_ray.workers:launch"),
        attach=target("benchbot_executor_ray.workers:RayWorkers"),
        description="Actors of a Ray cluster; the folder must be on a disk that all nodes share.",
    )


@hookimpl
def benchbot_checks() -> Iterable[Check]:
    """Yield whether there is a cluster that could run the workers."""
    yield Check("ray", target("benchbot_executor_ray.workers:check"))
