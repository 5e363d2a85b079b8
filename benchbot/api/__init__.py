"""The API of solutions: `Agent`, `ActionResult`, `Observations`, `BenchBot`. Importing it imports no server."""

from typing import TYPE_CHECKING

from benchbot.api.agent import ActionResult, Agent, Observations
from benchbot.api.benchbot import BenchBot, result_location
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    RESULT_LOCATION: str

__all__ = ["RESULT_LOCATION", "ActionResult", "Agent", "BenchBot", "BenchbotError", "Observations"]


def __getattr__(name: str) -> str:
    # Looked up when it is asked for: BENCHBOT_RESULT may be set after the import.
    if name == "RESULT_LOCATION":
        return result_location()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
