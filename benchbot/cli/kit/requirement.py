"""Thresholds on scores: `--require "OMQ>=0.4"`."""

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from benchbot.core.errors import BenchbotError, ExitCode, did_you_mean

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    ">": operator.gt,
    "<=": operator.le,
    "<": operator.lt,
}
_PATTERN = re.compile(r"\s*([A-Za-z_]\w*)\s*(>=|<=|>|<)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*")


@dataclass(frozen=True)
class Requirement:
    """A score that must be reached."""

    score: str
    sign: str
    threshold: float

    def __str__(self) -> str:
        return f"{self.score} {self.sign} {self.threshold:g}"

    def met(self, value: float) -> bool:
        """Say whether a value of the score is good enough."""
        return _OPERATORS[self.sign](value, self.threshold)


def parse(texts: Iterable[str] | None) -> list[Requirement]:
    """Return the requirements that `texts` state, such as `OMQ>=0.4`; raises BenchbotError for another form."""
    found = []
    for text in texts or ():
        match = _PATTERN.fullmatch(text)
        if match is None:
            raise BenchbotError(
                f"'{text}' is not a requirement.",
                "A requirement is a score's name, one of >= > <= <, and a number.",
                "Write it like this, in quotes: --require 'OMQ>=0.4'",
            )
        found.append(Requirement(match[1], match[2], float(match[3])))
    return found


def check(requirements: Iterable[Requirement], scores: Mapping[str, float]) -> None:
    """Raise BenchbotError (exit code 4) naming every requirement that `scores` do not meet."""
    missed = []
    for requirement in requirements:
        if requirement.score not in scores:
            raise BenchbotError(
                f"There is no score '{requirement.score}'.",
                f"The scores: {', '.join(scores)}.{did_you_mean(requirement.score, list(scores))}",
                "Name one of these with --require.",
            )
        if not requirement.met(scores[requirement.score]):
            missed.append(f"{requirement} is required; the score is {scores[requirement.score]:.6g}.")
    if missed:
        raise BenchbotError(
            "The scores are not what was required.",
            "\n".join(missed),
            "Improve the solution, or ask for less with --require.",
            exit_code=ExitCode.BELOW_THRESHOLD,
        )
