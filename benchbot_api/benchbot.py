"""The import name of BenchBot v2: an alias of `benchbot.api.benchbot`."""

from benchbot.api import RESULT_LOCATION, BenchBot

__all__ = ["RESULT_LOCATION", "BenchBot"]
