"""What a report says before it shows anything: what was measured, how well it went, and what went wrong."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from benchbot.core.errors import FailureClass
from benchbot.plugins.drawing.episodes import UNKNOWN, Document, Episode, Material, grouped
from benchbot.plugins.report.bars import Axis, Bar, bar_of

NO_CLASS = "none given"
MEANINGS = {
    FailureClass.AGENT: "The solution crashed, or handed in nothing that could be used.",
    FailureClass.COLLISION: "The robot hit something.",
    FailureClass.TIMEOUT: "The solution took longer than it was given.",
    FailureClass.PLATFORM: "The simulator or the robot died, or was stopped for safety: no fault of the solution.",
    FailureClass.INFRASTRUCTURE: "The machine or the software that measures failed: no fault of the solution.",
    NO_CLASS: "The result is missing or cannot be scored.",
}


@dataclass(frozen=True)
class Interval:
    """A confidence interval of a score and its level, such as 0.95."""

    low: float
    high: float
    level: float

    @property
    def name(self) -> str:
        """The level in words: `95 % interval`."""
        return f"{self.level * 100:g} % interval"


@dataclass(frozen=True)
class Variable:
    """Something that differs between episodes, and the score at each of its values."""

    name: str
    bars: list[Bar]


@dataclass(frozen=True)
class Failures:
    """The episodes that failed in one way."""

    name: str
    meaning: str
    episodes: list[Episode]


def title(material: Material) -> str:
    """Return what the report is about: the name that was given, else that of the solution's file."""
    if material.name is not None:
        return material.name
    names = set()
    for episode in material.episodes:
        solution = episode.provenance.get("solution") or {}
        files = list(solution.get("files") or {}) or [word for word in solution.get("command", ())[1:] if "." in word]
        names |= {PurePosixPath(str(file)).stem for file in files[:1]}
    return names.pop() if len(names) == 1 else "A solution"


def task(material: Material) -> Document:
    """Return the task that was measured."""
    return dict(material.scores["task_details"])


def environments_in_words(material: Material) -> str:
    """Return how many environments there are and, when they are few, which."""
    names = [name for name in material.environments if name != UNKNOWN]
    number = f"{len(names)} environment{'' if len(names) == 1 else 's'}"
    return f"{number} ({', '.join(names)})" if 0 < len(names) <= 5 else number


def robots(material: Material) -> list[tuple[str, str]]:
    """Return the robots and what their declarations say of them, which may be nothing."""
    names = sorted({episode.robot for episode in material.episodes if episode.robot is not None})
    return [(name, str((material.robot(name) or {}).get("description", ""))) for name in names]


def interval(material: Material, name: str) -> Interval | None:
    """Return the interval of a combined score, None when it is not known."""
    found = (material.scores.get("intervals") or {}).get(name)
    return None if found is None else Interval(found["low"], found["high"], found["level"])


def reading(material: Material, name: str) -> str:
    """Return how a score is read, in a sentence; nothing when that is not known."""
    score = material.evaluator.score(name)
    if score.lower_is_better is None:
        return ""
    best = score.least if score.lower_is_better else score.greatest
    said = "Less is better" if score.lower_is_better else "More is better"
    return f"{said}." if best is None else f"{said}; {best:g} is the best there can be."


def arrow(material: Material, name: str) -> str:
    """Return the arrow that papers put beside a score: up when more is better, down when less is."""
    return {None: "", False: "↑", True: "↓"}[material.evaluator.score(name).lower_is_better]


def arrows_in_words(material: Material) -> str:
    """Return what the arrows mean that there are beside scores."""
    meanings = {"↑": "↑ more is better", "↓": "↓ less is better"}
    used = {arrow(material, name) for name in material.score_names}
    said = ", ".join(meaning for sign, meaning in meanings.items() if sign in used)
    return f"; {said}" if said else ""


def missing_in_words(material: Material) -> str:
    """Return how what is missing counts, in the scores that there are."""
    if not material.missing_count_as_zero:
        return "left out of the scores"
    # A method gives what is missing no error: zero would be perfect.
    without = [name for name in material.score_names if name not in material.evaluator.combine([{}])]
    return f"counted as zero in every score{' but ' if without else ''}{', '.join(without)}"


def variables(material: Material, axis: Axis) -> list[Variable]:
    """Return what differs between the episodes, of place, variant, robot and seed."""
    keys: dict[str, Callable[[Episode], str]] = {
        "place": lambda episode: episode.place,
        "variant": lambda episode: episode.variant or UNKNOWN,
        "robot": lambda episode: episode.robot or UNKNOWN,
        "seed": lambda episode: UNKNOWN if episode.seed is None else str(episode.seed),
    }
    found = []
    for name, key in keys.items():
        groups = grouped([episode for episode in material.episodes if episode.environment != UNKNOWN], key)
        says_more = name != "place" or len(groups) < len(material.environments)
        if says_more and len([level for level in groups if level != UNKNOWN]) > 1:
            bars = [bar_of(level, episodes, material, axis) for level, episodes in groups.items()]
            found.append(Variable(name, bars))
    return found


def failures(material: Material) -> list[Failures]:
    """Return the failed and missing episodes by class, those of the solution first."""
    found = []
    for name, meaning in MEANINGS.items():
        failed = [episode for episode in material.episodes if _class_of(episode) == name]
        if failed:
            found.append(Failures(str(name), meaning, failed))
    return found


def shown_first(episodes: Sequence[Episode], name: str) -> list[Episode]:
    """Return the episodes of an environment that can be looked at, the one whose score is in the middle first.

    Those that were not scored come last, and only if it is known where the robot went.
    """
    scored = [episode for episode in episodes if episode.scores is not None]
    failed = [episode for episode in episodes if episode.scores is None and (episode.document or {}).get("track")]
    ranked = sorted(scored, key=lambda episode: (episode.scores or {}).get(name, 0.0))
    middle = ranked[(len(ranked) - 1) // 2 :][:1]
    return [*middle, *(episode for episode in scored if episode not in middle), *failed]


def _class_of(episode: Episode) -> str | None:
    if episode.failure is not None:
        return episode.failure
    return NO_CLASS if episode.scores is None else None
