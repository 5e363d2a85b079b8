"""The format `object_map`: the objects that semantic SLAM found, as boxes with class probabilities."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict

from benchbot.core import instance_checks as checks
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean

if TYPE_CHECKING:
    from numpy.typing import NDArray

# The 30 classes of BEAR (Hall et al., IJRR 41(3), 2022, doi 10.1177/02783649211069404) and the background.
CLASS_LIST = (
    "bottle", "cup", "knife", "bowl", "wine glass", "fork", "spoon", "banana", "apple", "orange", "cake",
    "potted plant", "mouse", "keyboard", "laptop", "cell phone", "book", "clock", "chair", "table", "couch",
    "bed", "toilet", "tv", "microwave", "toaster", "refrigerator", "oven", "sink", "person", "background",
)  # fmt: skip

Flaw = tuple[str, str]
"""Why, and the fix."""

BACKGROUND = "background"
SUM_TOLERANCE = 1e-3
"""How far probabilities may sum from 1: those of a network are in single, or even in half precision."""


class ObjectEntry(TypedDict):
    """One of a map's `objects`: class probabilities, the middle of its box and the box's full lengths, metres."""

    label_probs: list[float]
    centroid: list[float]
    extent: list[float]


def create(class_list: list[str] | None = None) -> dict[str, Any]:
    """Return an empty map over `class_list` (the default is the 30 classes of BEAR and the background)."""
    return {"objects": [], "class_list": list(CLASS_LIST if class_list is None else class_list)}


def create_object(
    num_classes: int | None = None,
    *,
    class_list: Sequence[str] | None = None,
    label_probs: "Mapping[str, float] | Sequence[float] | NDArray[Any] | None" = None,
    centroid: "Sequence[float] | NDArray[Any] | None" = None,
    extent: "Sequence[float] | NDArray[Any] | None" = None,
) -> ObjectEntry:
    """Return an object: filled in and checked with the last three arguments, without them all zero, to be filled in.

    `label_probs` sum to 1: those of some classes by name (`{"chair": 0.9, "background": 0.1}`), or one for each class
    of `class_list`, which is that of the result (the default is BEAR's, as in `create`; `num_classes` is its length).
    `centroid` is the middle of the axis-aligned box, x, y, z in the map frame, `extent` its full lengths along these
    axes, metres. Raises BenchbotError, before a score is spoilt, for what cannot be meant.
    """
    names = CLASS_LIST if class_list is None else class_list
    count = len(names) if num_classes is None else checks.count(num_classes, "num_classes")
    given = {"label_probs": label_probs, "centroid": centroid, "extent": extent}
    if all(value is None for value in given.values()):
        return {"label_probs": [0] * count, "centroid": [0, 0, 0], "extent": [0, 0, 0]}
    flaw = _missing(given) or _unknown_class(label_probs, names)
    if isinstance(label_probs, Mapping):
        label_probs = [label_probs.get(name, 0.0) for name in names]
    item: ObjectEntry = {"label_probs": _listed(label_probs), "centroid": _listed(centroid), "extent": _listed(extent)}
    flaw = flaw or _flaw(item, count)
    # Raised here and not farther in, so that a traceback ends beside the line of the solution.
    if flaw:
        raise BenchbotError("This is no object of an object map.", *flaw, failure=FailureClass.AGENT)
    return item


def validate(instance: Any) -> None:
    """Raise BenchbotError that names each place of `instance` that breaks the format."""
    checks.raise_any(problems(instance, "results"), "object_map")


def problems(instance: Any, path: str) -> Iterator[str]:
    """Yield one line for each thing wrong with an object map."""
    wrong = list(checks.mapping(instance, ("objects", "class_list"), path))
    if wrong:
        yield from wrong
        return
    class_list = instance["class_list"]
    yield from checks.names(class_list, f"{path}.class_list")
    count = len(class_list) if isinstance(class_list, list) else 0

    def of_object(item: dict[str, Any], where: str) -> Iterator[str]:
        yield from checks.probabilities(item.get("label_probs"), f"{where}.label_probs", count, "class_list")
        yield from checks.box(item, where)

    yield from checks.each(instance["objects"], f"{path}.objects", of_object)


def _missing(given: Mapping[str, Any]) -> Flaw | None:
    missing = [name for name, value in given.items() if value is None]
    return (f"{missing[0]}: is missing", "Give all three: label_probs, centroid and extent.") if missing else None


def _unknown_class(label_probs: Any, class_list: Sequence[str]) -> Flaw | None:
    unknown = [name for name in label_probs if name not in class_list] if isinstance(label_probs, Mapping) else []
    if not unknown:
        return None
    known = did_you_mean(unknown[0], list(class_list)) or f" It has: {', '.join(class_list)}."
    return (
        f"object.label_probs: the class '{unknown[0]}' is not in class_list.{known}",
        f"Name one that is, or count it as '{BACKGROUND}'.",
    )


def _listed(values: Any) -> Any:
    """Return the numbers of a sequence or an array as JSON has them; anything else as it is, for `_flaw`."""
    if hasattr(values, "tolist"):
        return values.tolist()
    if not isinstance(values, list | tuple):
        return values
    return [value.item() if hasattr(value, "item") else value for value in values]


def _flaw(item: ObjectEntry, count: int) -> Flaw | None:
    """Return why an object cannot be meant, and what to do; None for one that can."""
    wrong = list(checks.box(dict(item), "object"))
    if wrong:
        fix = "Both are x, y, z in metres: centroid = (lower + upper) / 2, extent = upper - lower."
        if any(sign in wrong[0] for sign in ("NaN", "above", "below -")):
            fix = "Leave out pixels without depth (NaN, inf) before taking the smallest and the largest coordinates."
        elif "below 0" in wrong[0]:
            fix = "An extent is the full length along an axis, upper - lower: never negative."
        return "\n".join(wrong), fix
    wrong = list(checks.probabilities(item["label_probs"], "object.label_probs", count, "class_list"))
    if wrong:
        return "\n".join(wrong[:3]), "Give each class of class_list a probability from 0 to 1, or name some."
    total = math.fsum(item["label_probs"])
    if abs(total - 1) <= SUM_TOLERANCE:
        return None
    fix = "Divide them by their sum." if total > 1 else f"Give the rest to '{BACKGROUND}', or divide by the sum."
    return f"object.label_probs: sum to {total:.4g}, not to 1", fix
