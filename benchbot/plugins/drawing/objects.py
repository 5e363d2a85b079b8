"""The objects of a map, as the method of evaluation explains them, or else as result and truth state them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.episodes import Document, Episode

MATCH, FALSE_POSITIVE, FALSE_NEGATIVE, IGNORED = "match", "false_positive", "false_negative", "ignored"
WORDS = {
    MATCH: "found",
    FALSE_POSITIVE: "not there",
    FALSE_NEGATIVE: "missed",
    IGNORED: "not counted",
}
"""What became of an object, in a word that needs no statistics."""


@dataclass(frozen=True)
class Thing:
    """An object: what was proposed, what is there (either may be None), and what the method makes of the two."""

    scene: int
    verdict: str | None
    label: str
    truth_label: str | None
    proposed: Box | None
    true: Box | None
    quality: float | None
    why: str

    @property
    def name(self) -> str:
        """The true class when there is one, else the proposed one."""
        return self.truth_label or self.label

    @property
    def failed(self) -> bool:
        """Whether it was missed, or is not there."""
        return self.verdict in (FALSE_POSITIVE, FALSE_NEGATIVE)


@dataclass
class ClassTally:
    """What became of the objects of one class."""

    name: str
    there: int = 0
    found: int = 0
    missed: int = 0
    not_there: int = 0
    qualities: list[float] = field(default_factory=list)

    @property
    def quality(self) -> float | None:
        """The mean quality of those that were found."""
        return sum(self.qualities) / len(self.qualities) if self.qualities else None


def things_of(episode: Episode) -> list[Thing]:
    """Return the objects of an episode: failures first, then the worst matches first."""
    names = [f"{scene.get('name')}:{scene.get('variant')}" for scene in episode.scenes]
    explained = [_explained(item, names) for item in episode.objects]
    return sorted(explained or list(_stated(episode)), key=_order)


def goals_of(episode: Episode) -> list[tuple[float, float]]:
    """Return the places in the map frame that the robot was to reach: one, or an instance of the wanted class each."""
    goal = episode.goal or {}
    if "position" in goal:
        return [(float(goal["position"][0]), float(goal["position"][1]))]
    centroids = [instance["centroid"] for instance in goal.get("instances", ())]
    return [(float(x), float(y)) for x, y, *_ in centroids]


def by_class(things: Iterable[Thing]) -> list[ClassTally]:
    """Return what became of each class, those with most failures first, then those of the worst quality."""
    tallies: dict[str, ClassTally] = {}
    for thing in things:
        if thing.verdict in WORDS and thing.verdict != IGNORED:
            tally = tallies.setdefault(thing.name, ClassTally(thing.name))
            tally.there += thing.verdict != FALSE_POSITIVE
            tally.found += thing.verdict == MATCH
            tally.missed += thing.verdict == FALSE_NEGATIVE
            tally.not_there += thing.verdict == FALSE_POSITIVE
            if thing.verdict == MATCH and thing.quality is not None:
                tally.qualities.append(thing.quality)
    return sorted(
        tallies.values(), key=lambda tally: (-tally.missed - tally.not_there, tally.quality or 0.0, tally.name)
    )


def _explained(item: Document, scenes: Sequence[str]) -> Thing:
    found = item["verdict"] == MATCH
    return Thing(
        scene=scenes.index(item["scene"]) if item["scene"] in scenes else 0,
        verdict=item["verdict"],
        label=item["label"] or "",
        truth_label=item["truth_label"] if item["verdict"] != FALSE_POSITIVE else None,
        proposed=Box.of(item["centroid"], item["extent"]) if item["verdict"] != FALSE_NEGATIVE else None,
        true=Box.of(item["truth_centroid"], item["truth_extent"]) if item["verdict"] != FALSE_POSITIVE else None,
        quality=item["factors"].get("overall") if found else None,
        why=item["why"],
    )


def _stated(episode: Episode) -> Iterable[Thing]:
    """Yield what an object map and its truth hold, when the method says nothing of which object is which."""
    for scene, truth in enumerate(episode.truths):
        for label, box in stated(truth.get("ground_truth")):
            yield Thing(scene, None, "", label, None, box, None, "")
    for label, box in proposed((episode.document or {}).get("results")):
        yield Thing(len(episode.scenes) - 1, None, label, None, box, None, None, "")


def stated(truth: object) -> list[tuple[str, Box | None]]:
    """Return class and box of each object of a ground truth that is a map of objects; none of another one."""
    return [(str(item.get("class", "")), Box.of(item["centroid"], item["extent"])) for item in _boxes(truth)]


def proposed(results: object) -> list[tuple[str, Box | None]]:
    """Return the likeliest class and the box of each object of results that are a map of objects; none of others."""
    found = []
    for item in _boxes(results):
        weights = item.get("label_probs") or []
        names = results["class_list"] if isinstance(results, dict) and "class_list" in results else []
        likeliest = max(range(len(weights)), key=weights.__getitem__, default=-1)
        label = str(names[likeliest]) if 0 <= likeliest < len(names) else ""
        found.append((label, Box.of(item["centroid"], item["extent"])))
    return found


def _boxes(document: object) -> list[Document]:
    items = document.get("objects") if isinstance(document, dict) else None
    if not isinstance(items, list):
        return []
    return [item for item in items if isinstance(item, dict) and "centroid" in item and "extent" in item]


def _order(thing: Thing) -> tuple[object, ...]:
    rank = [FALSE_NEGATIVE, FALSE_POSITIVE, MATCH, IGNORED, None].index(thing.verdict)
    quality = thing.quality if thing.quality is not None else 0.0
    size = thing.true or thing.proposed
    volume = 0.0 if size is None else size.extent[0] * size.extent[1] * size.extent[2]
    return (thing.scene, rank, quality, -volume, thing.name)
