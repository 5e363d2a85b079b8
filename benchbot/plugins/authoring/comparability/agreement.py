"""How much of what a sense observed agrees with what stands there, and which known fault explains the rest."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core.findings import Finding, Level
from benchbot.plugins.authoring.comparability.faults import Fault, Sense
from benchbot.plugins.authoring.comparability.senses import Picture
from benchbot.plugins.authoring.comparability.world import NOTHING, Floats, World

TOLERANCE_M, TOLERANCE_SHARE = 0.03, 0.03
FULL = 0.995
"""More agreement than this leaves nothing to explain."""
LEAST_GAIN = 0.01
COLORFUL = 0.35
"""The least saturation of a colour: of those in the golden room under white light, more than half."""

Score = Callable[[Sequence[Sense]], float]


@dataclass(frozen=True)
class Explained:
    """How much agrees as it is, and the fault that explains the rest with how much agrees once that is undone."""

    share: float
    fault: Fault | None = None
    undone: float = 0.0


def explain(
    seen: Sequence[Sense], score: Score[Sense], faults: Callable[[], Iterable[Fault]], full: float = FULL
) -> Explained:
    """Return how well what was seen agrees, and the fault that is behind what does not.

    A fault is named when undoing it leaves less than half of what disagrees; where `full` agrees, none is sought.
    """
    share = score(seen)
    if share >= full:
        return Explained(share)
    best, most = None, 0.0
    # The search looks at a quarter of the pixels, and only what it finds is held against all of them.
    fewer: list[Sense] = [one.thinned() for one in seen]
    for fault in faults():
        undone = score(fault.undo(fewer))
        if undone > most + 1e-9:
            best, most = fault, undone
        if most >= full:
            break
    if best is None:
        return Explained(share)
    undone = score(best.undo(seen))
    explains = undone > share + LEAST_GAIN and 1 - undone < (1 - share) / 2
    return Explained(share, best, undone) if explains else Explained(share)


def finding(subject: str, explained: Explained, least: float, what: str) -> Finding:
    """Return the finding on a sense: broken where a fault explains it, or where less than `least` agrees."""
    percent = f"{explained.share:.0%} of {what}"
    if explained.fault is not None:
        words = explained.fault.words[0].upper() + explained.fault.words[1:]
        detail = f"{words}: as it is, {percent} are as they should be; with that undone, {explained.undone:.0%}."
        return Finding(Level.BROKEN, subject, detail, explained.fault.fix)
    if explained.share < least:
        detail = f"Only {percent} are as they should be, and no fault that is known explains the others."
        return Finding(
            Level.BROKEN, subject, detail, "Look at the picture, the sensor's pose and its model side by side."
        )
    return Finding(Level.OK, subject, percent)


def with_labels(depth: Picture, classes: NDArray[np.integer]) -> Picture:
    """Return a picture of two layers: depth, and the class of what is there."""
    return replace(depth, values=np.stack([depth.values, classes.astype(np.float64)], -1))


def lengths_agree(world: World) -> Score[Sense]:
    """Return the score of depths or ranges: the share that is within some centimetres of the truth."""

    def score(seen: Sequence[Sense]) -> float:
        agreeing, known = 0, 0
        for one, expected in zip(seen, expected_lengths(seen, world), strict=True):
            is_known = np.isfinite(expected)
            off_m = np.abs(one.values[is_known] - expected[is_known])
            agreeing += int(np.sum(off_m <= TOLERANCE_M + TOLERANCE_SHARE * expected[is_known]))
            known += int(is_known.sum())
        return agreeing / max(known, 1)

    return score


def expected_lengths(seen: Sequence[Sense], world: World) -> list[Floats]:
    """Return the true depths or ranges, shaped as those observed; NaN beyond the limits of the sensor."""
    expected = []
    for one in seen:
        lengths, _ = world.cast(one.origin, one.directions())
        low_m, high_m = one.limits_m
        expected.append(np.where((lengths >= low_m) & (lengths <= high_m), lengths, np.nan))
    return expected


def labels_agree(world: World, class_ids: Mapping[str, int]) -> Score[Picture]:
    """Return the score of classes: of the pixels that have or should have one, the share where it is the right one."""
    numbers = np.array([class_ids.get(box.class_name or "", 0) for box in world.boxes] + [0])

    def score(seen: Sequence[Picture]) -> float:
        return _overlap((one.values[..., 0], numbers[_hit(one, world)]) for one in seen)

    return score


def colors_agree(world: World, palette: Sequence[tuple[float, float, float]]) -> Score[Picture]:
    """Return the score of colours: of the pixels that have or should have one of the palette, the share that has it."""
    known: dict[Any, int] = {color: number for number, color in enumerate(palette, 1)}
    numbers = np.array([known.get(box.color, 0) for box in world.boxes] + [0])

    def score(seen: Sequence[Picture]) -> float:
        return _overlap((nearest_color(one.values, palette), numbers[_hit(one, world)]) for one in seen)

    return score


def nearest_color(rgb: NDArray[np.uint8], palette: Sequence[tuple[float, float, float]]) -> NDArray[np.intp]:
    """Return the number (from 1) of the palette's colour that each pixel has most of; 0 for what is grey."""
    linear = linear_rgb(rgb)
    brightest = linear.max(-1)
    saturation = 1 - linear.min(-1) / np.maximum(brightest, 1e-6)
    directions = np.array(palette) / np.linalg.norm(palette, axis=-1, keepdims=True)
    lengths = np.maximum(np.linalg.norm(linear, axis=-1, keepdims=True), 1e-6)
    nearest = np.argmax(linear / lengths @ directions.T, axis=-1) + 1
    return np.where((saturation > COLORFUL) & (brightest > 1e-3), nearest, 0)


def linear_rgb(rgb: NDArray[np.uint8]) -> Floats:
    """Return the light of sRGB bytes, 0 to 1 (IEC 61966-2-1)."""
    values = rgb.astype(np.float64) / 255
    light: Floats = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return light


def _hit(picture: Picture, world: World) -> NDArray[np.intp]:
    """Return the index of the box in each pixel; the last place of an array for none."""
    _, index = world.cast(picture.origin, picture.directions())
    return np.where(index == NOTHING, len(world.boxes), index)


def _overlap(pairs: Iterable[tuple[NDArray[np.integer], NDArray[np.integer]]]) -> float:
    """Return the share of equal ones, of all places where either is not 0."""
    equal, either = 0, 0
    for one, other in pairs:
        counts = (one != 0) | (other != 0)
        equal += int(np.sum((one == other) & counts))
        either += int(np.sum(counts))
    return equal / max(either, 1)
