"""Scores as bars, the episodes that they are made of as dots, on an axis that all share."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchbot.core.records import Score
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode

_UNKNOWN = Score()


@dataclass(frozen=True)
class Axis:
    """The range of values that the width of a chart stands for."""

    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float], score: Score = _UNKNOWN) -> "Axis":
        """Return the axis for some values: all that the score can be, else round numbers around these and zero.

        Values of a score that says nothing of its bounds have 0 to 1 when they lie in that.
        """
        if score.least is not None and score.greatest is not None:
            return cls(score.least, score.greatest)
        known = [0.0, *values]
        low, high = min(known), max(known)
        if low == high or (score.least is None and low >= 0 and high <= 1):
            return cls(0.0, 1.0)
        step = 10.0 ** math.floor(math.log10(max(high - low, 1e-300)))
        return cls(step * math.floor(low / step), step * math.ceil(high / step))

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Five places on the axis in per cent, and what to write there."""
        values = [self.low + (self.high - self.low) * i / 4 for i in range(5)]
        return [(self.percent(value), f"{value:g}") for value in values]

    def percent(self, value: float) -> float:
        """Return where a value lies, in per cent of the width."""
        share = (value - self.low) / (self.high - self.low)
        return round(100 * min(max(share, 0.0), 1.0), 2)


@dataclass(frozen=True)
class Dot:
    """One episode: its place on the axis, a sentence about it, and whether it is missing."""

    percent: float
    title: str
    missing: bool


@dataclass(frozen=True)
class Bar:
    """One group of episodes: its score (None when nothing counts), where the bar ends, and its episodes."""

    label: str
    value: float | None
    start: float
    width: float
    dots: list[Dot]
    count: int
    missing: int


def axis_of(data: ReportData) -> Axis:
    """Return the axis of the headline score."""
    name = data.headline
    values = [episode.scores[name] for episode in data.episodes if episode.scores and name in episode.scores]
    return Axis.of([*values, data.scores["scores"][name]], data.evaluator.score(name))


def bar_of(label: str, episodes: Sequence[ReportedEpisode], data: ReportData, axis: Axis) -> Bar:
    """Return the bar of some episodes: what the method of evaluation makes of them together."""
    value = data.combined(episodes).get(data.headline)
    zero = axis.percent(0.0)
    end = zero if value is None else axis.percent(value)
    return Bar(
        label=label,
        value=value,
        start=min(zero, end),
        width=round(abs(end - zero), 2),
        dots=[dot for episode in episodes if (dot := _dot(episode, data, axis)) is not None],
        count=len(episodes),
        missing=sum(episode.scores is None for episode in episodes),
    )


def _dot(episode: ReportedEpisode, data: ReportData, axis: Axis) -> Dot | None:
    if episode.scores is None:
        counted = data.combined([episode]).get(data.headline)
        if counted is None:
            return None
        said = f"{counted:g}" if counted else "zero"
        return Dot(axis.percent(counted), f"{episode.label}: missing, counted as {said}", missing=True)
    value = episode.scores.get(data.headline)
    return None if value is None else Dot(axis.percent(value), f"{episode.label}: {value:.3f}", missing=False)
