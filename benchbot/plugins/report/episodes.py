"""The data of a report: the scores document, and beside each row what its result, truth and frames say."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from benchbot.core import overrides
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.documents import GroundTruth
from benchbot.core.episodes import digest
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.evaluation import result_files
from benchbot.evaluation.ground_truths import GroundTruths, environment_of
from benchbot.evaluation.result_document import ResultDocument
from benchbot.evaluation.score import Evaluation, explain
from benchbot.plugins.drawing.map_model import (
    FALSE_NEGATIVE,
    FALSE_POSITIVE,
    IGNORED,
    MATCH,
    Box,
    MapObject,
    MapPath,
    Point,
    driven_paths,
    estimated_objects,
    true_objects,
)
from benchbot.plugins.drawing.scene_maps import OBJECTS

Document = dict[str, Any]
Scores = dict[str, float]

UNKNOWN = "unknown"
"""The environment of a file that could not be read."""


@dataclass(frozen=True)
class ReportedEpisode:
    """One expected result: scored, or missing (then `scores` is None) with the reason.

    `number` is that of the episode in its task's list, of tasks that have one. `explanation` is the evaluator's, object
    by object; empty when the method gives none; `diagnosis` is what went wrong in general, `recorded` what the evidence
    of objects rests on (schema `explanation`). `truths` are those that the map shows, one for each scene; `goal` is
    that of an episode list, with a `position` or with `instances` of a class.
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
    document: Mapping[str, Any] | None = None
    truths: tuple[GroundTruth, ...] = ()
    explanation: tuple[Document, ...] = ()
    diagnosis: Document = field(default_factory=dict)
    recorded: Document = field(default_factory=dict)
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
    def provenance(self) -> Mapping[str, Any]:
        """The provenance of the result; empty for one without it."""
        return ((self.document or {}).get("provenance")) or {}

    @property
    def command(self) -> str:
        """The command that ran as the solution."""
        return " ".join(map(str, self._solution.get("command", ())))

    @property
    def revision(self) -> str:
        """The solution's git revision, and whether there were changes beside it."""
        found = self._solution.get("git_revision")
        return "" if found is None else f"{found}{' with changes' if self._solution.get('git_dirty') else ''}"

    @property
    def _solution(self) -> Document:
        return self.provenance.get("solution") or {}

    @property
    def scenes(self) -> list[Document]:
        """The environment's variants as the result describes them, in the order of the visits."""
        return list((self.document or {}).get("environment_details", ()))

    @property
    def paths(self) -> list[MapPath]:
        """The robot's path through each scene."""
        return driven_paths(self.document)

    @property
    def goals(self) -> tuple[Point, ...]:
        """The places in the map frame that the robot was to reach: one, or an instance of the wanted class each."""
        goal = self.goal or {}
        if "place" in goal:
            goal = {"instances": [goal["place"]]}
        places = [goal["position"]] if "position" in goal else [each["centroid"] for each in goal.get("instances", ())]
        return tuple((float(x), float(y)) for x, y, *_ in places)

    @property
    def objects(self) -> list[MapObject]:
        """The objects as the evaluator explains them, else as truth and result state them.

        Failures come first, then the worst matches.
        """
        if self.explanation:
            names = [f"{scene.get('name')}:{scene.get('variant')}" for scene in self.scenes]
            found = _explained(self.explanation, names)
        else:
            found = [
                replace(item, scene=scene)
                for scene, truth in enumerate(self.truths)
                for item in true_objects(truth.get("ground_truth"))
            ]
            last = len(self.scenes) - 1
            found += [replace(item, scene=last) for item in estimated_objects((self.document or {}).get("results"))]
        return sorted(found, key=_worst_first)


def _explained(items: Sequence[Document], scenes: Sequence[str]) -> list[MapObject]:
    found = [_object(item, scenes) for item in items]
    of_truth = {(item["scene"], item["truth"]): made for item, made in zip(items, found, strict=True)}
    of_estimate = {item["proposal"]: made for item, made in zip(items, found, strict=True)}
    mistaken = []
    for item, made in zip(items, found, strict=True):
        counterpart = item.get("counterpart")
        of_true = item["truth"] is not None
        other = of_estimate.get(counterpart) if of_true else of_truth.get((item["scene"], counterpart))
        mistaken.append(made if counterpart is None else replace(made, mistaken=other))
    return mistaken


def _object(item: Document, scenes: Sequence[str]) -> MapObject:
    is_estimated, is_true = item["verdict"] != FALSE_NEGATIVE, item["verdict"] != FALSE_POSITIVE
    return MapObject(
        label=item["label"] or "",
        truth_label=item["truth_label"] if is_true else None,
        estimated=Box.of(item["centroid"], item["extent"]) if is_estimated else None,
        true=Box.of(item["truth_centroid"], item["truth_extent"]) if is_true else None,
        scene=scenes.index(item["scene"]) if item["scene"] in scenes else 0,
        verdict=item["verdict"],
        quality=item["factors"].get("overall") if item["verdict"] == MATCH else None,
        why=item["why"],
        error=item.get("error"),
        probability=item.get("probability"),
        evidence=item.get("evidence"),
    )


def _worst_first(item: MapObject) -> tuple[object, ...]:
    rank = (FALSE_NEGATIVE, FALSE_POSITIVE, MATCH, IGNORED, None).index(item.verdict)
    volume = math.prod(item.boxes[0].extent) if item.boxes else 0.0
    return (item.scene, rank, item.quality or 0.0, -volume, item.name)


@dataclass(frozen=True)
class ReportData:
    """The data of a report; the catalog has the declarations of robots and environments that are installed."""

    name: str | None
    scores: Document
    episodes: tuple[ReportedEpisode, ...]
    evaluator: Evaluator
    catalog: Catalog
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
        """True where what is missing lowers the scores; otherwise it is left out of them."""
        return bool(self.scores["coverage"].get("missing_counts", "zero") == "zero")

    @property
    def environments(self) -> dict[str, list[ReportedEpisode]]:
        """The episodes by environment, in the order of the alphabet, numbers by their value."""
        return grouped(self.episodes, lambda episode: episode.environment)

    def combined(self, episodes: Iterable[ReportedEpisode]) -> Scores:
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
    with_evidence: bool = True,
) -> ReportData:
    """Return the data of a report on the results in `paths`, whose evaluation this is.

    `name` is what the solution is called, `frames` the folder of what was recorded beside a single result. Evidence is
    worked out from every frame; without it, nothing is looked for in recordings.
    """
    scores = evaluation.document
    silent: list[Document] = [{} for _ in scores["rows"]]
    told = (
        silent
        if evaluation.evaluator.explain is None
        else explain(evaluation, catalog if with_evidence else None, frames)["results"]
    )
    episodes = []
    for row, entry, (submission, truths) in zip(scores["rows"], told, evaluation.scored, strict=True):
        objects, about = entry.get("objects", ()), {key: entry.get(key, {}) for key in ("diagnosis", "evidence")}
        episode = _episode(row, submission, row["scores"], submission.failure_why or None)
        episode = replace(episode, diagnosis=about["diagnosis"], recorded=about["evidence"])
        episodes.append(replace(episode, truths=tuple(truths), explanation=tuple(objects)))
    absent = scores["coverage"]["missing"]
    handed_in = result_files.read(paths) if any(item["source"] for item in absent) else ()
    submissions = {item.source: item for item in handed_in if isinstance(item, ResultDocument)}
    episodes += [_episode(item, submissions.get(item["source"]), None, item["reason"]) for item in absent]

    ground_truths = cache(lambda: GroundTruths.of(catalog, None))
    episodes = [_with_objects(replace(episode, goal=_goal(episode, catalog)), ground_truths) for episode in episodes]
    return ReportData(name, scores, tuple(sorted(episodes, key=_order)), evaluation.evaluator, catalog, frames)


def grouped(
    episodes: Iterable[ReportedEpisode], key: Callable[[ReportedEpisode], str]
) -> dict[str, list[ReportedEpisode]]:
    """Return the episodes by what `key` says of them, sorted."""
    found: dict[str, list[ReportedEpisode]] = {}
    for episode in episodes:
        found.setdefault(key(episode), []).append(episode)
    return dict(sorted(found.items(), key=lambda item: natural(item[0])))


def natural(text: str) -> list[tuple[int, int, str]]:
    """Return a key that sorts names as people do: `house:2` before `house:10`."""
    parts = text.replace(",", ":").replace(" ", ":").split(":")
    return [(0, int(part), "") if part.isdecimal() and len(part) < 19 else (1, 0, part) for part in parts]


def _episode(
    item: Document, submission: ResultDocument | None, scores: Scores | None, reason: str | None
) -> ReportedEpisode:
    selection = {} if submission is None else submission.selection
    return ReportedEpisode(
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


def _goal(episode: ReportedEpisode, catalog: Catalog) -> Document | None:
    """Return the goal of an episode, None when its list is not installed as it was."""
    chosen = (episode.provenance.get("selection") or {}).get("episode") or {}
    listed = catalog.pool("episodes").get(chosen.get("list", ""))
    if listed is None or digest(listed.data) != chosen["sha256"]:
        return None
    goal: Document = listed.data["episodes"][chosen["number"]]["goal"]
    return goal


def _with_objects(episode: ReportedEpisode, ground_truths: Callable[[], GroundTruths]) -> ReportedEpisode:
    """Return an episode with the objects of its scenes, where they are known: a path alone makes a poor map."""
    if any("objects" in truth["ground_truth"] for truth in episode.truths):
        return episode
    try:
        known = ground_truths()
        return replace(episode, truths=tuple(known.find(environment_of(scene), {OBJECTS}) for scene in episode.scenes))
    except BenchbotError:
        return episode


def _order(episode: ReportedEpisode) -> tuple[Any, ...]:
    numbers = (-1 if number is None else number for number in (episode.number, episode.seed, episode.repeat))
    return (natural(episode.environment), *numbers, episode.source or "")
