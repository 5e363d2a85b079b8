"""The format `object_map`: the objects that semantic SLAM found, as boxes with class probabilities."""

from collections.abc import Iterator
from typing import Any

from benchbot.core import instance_checks as checks

# The 30 classes of BEAR (Hall et al., IJRR 41(3), 2022, doi 10.1177/02783649211069404) and the background.
CLASS_LIST = (
    "bottle", "cup", "knife", "bowl", "wine glass", "fork", "spoon", "banana", "apple", "orange", "cake",
    "potted plant", "mouse", "keyboard", "laptop", "cell phone", "book", "clock", "chair", "table", "couch",
    "bed", "toilet", "tv", "microwave", "toaster", "refrigerator", "oven", "sink", "person", "background",
)  # fmt: skip


def create(class_list: list[str] | None = None) -> dict[str, Any]:
    """Return an empty map over `class_list` (the default is the 30 classes of BEAR and the background)."""
    return {"objects": [], "class_list": list(CLASS_LIST if class_list is None else class_list)}


def create_object(num_classes: int | None = None) -> dict[str, Any]:
    """Return an object with `num_classes` class probabilities, a centroid and a full extent in metres, all zero."""
    return {
        "label_probs": [0] * (len(CLASS_LIST) if num_classes is None else checks.count(num_classes, "num_classes")),
        "centroid": [0, 0, 0],
        "extent": [0, 0, 0],
    }


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
