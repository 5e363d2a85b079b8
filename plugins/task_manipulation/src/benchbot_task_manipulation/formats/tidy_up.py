"""The format `tidy_up`: an empty mapping."""

from typing import Any

from benchbot.plugin import BenchbotError


def create() -> dict[str, Any]:
    """Return the results of a run whose solution is done."""
    return {}


def validate(results: Any) -> None:
    """Raise BenchbotError unless the results are an empty mapping: what a solution claims would not count."""
    if results != {}:
        raise BenchbotError(
            "This is not a valid result of tidy_up.",
            f"results: must be an empty mapping, not {str(results)[:60]}",
            "Hand in the results as BenchBot.empty_results() gives them.",
        )
