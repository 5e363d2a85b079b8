"""What a person has chosen, as the words of the command that does it."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError


@dataclass(frozen=True)
class RunOrder:
    """A task on a robot in an environment, and its limits; None is what the task says itself."""

    task: str
    robot: str
    environment: str
    seed: int = 0
    episode: int | None = None
    max_steps: int | None = None
    max_simulated_time_s: float | None = None
    max_wall_time_s: float | None = None

    def words(self) -> list[str]:
        """Return the options of `benchbot run` and `benchbot submit`."""
        options = {
            "--task": self.task,
            "--robot": self.robot,
            "--env": self.environment,
            "--seed": self.seed,
            "--episode": self.episode,
            "--max-steps": self.max_steps,
            "--max-simulated-time": self.max_simulated_time_s,
            "--max-wall-time": self.max_wall_time_s,
        }
        return [f"{name}={value}" for name, value in options.items() if value is not None]


@dataclass(frozen=True)
class SolutionOrder:
    """A solution, where its result goes, and how it is scored (not at all for None)."""

    result: Path
    example: str | None = None
    command: str | None = None
    sandboxed: bool = False
    arguments: str = ""
    method: str | None = None

    def words(self) -> list[str]:
        """Return the options of `benchbot submit`; raises BenchbotError when there is nothing to submit."""
        if self.example is None and not (self.command or "").strip():
            raise BenchbotError(
                "There is nothing to submit.",
                "No example is chosen, and no command is written.",
                "Choose an example, or write the command that starts your solution.",
            )
        chosen = f"--native={self.command}" if self.example is None else f"--example={self.example}"
        return [
            chosen,
            *(["--sandboxed"] if self.sandboxed else []),
            *([f"--args={self.arguments}"] if self.arguments.strip() else []),
            f"--results-location={self.result}",
            *([f"--evaluate-with={self.method}"] if self.method is not None else []),
            "--json",
        ]


def run_words(order: RunOrder) -> list[str]:
    """Return the command that starts a robot and waits for solutions, at any free port."""
    return ["run", *order.words(), "--port=0"]


def submit_words(solution: SolutionOrder, order: RunOrder | None = None) -> list[str]:
    """Return the command that submits a solution, with a back end of its own when there is an order for one."""
    return ["submit", *solution.words(), *(order.words() if order else [])]


def new_result(environment: str) -> Path:
    """Return where a result goes that nobody has given a place: a new folder in `results` of the working folder."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path.cwd() / "results" / f"{environment.replace(':', '_')}-{stamp}" / "result.json"


def number(fields: Mapping[str, str], name: str, *, least: int = 0) -> int | None:
    """Return the whole number in a field, None for an empty one; raises BenchbotError for anything else."""
    text = fields[name].strip()
    if not text:
        return None
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise _no_number(name, text, f"a whole number, {least} or more")
    return value


def seconds(fields: Mapping[str, str], name: str) -> float | None:
    """Return the positive number in a field, None for an empty one; raises BenchbotError for anything else."""
    text = fields[name].strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise _no_number(name, text, "a number of seconds")
    return value


def _no_number(name: str, text: str, wanted: str) -> BenchbotError:
    return BenchbotError(f"{name} is not {wanted}.", f"It is {text!r}.", "Mend it, or leave it empty.")
