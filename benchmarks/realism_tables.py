"""What a detector finds in pictures, and their features and statistics, by class, size, light and environment."""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchbot.mapping import CLASS_LIST
from benchmarks.boxes import Detection, Truth, area, match
from benchmarks.picture_statistics import FeatureFigures, PictureStatistics
from benchmarks.views import TIMES

OVERLAPS = (0.5, 0.3)
LARGE_PIXELS = 4000

Of = Callable[[str, float], bool]
"""Whether objects of a class and so many pixels belong to a line of the table."""


@dataclass(frozen=True)
class Row:
    """A picture: its objects, what the detector finds in it, and its features and statistics."""

    environment: str
    time: str
    view: int
    truths: tuple[Truth, ...]
    detections: tuple[Detection, ...]
    features: Mapping[str, FeatureFigures]
    statistics: PictureStatistics


@dataclass(frozen=True)
class Count:
    """Objects that are to be found, those found, and detections of nothing."""

    objects: int = 0
    found: int = 0
    wrong: int = 0

    def __add__(self, other: "Count") -> "Count":
        return Count(self.objects + other.objects, self.found + other.found, self.wrong + other.wrong)

    @property
    def recall(self) -> float:
        """Share of the objects that are found."""
        return self.found / self.objects if self.objects else float("nan")

    @property
    def precision(self) -> float:
        """Share of the detections that are right."""
        return self.found / (self.found + self.wrong) if self.found + self.wrong else float("nan")


def everything(class_name: str, pixels: float) -> bool:
    """True of every object."""
    return True


def no_table(class_name: str, pixels: float) -> bool:
    """True of every class but tables: COCO's are those at which one dines."""
    return class_name != "table"


def count(row: Row, least_iou: float, of: Of = everything) -> Count:
    """Count a picture's objects and detections of which `of` holds; a wrong one has the pixels of its box."""
    matches = match(row.truths, row.detections, least_iou)
    counted = [
        place for place, truth in enumerate(row.truths) if truth.is_counted and of(truth.class_name, truth.pixels)
    ]
    wrong = (row.detections[place] for place in matches.wrong)
    return Count(
        len(counted),
        sum(place in matches.found for place in counted),
        sum(of(each.class_name, area(each.box)) for each in wrong),
    )


def counts(rows: Sequence[Row], least_iou: float = OVERLAPS[0], of: Of = everything) -> Count:
    """The same of several pictures."""
    return sum((count(row, least_iou, of) for row in rows), Count())


def whole_only(row: Row) -> Row:
    """The same picture, of which no object is found by a part of it."""
    return replace(row, truths=tuple(replace(truth, by_part=False) for truth in row.truths))


def line(name: str, rows: Sequence[Row]) -> str:
    """What is found in some pictures, and medians of their figures."""
    total = counts(rows)
    figures = " ".join(f"{key} {value:.2f}" for key, value in picture_figures(rows).items())
    return (
        f"{name:22} found {total.found:3} of {total.objects:3}, {total.wrong:3} wrong; "
        f"without tables {counts(rows, of=no_table).recall:.2f}; {figures}"
    )


def picture_figures(rows: Sequence[Row]) -> dict[str, float]:
    """Of features the shares over all pictures, of statistics the medians, by name."""
    figures = {}
    for name in rows[0].features if rows else ():
        of_all = [row.features[name] for row in rows]
        shared, matches = sum(each.shared for each in of_all), sum(each.matches for each in of_all)
        figures[f"{name} repeated"] = sum(each.repeated for each in of_all) / max(shared, 1)
        figures[f"{name} right"] = sum(each.right for each in of_all) / max(matches, 1)
        figures[f"{name} matches"] = statistics.median(each.matches for each in of_all)
    for key, label in (("spectral_slope", "slope"), ("saturation", "saturation")):
        figures[label] = statistics.median(getattr(row.statistics, key) for row in rows)
    for key in ("white", "black"):
        figures[f"{key} %"] = 100 * statistics.mean(getattr(row.statistics, key) for row in rows)
    return figures


def markdown(rows: Sequence[Row]) -> Iterator[str]:
    """Yield tables: what is found by class, size, light and environment, and features and statistics by light."""
    yield "| | objects | found | recall | IoU 0.3 | whole only | wrong | precision |"
    yield "|---|" + "---|" * 7
    for name, chosen, of in groups(rows):
        total, loose = (counts(chosen, least_iou, of=of) for least_iou in OVERLAPS)
        whole = counts([whole_only(row) for row in chosen], of=of)
        if total.objects or total.wrong:
            yield (
                f"| {name} | {total.objects} | {total.found} | {share(total.recall)} | {share(loose.recall)} "
                f"| {share(whole.recall)} | {total.wrong} | {share(total.precision)} |"
            )
    lights = [(at, there) for at in TIMES if (there := [row for row in rows if row.time == at])]
    if lights:
        names = picture_figures(rows)
        yield f"\n| | pictures | {' | '.join(names)} |"
        yield "|---|" + "---|" * (len(names) + 1)
    for at, there in lights:
        cells = (f"{value:.2f}" for value in picture_figures(there).values())
        yield f"| {at} | {len(there)} | {' | '.join(cells)} |"


def groups(rows: Sequence[Row]) -> Iterator[tuple[str, Sequence[Row], Of]]:
    """Name, pictures and objects of each line of the first table."""
    yield "all", rows, everything
    yield "all but tables", rows, no_table
    yield "1,000 to 4,000 pixels", rows, lambda _, pixels: pixels < LARGE_PIXELS
    yield "more", rows, lambda _, pixels: pixels >= LARGE_PIXELS
    for at in TIMES:
        yield at, [row for row in rows if row.time == at], everything
    for wanted in sorted(CLASS_LIST):
        yield wanted, rows, of_class(wanted)
    for environment in sorted({row.environment for row in rows}):
        yield f"`{environment}`", [row for row in rows if row.environment == environment], everything


def of_class(wanted: str) -> Of:
    """Return what is true of a class."""
    return lambda class_name, _: class_name == wanted


def share(value: float) -> str:
    """A share with two digits, a dash where there is none."""
    return "–" if np.isnan(value) else f"{value:.2f}"
