"""What a report is made of: the scores document, and beside each row what its result, truth and frames say."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.core import overrides
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.episodes import digest
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.evaluation import result_files
from benchbot.evaluation.ground_truths import GroundTruths, environment_of
from benchbot.evaluation.result_document import ResultDocument
from benchbot.evaluation.score import Evaluation

Document = dict[str, Any]
Scores = dict[str, float]

OBJECTS = "object_map_ground_truth"
UNKNOWN = "unknown"
"""The environment of a file that could not be read."""


@dataclass(frozen=True)
class Episode:
    """One expected result: scored, or missing (then `scores` is None) with the reason.

    `number` is that of the episode in its task's list, of tasks that have one. `objects` is the evaluator's explanation
    of the score, object by object; empty when the method gives none. `truths` are those that the map shows, one for
    each scene; `goal` is that of an episode list, with a `position` or with `instances` of a class.
    """

    environment: str
    seed: int | None
    repeat: int | None
    number: int | None
    robot: str | None
    source: str | None
    scores: Scores | None
    failure: str | None = None
    reason: str | None = None
    document: Document | None = None
    truths: tuple[Document, ...] = ()
    objects: tuple[Document, ...] = ()
    goal: Document | None = None
    settings: str = ""

    @property
    def place(self) -> str:
        """The environment's name, without its variants."""
        return self.environment.partition(":")[0]

    @property
    def variant(self) -> str:
        """The environment's variants, such as `1` or `1 → 2`; of BEAR's rooms these are times of day."""
        return self.environment.partition(":")[2].replace(":", " → ")

    @property
    def label(self) -> str:
        """The environment and, if they are known, which episode it is, its seed and repeat, and its settings."""
        known = [("episode", self.number), ("seed", self.seed), ("repeat", self.repeat)]
        said = [f"{word} {value}" for word, value in known if value is not None]
        return ", ".join(filter(None, [self.environment, *said, self.settings]))

    @property
    def provenance(self) -> Document:
        """Where the result came from; empty for one that does not say."""
        return ((self.document or {}).get("provenance")) or {}

    @property
    def scenes(self) -> list[Document]:
        """The environment's variants as the result describes them, in the order of the visits."""
        return list((self.document or {}).get("environment_details", ()))


@dataclass(frozen=True)
class Material:
    """All that a report needs.

    `robot` and `scene` give the declaration of a robot and of an environment (`name:variant`), None when it is not
    installed.
    """

    name: str | None
    scores: Document
    episodes: tuple[Episode, ...]
    evaluator: Evaluator
    robot: Callable[[str], Document | None]
    scene: Callable[[str], Declaration | None]
    frames: Path | None = None

    @property
    def headline(self) -> str:
        """The name of the score that stands for a result."""
        return str(self.scores["method"]["headline"])

    @property
    def score_names(self) -> list[str]:
        """All scores, the headline first."""
        return [self.headline, *(name for name in self.scores["scores"] if name != self.headline)]

    @property
    def missing_count_as_zero(self) -> bool:
        """Whether what is missing lowers the scores; otherwise it is left out of them."""
        return bool(self.scores["coverage"].get("missing_counts", "zero") == "zero")

    @property
    def environments(self) -> dict[str, list[Episode]]:
        """The episodes by environment, in the order of the alphabet, numbers by their value."""
        return grouped(self.episodes, lambda episode: episode.environment)

    def combined(self, episodes: Iterable[Episode]) -> Scores:
        """Return the summary of some of the episodes, as the method combines them; empty when none counts."""
        counted = [episode.scores or {} for episode in episodes if episode.scores or self.missing_count_as_zero]
        return self.evaluator.combine(counted) if counted else {}


def gather(
    evaluation: Evaluation,
    paths: Sequence[Path],
    *,
    catalog: Catalog,
    name: str | None = None,
    frames: Path | None = None,
) -> Material:
    """Return the material of a report on the results in `paths`, whose evaluation this is.

    `name` is what the solution is called, `frames` the folder of what was recorded beside a single result.
    """
    scores, explain = evaluation.document, evaluation.evaluator.explain
    episodes = []
    for row, (submission, truths) in zip(scores["rows"], evaluation.scored, strict=True):
        objects = () if explain is None else explain(submission.document, truths).get("objects", ())
        episode = _episode(row, submission, row["scores"], submission.failure_why or None)
        episodes.append(replace(episode, truths=tuple(truths), objects=tuple(objects)))
    absent = scores["coverage"]["missing"]
    handed_in = result_files.read(paths) if any(item["source"] for item in absent) else ()
    submissions = {item.source: item for item in handed_in if isinstance(item, ResultDocument)}
    episodes += [_episode(item, submissions.get(item["source"]), None, item["reason"]) for item in absent]

    episodes = [replace(episode, goal=_goal(episode, catalog)) for episode in episodes]
    episodes = _furnished(episodes, catalog)

    def robot(wanted: str) -> Document | None:
        declared = catalog.pool("robots").get(wanted)
        return None if declared is None else dict(declared.data)

    ordered = tuple(sorted(episodes, key=_order))
    return Material(name, scores, ordered, evaluation.evaluator, robot, catalog.pool("environments").get, frames)


def grouped(episodes: Iterable[Episode], key: Callable[[Episode], str]) -> dict[str, list[Episode]]:
    """Return the episodes by what `key` says of them, sorted."""
    found: dict[str, list[Episode]] = {}
    for episode in episodes:
        found.setdefault(key(episode), []).append(episode)
    return dict(sorted(found.items(), key=lambda item: natural(item[0])))


def natural(text: str) -> list[tuple[int, int, str]]:
    """Return a key that sorts names as people do: `house:2` before `house:10`."""
    parts = text.replace(",", ":").replace(" ", ":").split(":")
    return [(0, int(part), "") if part.isdecimal() and len(part) < 19 else (1, 0, part) for part in parts]


def _episode(item: Document, submission: ResultDocument | None, scores: Scores | None, reason: str | None) -> Episode:
    selection = {} if submission is None else submission.selection
    return Episode(
        environment=item["environment"] or UNKNOWN,
        seed=item.get("seed"),
        repeat=item.get("repeat"),
        number=(selection.get("episode") or {}).get("number"),
        robot=selection.get("robot"),
        source=item["source"],
        scores=scores,
        failure=item["failure"],
        reason=reason,
        document=None if submission is None else submission.document,
        settings=overrides.label(item.get("settings") or {}),
    )


def _goal(episode: Episode, catalog: Catalog) -> Document | None:
    """Return the goal of an episode, None when its list is not installed as it was."""
    chosen = (episode.provenance.get("selection") or {}).get("episode") or {}
    listed = catalog.pool("episodes").get(chosen.get("list", ""))
    if listed is None or digest(listed.data) != chosen["sha256"]:
        return None
    goal: Document = listed.data["episodes"][chosen["number"]]["goal"]
    return goal


def _shows_objects(episode: Episode) -> bool:
    return any("objects" in truth["ground_truth"] for truth in episode.truths)


def _furnished(episodes: list[Episode], catalog: Catalog) -> list[Episode]:
    """Return the episodes with what stands in their scenes, where that is known: a way alone makes a poor map."""
    if all(_shows_objects(episode) for episode in episodes):
        return episodes
    try:
        known = GroundTruths.of(catalog, None)
    except BenchbotError:
        return episodes
    return [episode if _shows_objects(episode) else _with_furniture(episode, known) for episode in episodes]


def _with_furniture(episode: Episode, known: GroundTruths) -> Episode:
    try:
        return replace(episode, truths=tuple(known.find(environment_of(scene), {OBJECTS}) for scene in episode.scenes))
    except BenchbotError:
        return episode


def _order(episode: Episode) -> tuple[Any, ...]:
    numbers = (-1 if number is None else number for number in (episode.number, episode.seed, episode.repeat))
    return (natural(episode.environment), *numbers, episode.source or "")
