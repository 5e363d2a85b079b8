"""The plug-in's hooks: the set of environments, and its splits as batches."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import EnvironmentSet, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_environment_sets() -> Iterator[EnvironmentSet]:
    """Yield the set."""
    yield EnvironmentSet(
        "thousand",
        1000,
        target("benchbot_envs_thousand.making:make"),
        "Generated apartments, houses, offices and companies of one to eight rooms.",
        target("benchbot_envs_thousand.making:is_made"),
    )


@hookimpl
def benchbot_batches() -> Iterator[Path]:
    """Yield the folder of the batches: one for each split."""
    yield Path(__file__).parent / "batches"
