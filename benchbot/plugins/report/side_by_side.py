"""Several sets of results side by side, as one page: who is ahead where, by how much, and on which objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import benchbot
from benchbot.evaluation.frames import Frame
from benchbot.plugins.drawing.map_model import MapObject
from benchbot.plugins.drawing.palette import Color, between, to_hex
from benchbot.plugins.report import diagnosis, summary
from benchbot.plugins.report.bars import Axis
from benchbot.plugins.report.camera_pictures import Budget, Shot, crop, frames_of, thumbnail
from benchbot.plugins.report.cards import outlines_of, shots_of, verdict_of
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode, natural
from benchbot.plugins.report.object_changes import changes
from benchbot.plugins.report.page import Drawing, draw, scene_map, styled, templates

Document = Mapping[str, Any]

MOST_ROWS, MOST_SHOWN, MOST_OBJECTS = 120, 12, 8
"""Environments of the tables and plots; of the pictures, an episode each; objects of each, won and lost."""
_EVEN_LUMINANCE = 0.179
"""Of a background on which black and white can be read as well."""
_COLD, _MIDDLE, _WARM = (178, 84, 60), (247, 247, 244), (54, 110, 165)


@dataclass(frozen=True)
class Difference:
    """The paired differences of one environment: of each pair, and their mean."""

    environment: str
    values: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Their mean."""
        return sum(self.values) / len(self.values)


@dataclass(frozen=True)
class Forest:
    """A forest plot of one comparison: its differences by environment, on an axis with zero in the middle."""

    comparison: Document
    differences: list[Difference]
    axis: Axis


@dataclass(frozen=True)
class Swing:
    """An object that one set found better than another: both outcomes, and a picture of each, where there is one."""

    name: str
    objects: tuple[MapObject, MapObject]
    gain: float
    pictures: tuple[str | None, str | None]

    @property
    def verdicts(self) -> tuple[str, str]:
        """What became of it in both."""
        first, second = map(verdict_of, self.objects)
        return first, second


@dataclass(frozen=True)
class Meeting:
    """One episode of two sets: the maps of its last scene, the same observation of both, objects won and lost."""

    label: str
    scores: tuple[float | None, float | None]
    drawings: tuple[Drawing | None, Drawing | None]
    observation: int | None
    frames: tuple[str | None, str | None]
    won: list[Swing]
    lost: list[Swing]
    counts: tuple[int, int]


def html(sets: Sequence[ReportData], document: Document) -> str:
    """Return the page of named sets and their comparison (schema `comparison`), the same bytes for the same data."""
    by_name = {data.name or "": data for data in sets}
    lower = bool(document["lower_is_better"])
    ranked = sorted(document["sets"], key=lambda item: item["score"], reverse=not lower)
    first, *others = [item["name"] for item in document["sets"]]
    met = {(first, other): meetings(by_name[first], by_name[other], document["score"]) for other in others}
    return (
        templates()
        .get_template("side_by_side.html")
        .render(
            cells=_cells([by_name[item["name"]] for item in document["sets"]], document["score"], lower=lower),
            diagnosis=diagnosis,
            document=document,
            forests=[_forest(comparison) for comparison in document["comparisons"]],
            headline=document["score"],
            kinds=_kinds(sets),
            meetings=met,
            most_rows=MOST_ROWS,
            ranked=ranked,
            summary=summary,
            title=", ".join(by_name),
            version=benchbot.__version__,
            whole=Axis.of([item["score"] for item in ranked], sets[0].evaluator.score(document["score"])),
            **styled(),
        )
    )


def _forest(comparison: Document) -> Forest:
    values: dict[str, list[float]] = {}
    for row in comparison["rows"]:
        values.setdefault(row["pair"].partition(",")[0], []).append(row["difference"])
    rows = [Difference(name, tuple(found)) for name, found in sorted(values.items(), key=lambda one: natural(one[0]))]
    ends = [abs(value) for found in values.values() for value in found]
    interval = comparison["interval"] or {}
    widest = max([*ends, *(abs(interval[end]) for end in interval if end in ("low", "high")), 1e-3])
    reach = next(step for step in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, widest) if step >= widest)
    # Beyond so many environments the largest differences say most.
    kept = sorted(sorted(rows, key=lambda row: -abs(row.mean))[:MOST_ROWS], key=lambda row: natural(row.environment))
    return Forest(comparison, kept, Axis(-reach, reach))


def _cells(
    sets: Sequence[ReportData], score: str, *, lower: bool
) -> list[tuple[str, list[tuple[float | None, str, str]]]]:
    """Return for each environment the score of each set, its colour, and the class of its text: a heat map."""
    names = sorted({name for data in sets for name in data.environments}, key=natural)
    rows = [(name, [data.combined(data.environments.get(name, ())).get(score) for data in sets]) for name in names]
    known = [value for _, values in rows for value in values if value is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    found = []
    for name, values in rows[:MOST_ROWS]:
        cells: list[tuple[float | None, str, str]] = []
        for value in values:
            if value is None:
                cells.append((None, "none", ""))
                continue
            share = 0.5 if high == low else (value - low) / (high - low)
            share = 1.0 - share if lower else share
            color = between(_MIDDLE, _WARM if share >= 0.5 else _COLD, abs(share - 0.5) * 2)
            cells.append((value, to_hex(color), "on-dark" if _luminance(color) < _EVEN_LUMINANCE else "on-light"))
        found.append((name, cells))
    return found


def _luminance(color: Color) -> float:
    """Return the relative luminance of WCAG 2, in [0, 1]."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (value / 255 for value in color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _kinds(sets: Sequence[ReportData]) -> list[tuple[str, list[diagnosis.ErrorTally | None]]]:
    """Return for each kind of error its tally in each set, the costliest of the first set first."""
    tallies = []
    for data in sets:
        coverage = data.scores["coverage"]
        counted = coverage["expected"] if data.missing_count_as_zero else coverage["scored"]
        tallied = diagnosis.errors([episode.diagnosis for episode in data.episodes], counted)
        tallies.append({error.kind: error for error in tallied})
    kinds = dict.fromkeys(kind for tally in tallies for kind in tally)
    return [(kind, [tally.get(kind) for tally in tallies]) for kind in kinds]


def meetings(a: ReportData, b: ReportData, score: str) -> list[Meeting]:
    """Return the episodes of two sets in which their scores differ most, one of each environment."""
    others = {_key(episode): episode for episode in b.episodes if episode.scores is not None}
    found: dict[str, tuple[float, ReportedEpisode, ReportedEpisode]] = {}
    for episode in a.episodes:
        other = others.get(_key(episode))
        if episode.scores is None or other is None or other.scores is None:
            continue
        apart = abs(episode.scores.get(score, 0.0) - other.scores.get(score, 0.0))
        if apart > found.get(episode.environment, (-1.0,))[0]:
            found[episode.environment] = (apart, episode, other)
    chosen = sorted(found.values(), key=lambda one: -one[0])[:MOST_SHOWN]
    budget = Budget()
    return [_meeting((one, other), (a, b), score, budget) for _, one, other in chosen]


def _key(episode: ReportedEpisode) -> tuple[object, ...]:
    return (episode.environment, episode.number, episode.seed, episode.repeat, episode.settings)


def _meeting(
    episodes: tuple[ReportedEpisode, ReportedEpisode], sets: tuple[ReportData, ReportData], score: str, budget: Budget
) -> Meeting:
    frames = [frames_of(episode, data) for episode, data in zip(episodes, sets, strict=True)]
    shots = [shots_of(*one) for one in zip(episodes, sets, frames, strict=True)]
    last = min(len(episode.scenes) for episode in episodes) - 1
    maps = [scene_map(episode, data, last) for episode, data in zip(episodes, sets, strict=True)]
    points = [point for one in maps for point in one.without_far().points]
    drawings = [draw(one, [], budget, points) if points else None for one in maps]
    shared = sorted({frame.number for frame in frames[0]} & {frame.number for frame in frames[1]})
    middle = shared[len(shared) // 2] if shared else None
    seen = [next((frame for frame in each if frame.number == middle), None) for each in frames]
    won, lost = _swings(episodes)
    return Meeting(
        episodes[0].label,
        (_score(episodes[0], score), _score(episodes[1], score)),
        (drawings[0], drawings[1]),
        middle,
        (_thumbnail(seen[0], budget), _thumbnail(seen[1], budget)),
        [_pictured(one, shots, budget) for one in won[:MOST_OBJECTS]],
        [_pictured(one, shots, budget) for one in lost[:MOST_OBJECTS]],
        (len(won), len(lost)),
    )


def _score(episode: ReportedEpisode, score: str) -> float | None:
    return (episode.scores or {}).get(score)


def _thumbnail(frame: Frame | None, budget: Budget) -> str | None:
    return None if frame is None else thumbnail(frame, budget)


def _swings(episodes: tuple[ReportedEpisode, ReportedEpisode]) -> tuple[list[Swing], list[Swing]]:
    """Return the true objects that only one of two episodes found, the largest difference in quality first."""
    mine, theirs = ({_place(item): item for item in episode.objects if item.true} for episode in episodes)
    found = changes(*({place: item.verdict for place, item in each.items()} for each in (mine, theirs)))
    won, lost = (
        sorted(
            (_swing(mine[place], theirs[place]) for place in places),
            key=lambda one: (-abs(one.gain), one.name, _place(one.objects[0])),
        )
        for places in (found.won, found.lost)
    )
    return won, lost


def _swing(a: MapObject, b: MapObject) -> Swing:
    return Swing(a.name, (a, b), (a.quality or 0.0) - (b.quality or 0.0), (None, None))


def _place(item: MapObject) -> tuple[object, ...]:
    return (item.scene, item.truth_label, item.true.centroid if item.true else None)


def _pictured(swing: Swing, shots: Sequence[Mapping[int, Shot]], budget: Budget) -> Swing:
    """Return an object with what both saw of it, each in the frame that shows it best."""
    pictures = []
    for item, known in zip(swing.objects, shots, strict=True):
        views = (item.evidence or {}).get("views", ())
        shot = known.get(views[0]["observation"]) if views else None
        pictures.append(None if shot is None else crop(shot, outlines_of(item), budget))
    return replace(swing, pictures=(pictures[0], pictures[1]))
