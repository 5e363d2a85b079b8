"""The conformance kit: does a plug-in keep the contracts that BenchBot and its users rely on?

Each `check_…` returns what it looked at as findings, one per property, with the fix where something is wrong. `conform`
raises one readable `Nonconformity` of them; in pytest, the fixture `conforms` does the same and shows what was checked.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.testing.agent import check_agent as check_agent
    from benchbot.testing.environment import check_environment as check_environment
    from benchbot.testing.evaluator import Example as Example
    from benchbot.testing.evaluator import check_evaluator as check_evaluator
    from benchbot.testing.executor import check_executor as check_executor
    from benchbot.testing.platforms import check_robot_driver as check_robot_driver
    from benchbot.testing.platforms import check_simulator as check_simulator
    from benchbot.testing.plugin import check_plugin as check_plugin
    from benchbot.testing.properties import Nonconformity as Nonconformity
    from benchbot.testing.properties import as_text as as_text
    from benchbot.testing.properties import conform as conform
    from benchbot.testing.recorder import check_recorder as check_recorder
    from benchbot.testing.robot import check_robot as check_robot
    from benchbot.testing.task import check_task as check_task

_HOMES = {
    "Example": "evaluator",
    "Nonconformity": "properties",
    "as_text": "properties",
    "check_agent": "agent",
    "check_environment": "environment",
    "check_evaluator": "evaluator",
    "check_executor": "executor",
    "check_plugin": "plugin",
    "check_recorder": "recorder",
    "check_robot": "robot",
    "check_robot_driver": "platforms",
    "check_simulator": "platforms",
    "check_task": "task",
    "conform": "properties",
}


def __getattr__(name: str) -> Any:
    # pytest imports this package in everybody's test runs, to find the fixture: it must cost next to nothing.
    if name not in _HOMES:
        raise AttributeError(f"module 'benchbot.testing' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"benchbot.testing.{_HOMES[name]}"), name)
