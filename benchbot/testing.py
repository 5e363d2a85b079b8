"""The conformance kit: does a plug-in keep the contracts that BenchBot and its users rely on?

Each `check_…` returns findings, one per property, with the fix where something is wrong. `conform` raises one readable
`Nonconformity` of them; in pytest, the fixture `conforms` does the same and shows what was checked.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.plugins.authoring.conformance.agent import check_agent
    from benchbot.plugins.authoring.conformance.declarations import check_environment, check_robot, check_task
    from benchbot.plugins.authoring.conformance.evaluator import Example, check_evaluator
    from benchbot.plugins.authoring.conformance.executor import check_executor
    from benchbot.plugins.authoring.conformance.platforms import check_robot_driver, check_simulator
    from benchbot.plugins.authoring.conformance.plugin import check_plugin
    from benchbot.plugins.authoring.conformance.properties import Nonconformity, as_text, conform
    from benchbot.plugins.authoring.conformance.recorder import check_recorder

__all__ = [
    "Example",
    "Nonconformity",
    "as_text",
    "check_agent",
    "check_environment",
    "check_evaluator",
    "check_executor",
    "check_plugin",
    "check_recorder",
    "check_robot",
    "check_robot_driver",
    "check_simulator",
    "check_task",
    "conform",
]

_MODULES = {
    "Example": "evaluator",
    "Nonconformity": "properties",
    "as_text": "properties",
    "check_agent": "agent",
    "check_environment": "declarations",
    "check_evaluator": "evaluator",
    "check_executor": "executor",
    "check_plugin": "plugin",
    "check_recorder": "recorder",
    "check_robot": "declarations",
    "check_robot_driver": "platforms",
    "check_simulator": "platforms",
    "check_task": "declarations",
    "conform": "properties",
}


def __getattr__(name: str) -> Any:
    # pytest imports this module in everybody's test runs, to find the fixture: it must cost next to nothing.
    if name not in _MODULES:
        raise AttributeError(f"module 'benchbot.testing' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"benchbot.plugins.authoring.conformance.{_MODULES[name]}"), name)
