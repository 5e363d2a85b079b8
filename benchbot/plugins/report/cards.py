"""Cards of a report: which objects to show, in which frames, and what is said of each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchbot.evaluation.evidence import camera_of, scene_of
from benchbot.evaluation.frames import Frame
from benchbot.plugins.drawing.map_model import FALSE_NEGATIVE, FALSE_POSITIVE, MapObject
from benchbot.plugins.drawing.palette import ESTIMATE_OUTLINE, TRUTH_OUTLINE
from benchbot.plugins.report.camera_pictures import Budget, Outline, Shot, crop
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode
from benchbot.plugins.report.summary import VERDICTS

MOST_CARDS = 12
FEWEST_CARDS, GOOD_QUALITY = 4, 0.9
"""If fewer objects than this failed, the worst of those that were found are shown, too, unless they are good."""
_OF_ESTIMATES = (None, "duplicate", "background")
"""Errors that an estimate has for itself; the others are shown with the true object that was mistaken."""


@dataclass(frozen=True)
class Card:
    """An object that went wrong, or worst, its picture (None without one) and what that shows."""

    object: MapObject
    picture: str | None
    alt: str


def worst(objects: Sequence[MapObject]) -> list[MapObject]:
    """Return what failed, each confusion once, and, where that is little, what was found worst.

    Each kind of error comes first once, so that none is left out for being rarer or smaller than others.
    """
    # What was missed shows the estimate at its place as well.
    failed = [item for item in objects if item.failed and not (item.error not in _OF_ESTIMATES and not item.true)]
    kinds: dict[str | None, int] = {}
    ranked = []
    for place, item in enumerate(failed):
        kinds[item.error] = kinds.get(item.error, 0) + 1
        ranked.append((kinds[item.error], place, item))
    failed = [item for *_, item in sorted(ranked, key=lambda one: one[:2])][:MOST_CARDS]
    found = [item for item in objects if item.quality is not None and item.quality < GOOD_QUALITY]
    return failed + found[: max(FEWEST_CARDS - len(failed), 0)]


def shots_of(episode: ReportedEpisode, data: ReportData, frames: Sequence[Frame]) -> dict[int, Shot]:
    """Return what can be drawn into, by the number of the observation; nothing where no camera is known."""
    camera = camera_of(episode.document or {}, data.catalog)
    if camera is None or not frames:
        return {}
    scenes = []
    for scene in episode.scenes:
        name = f"{scene.get('name')}:{scene.get('variant')}"
        scenes.append(scene_of(name, [item for item in episode.explanation if item["scene"] == name], data.catalog))
    return {frame.number: Shot(frame, camera, scenes[frame.scene]) for frame in frames}


def card_of(item: MapObject, shot_of: Callable[[int], Shot | None], budget: Budget) -> Card:
    """Return the card of an object, with the frame that shows it best; `shot_of` gives that of an observation."""
    views = (item.evidence or {}).get("views", ())
    shot = shot_of(views[0]["observation"]) if views else None
    if shot is None:
        return Card(item, None, "")
    outlines = outlines_of(item)
    what = "boxes are" if len(outlines) > 1 else "box is"
    alt = f"What the camera saw where {item.name} {_there(item)}; its {what} outlined."
    return Card(item, crop(shot, outlines, budget), alt)


def outlines_of(item: MapObject) -> list[Outline]:
    """Return the boxes of an object, and of what it was mistaken for, with their classes and probabilities."""
    other = item.mistaken or item
    true, estimated = item if item.true else other, item if item.estimated else other
    found = [] if true.true is None else [Outline(true.true, TRUTH_OUTLINE, true.truth_label or "object")]
    if estimated.estimated is not None:
        sure = "" if estimated.probability is None else f" {estimated.probability:.2f}"
        found.append(Outline(estimated.estimated, ESTIMATE_OUTLINE, f"{estimated.label or 'object'}?{sure}"))
    return found


def verdict_of(item: MapObject) -> str:
    """Return what became of an object, and which mistake that is."""
    said = VERDICTS.get(item.verdict or "", "")
    if item.verdict == FALSE_POSITIVE and item.error == "duplicate":
        return "reported once more"
    other = item.mistaken if item.verdict == FALSE_NEGATIVE else item
    if item.error in ("class", "both") and other is not None:
        return f"{said}, called {other.label}"
    return {"location": f"{said}, box off", "state": f"{said}, wrong state"}.get(item.error or "", said)


def _there(item: MapObject) -> str:
    said = {FALSE_NEGATIVE: "stands and was missed", FALSE_POSITIVE: "was reported and is not there"}
    return said.get(item.verdict or "", "was found")
