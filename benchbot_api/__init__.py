"""The import name of BenchBot v2's API: an alias of `benchbot.api`."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from benchbot.api import ActionResult, Agent, BenchBot

if TYPE_CHECKING:
    RESULT_LOCATION: str

__all__ = ["RESULT_LOCATION", "ActionResult", "Agent", "BenchBot", "agent", "api_callbacks", "benchbot", "tools"]

_MODULES = ("agent", "api_callbacks", "benchbot", "tools")


def __getattr__(name: str) -> Any:
    # As in v2, `import benchbot_api` is enough to use its modules; they are read when they are used.
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name == "RESULT_LOCATION":
        from benchbot import api

        return api.RESULT_LOCATION
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
