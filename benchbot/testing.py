"""The conformance kit: does a plug-in keep the contracts that BenchBot and its users rely on?

Each `check_…` returns findings, one per property, with the fix where something is wrong. `conform` raises one readable
`Nonconformity` of them; in pytest, the fixture `conforms` does the same and shows what was checked.

Those of a `Sight`, which is what a robot observed at one instant, are pure functions: of the robot's declaration, and
of what is known to stand there.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.plugins.authoring.comparability.across import check_boxes, check_laser, check_map
    from benchbot.plugins.authoring.comparability.checks import check_senses
    from benchbot.plugins.authoring.comparability.senses import Sight
    from benchbot.plugins.authoring.comparability.world import World
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
    "Sight",
    "World",
    "as_text",
    "check_agent",
    "check_boxes",
    "check_environment",
    "check_evaluator",
    "check_executor",
    "check_laser",
    "check_map",
    "check_plugin",
    "check_recorder",
    "check_robot",
    "check_robot_driver",
    "check_senses",
    "check_simulator",
    "check_task",
    "conform",
]

_MODULES = {
    "Example": "conformance.evaluator",
    "Nonconformity": "conformance.properties",
    "Sight": "comparability.senses",
    "World": "comparability.world",
    "as_text": "conformance.properties",
    "check_agent": "conformance.agent",
    "check_boxes": "comparability.across",
    "check_environment": "conformance.declarations",
    "check_evaluator": "conformance.evaluator",
    "check_executor": "conformance.executor",
    "check_laser": "comparability.across",
    "check_map": "comparability.across",
    "check_plugin": "conformance.plugin",
    "check_recorder": "conformance.recorder",
    "check_robot": "conformance.declarations",
    "check_robot_driver": "conformance.platforms",
    "check_senses": "comparability.checks",
    "check_simulator": "conformance.platforms",
    "check_task": "conformance.declarations",
    "conform": "conformance.properties",
}


def __getattr__(name: str) -> Any:
    # pytest imports this module in everybody's test runs, to find the fixture: it must cost next to nothing.
    if name not in _MODULES:
        raise AttributeError(f"module 'benchbot.testing' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"benchbot.plugins.authoring.{_MODULES[name]}"), name)
