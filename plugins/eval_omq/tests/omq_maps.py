"""Small object maps and ground truths for the tests."""

from typing import Any

from benchbot.plugin import GroundTruth, Result

CLASSES = ["chair", "table", "tv", "background"]


def truth(*objects: dict[str, Any], **keys: Any) -> GroundTruth:
    """Return a ground truth of these objects."""
    return {
        "environment": {"name": "room", "variant": 1, "object_labels": CLASSES[:-1]},
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": list(objects), "class_list": CLASSES, "synonyms": {}} | keys,
    }


def thing(name: str, x: float = 0.0, size: float = 1.0, **keys: Any) -> dict[str, Any]:
    """Return a true object: a cube."""
    return {"class": name, "centroid": [x, 0.0, 0.0], "extent": [size] * 3, "isgroup": False} | keys


def found(name: str, x: float = 0.0, size: float = 1.0, sure: float = 1.0, **keys: Any) -> dict[str, Any]:
    """Return an estimated object: a cube, `sure` to be of class `name`."""
    probabilities = [sure if name == listed else 0.0 for listed in CLASSES]
    return {"label_probs": probabilities, "centroid": [x, 0.0, 0.0], "extent": [size] * 3} | keys


def semantic_map(*objects: dict[str, Any], **keys: Any) -> Result:
    """Return the result of a semantic SLAM task."""
    return {
        "task_details": {"name": "semantic_slam:passive:ground_truth", "results_format": "object_map"},
        "environment_details": [{"name": "room", "variant": 1}],
        "results": {"objects": list(objects), "class_list": CLASSES} | keys,
    }


def change_map(*objects: dict[str, Any]) -> Result:
    """Return the result of a scene change detection task."""
    result = semantic_map(*objects, state_list=["added", "removed", "unchanged"])
    return result | {"task_details": {"name": "any name", "results_format": "object_map_with_states"}}
