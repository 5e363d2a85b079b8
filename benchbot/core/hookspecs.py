"""The hooks that a plug-in may implement.

A plug-in is a module (or object) named by an entry point in the group `benchbot`. It marks its implementations with
`benchbot.plugin.hookimpl`. Keep the module light: name code by `target("module:attribute")`, or import it in functions.
"""

import importlib
import warnings
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import pluggy

from benchbot.core import light_records, records

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
    from pathlib import Path

hookspec = pluggy.HookspecMarker("benchbot")


@hookspec
def benchbot_tasks() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield task declarations: YAML files, or folders of them."""


@hookspec
def benchbot_robots() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield robot declarations: YAML files, or folders of them."""


@hookspec
def benchbot_environments() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield environment declarations: YAML files, or folders of them."""


@hookspec
def benchbot_formats() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield declarations of result and ground-truth formats: YAML files, or folders of them."""


@hookspec
def benchbot_ground_truths() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield ground truths: JSON files, or folders of them. They are read by evaluation only."""


@hookspec
def benchbot_examples() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield declarations of example solutions: YAML files, or folders of them."""


@hookspec
def benchbot_batches() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield batch declarations (named lists of environments): YAML files, or folders of them."""


@hookspec
def benchbot_episodes() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield episode lists: JSON files, or folders of them."""


@hookspec
def benchbot_simulators() -> Iterable[records.Simulator]:  # type: ignore[empty-body]
    """Yield simulators."""


@hookspec
def benchbot_robot_drivers() -> Iterable[records.RobotDriver]:  # type: ignore[empty-body]
    """Yield drivers of real robots."""


@hookspec
def benchbot_evaluators() -> Iterable[records.Evaluator]:  # type: ignore[empty-body]
    """Yield methods of evaluation."""


@hookspec
def benchbot_executors() -> Iterable[light_records.Executor]:  # type: ignore[empty-body]
    """Yield executors of batches."""


@hookspec
def benchbot_recorders() -> Iterable[light_records.Recorder]:  # type: ignore[empty-body]
    """Yield recorders of sessions."""


@hookspec
def benchbot_asset_packs() -> Iterable[light_records.AssetPack]:  # type: ignore[empty-body]
    """Yield packs of models for scenes."""


@hookspec
def benchbot_environment_sets() -> Iterable[light_records.EnvironmentSet]:  # type: ignore[empty-body]
    """Yield sets of environments that are made when they are first asked for."""


@hookspec
def benchbot_commands() -> Iterable[light_records.Command]:  # type: ignore[empty-body]
    """Yield sub-commands of `benchbot`."""


@hookspec
def benchbot_screens() -> Iterable[light_records.TuiScreen]:  # type: ignore[empty-body]
    """Yield screens of `benchbot tui`."""


@hookspec
def benchbot_submission_modes() -> Iterable[light_records.SubmissionMode]:  # type: ignore[empty-body]
    """Yield ways to hold a solution while it runs."""


@hookspec
def benchbot_routes() -> Iterable[light_records.Routes]:  # type: ignore[empty-body]
    """Yield more routes of a run's server."""


@hookspec
def benchbot_checks() -> Iterable[light_records.Check]:  # type: ignore[empty-body]
    """Yield checks that are made before the first episode."""


@hookspec
def benchbot_declaration_sources() -> Iterable[light_records.DeclarationSource]:  # type: ignore[empty-body]
    """Yield sources of declarations besides distributions."""


KINDS: Mapping[str, type] = {
    "simulators": records.Simulator,
    "robot_drivers": records.RobotDriver,
    "evaluators": records.Evaluator,
    "executors": light_records.Executor,
    "recorders": light_records.Recorder,
    "asset_packs": light_records.AssetPack,
    "environment_sets": light_records.EnvironmentSet,
    "commands": light_records.Command,
    "screens": light_records.TuiScreen,
    "submission_modes": light_records.SubmissionMode,
    "routes": light_records.Routes,
    "checks": light_records.Check,
    "declaration_sources": light_records.DeclarationSource,
}
"""Hooks that yield records, by the plural that names their pool."""


def __getattr__(name: str) -> Any:
    # Where plug-ins of BenchBot 0.1 took records and `hookimpl` from.
    if not (name == "hookimpl" or hasattr(records, name) or hasattr(light_records, name)):
        raise AttributeError(f"module 'benchbot.core.hookspecs' has no attribute '{name}'")
    warnings.warn(f"Import {name} from benchbot.plugin: benchbot.core is private.", DeprecationWarning, stacklevel=2)
    return getattr(importlib.import_module("benchbot.plugin"), name)
