"""The import name of BenchBot v2's API: `benchbot.api`, with what scripts of v2 used besides."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from benchbot.api import ActionResult, Agent

if TYPE_CHECKING:
    from benchbot_api.benchbot import BenchBot

    RESULT_LOCATION: str

__all__ = ["RESULT_LOCATION", "ActionResult", "Agent", "BenchBot", "agent", "api_callbacks", "benchbot", "tools"]

_MODULES = ("agent", "api_callbacks", "benchbot", "tools")


def __getattr__(name: str) -> Any:
    # As in v2, `import benchbot_api` is enough to use its modules; they are read when they are used.
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name in ("BenchBot", "RESULT_LOCATION"):
        return getattr(import_module(f"{__name__}.benchbot"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
