"""The import name of BenchBot v2's API: an alias of `benchbot.api`."""

from benchbot.api import RESULT_LOCATION, ActionResult, Agent, BenchBot

__all__ = ["RESULT_LOCATION", "ActionResult", "Agent", "BenchBot"]
