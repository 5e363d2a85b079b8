"""The import name of BenchBot v2: an alias of `benchbot.api.agent`."""

from benchbot.api.agent import ActionResult, Agent

__all__ = ["ActionResult", "Agent"]
