"""A map whose boxes were left in the frame of robot or camera is recognised; a poor one in the right frame is not."""

import math
from typing import Any

import numpy as np
import pytest

from benchbot.plugin import Catalog, Pose, Result, load_plugins
from benchbot_eval_omq.explanation import explain
from plugins.eval_omq.tests.omq_maps import CLASSES, found, semantic_map, thing, truth

POSES = [Pose.planar(0.3 * step, 0.2 * step, 0.5 * math.pi * (step % 4)) for step in range(12)]


def camera() -> Pose:
    declared = Catalog(load_plugins()).get("robots", "carter_lowres").data["frames"]["camera_left"]
    return Pose.from_xyz_rpy_deg(declared["xyz"], declared["rpy_deg"])


def things(count: int = 12) -> list[dict[str, Any]]:
    places = np.random.default_rng(4).uniform(-4, 4, (count, 3))
    sizes = np.random.default_rng(5).uniform(0.4, 0.9, (count, 3))
    return [
        thing(CLASSES[i % 3], centroid=place.tolist(), extent=size.tolist())
        for i, (place, size) in enumerate(zip(places, sizes, strict=True))
    ]


def driven(result: Result) -> Result:
    rows = [[i, float(i), *pose.translation_xyz[:2], pose.yaw_rad] for i, pose in enumerate(POSES)]
    selection = {"selection": {"robot": "carter_lowres"}}
    whole: Any = {**result, "track": [{"rows": rows}], "provenance": selection}
    return whole  # type: ignore[no-any-return]


def seen_from(there: list[dict[str, Any]], mount: Pose) -> list[dict[str, Any]]:
    """Return estimates of things, each in the frame `mount` of the robot at one of its places."""
    estimates = []
    for i, item in enumerate(there):
        back = (POSES[i % len(POSES)] @ mount).inverse()
        centroid = list((back @ Pose(tuple(item["centroid"]))).translation_xyz)
        extent = np.abs(back.matrix()[:3, :3]) @ item["extent"]
        estimates.append(found(item["class"], centroid=centroid, extent=extent.tolist()))
    return estimates


@pytest.mark.parametrize("name", ["robot", "camera"])
def test_boxes_in_another_frame_are_recognised(name: str) -> None:
    there = things()
    mount = camera() if name == "camera" else Pose.planar(0.0, 0.0, 0.0)

    hints = explain(driven(semantic_map(*seen_from(there, mount))), [truth(*there)])["diagnosis"]["hints"]

    assert any(hint.startswith(f"It fits better after {name} → map: 1.00.") for hint in hints)


def test_a_poor_map_in_the_right_frame_is_not_blamed_on_it() -> None:
    there = things()
    shifted = [
        found(item["class"], centroid=[x + 0.3 for x in item["centroid"]], extent=item["extent"]) for item in there
    ]

    for objects in (shifted, seen_from(things(3), POSES[3])):
        hints = explain(driven(semantic_map(*objects)), [truth(*there)])["diagnosis"]["hints"]
        assert not any("fits better" in hint for hint in hints)
