"""Classes and numbers of objects in segmented pictures, held against what stands there."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

from benchbot.core.findings import Finding, Level
from benchbot.plugins.authoring.comparability.senses import Sight, pictures
from benchbot.plugins.authoring.comparability.world import NOTHING, World

CHANNEL = "image_segment"
FEWEST_PIXELS = 6
_NOTHING = "nothing"


def class_ids(sights: Sequence[Sight]) -> dict[str, int]:
    """Return the numbers of classes by name, as the robot has them; empty where it has no segmentation."""
    with_labels = (sight.observations[CHANNEL] for sight in sights if CHANNEL in sight.observations)
    return next((dict(labels["class_ids"]) for labels in with_labels), {})


def check_classes(sights: Sequence[Sight], robot: Mapping[str, Any], world: World) -> Iterator[Finding]:
    """Yield the finding on whether each class is labelled as itself, and all else as nothing."""
    names = {number: name for name, number in class_ids(sights).items()} | {0: _NOTHING}
    labels: dict[str, list[int]] = {}
    for _, name, pixels in _objects(sights, robot, world):
        labels.setdefault(name.class_name or _NOTHING, []).extend(pixels[:, 0].tolist())
    most = {name: max(set(seen), key=seen.count) for name, seen in labels.items() if len(seen) >= FEWEST_PIXELS}
    taken_for = {name: names.get(number, f"{number}, which has no name") for name, number in most.items()}
    wrong = {name: taken for name, taken in sorted(taken_for.items()) if taken != name}
    if wrong:
        detail = ", ".join(f"what is {name} is labelled {taken}" for name, taken in wrong.items())
        permuted = len(wrong) > 1 and set(wrong) == set(wrong.values())
        yield Finding(
            Level.BROKEN,
            f"{CHANNEL}: classes",
            f"{'The classes are permuted' if permuted else 'Classes are wrong'}: {detail}.",
            "The class of an object is in its node's tag (docs/scenes.md); class_ids says which number that is.",
        )
    elif taken_for:
        yield Finding(Level.OK, f"{CHANNEL}: classes", f"{', '.join(sorted(taken_for))}: each labelled as itself")


def check_instances(sights: Sequence[Sight], robot: Mapping[str, Any], world: World) -> Iterator[Finding]:
    """Yield the finding on whether each object has a number of its own, from a load to the next."""
    numbers: dict[tuple[int, str], set[int]] = {}
    for load, box, pixels in _objects(sights, robot, world):
        if box.class_name is not None and len(pixels) >= FEWEST_PIXELS:
            seen = pixels[:, 1].tolist()
            numbers.setdefault((load, box.name), set()).add(max(set(seen), key=seen.count))
    wrong = [
        f"{name} has the numbers {', '.join(map(str, sorted(values)))}"
        for (_, name), values in numbers.items()
        if len(values) > 1
    ]
    wrong += [
        f"{one} and {other} have the same number {min(numbers[load, one] & numbers[load, other])}"
        for (load, one), (again, other) in combinations(numbers, 2)
        if load == again and numbers[load, one] & numbers[load, other]
    ]
    if wrong:
        yield Finding(
            Level.BROKEN,
            f"{CHANNEL}: instances",
            f"Objects cannot be told apart by instance_segment_img: {'; '.join(dict.fromkeys(wrong))}.",
            "Give each object of a class a number, from 1, that it keeps until the next load.",
        )
    elif numbers:
        count = len({name for _, name in numbers})
        yield Finding(Level.OK, f"{CHANNEL}: instances", f"{count} objects, each with a number of its own")


def _objects(sights: Sequence[Sight], robot: Mapping[str, Any], world: World) -> Iterator[tuple[int, Any, Any]]:
    """Yield what is seen of each box: the load, the box, and the class and number of its pixels (N, 2)."""
    loads = [sight.load for sight in sights if CHANNEL in sight.observations]
    for load, picture in zip(loads, pictures(sights, CHANNEL, robot), strict=False):
        _, index = world.cast(picture.origin, picture.directions())
        for number in sorted(set(index.ravel().tolist()) - {NOTHING}):
            yield load, world.boxes[number], picture.values[index == number]
