"""The format `trajectory`: what it accepts, and the place in the document of what it does not."""

import math
from typing import Any

import pytest

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load

DECLARED = Catalog(load()).get("formats", "trajectory")


def pose(**changes: Any) -> dict[str, Any]:
    made = formats.call(DECLARED, "create_pose", [], {})
    return {**made, **changes}


def test_what_its_functions_make_is_valid() -> None:
    empty = formats.call(DECLARED, "create", [], {})
    formats.validate(DECLARED, empty)
    empty["poses"] += [pose(), pose(observation=7, rotation_xyzw=[0.5, 0.5, 0.5, 0.5])]
    formats.validate(DECLARED, empty)

    assert formats.call(DECLARED, "create_pose", [3], {})["observation"] == 3


@pytest.mark.parametrize(
    ("results", "why"),
    [
        (None, "results: must be a mapping, not nothing"),
        ({}, "results.poses: is missing"),
        ({"poses": {}}, "results.poses: must be a list, not a mapping"),
        ({"poses": [[1, 2]]}, "results.poses[0]: must be a mapping, not a list"),
        ({"poses": [pose(observation=-1)]}, "results.poses[0].observation: must be a whole number from 0"),
        ({"poses": [pose(observation=True)]}, "results.poses[0].observation: must be a whole number from 0"),
        ({"poses": [pose(observation=1.0)]}, "results.poses[0].observation: must be a whole number from 0"),
        ({"poses": [pose(), pose()]}, "results.poses[1].observation: 0 has a pose already"),
        ({"poses": [pose(translation_xyz=[0, 0])]}, "results.poses[0].translation_xyz: 2 numbers, must be 3"),
        ({"poses": [pose(translation_xyz=[0, 0, math.nan])]}, "results.poses[0].translation_xyz[2]: "),
        ({"poses": [pose(rotation_xyzw=None)]}, "results.poses[0].rotation_xyzw: is missing"),
        ({"poses": [pose(rotation_xyzw=[0, 0, 0, math.inf])]}, "results.poses[0].rotation_xyzw[3]: "),
        ({"poses": [pose(rotation_xyzw=[0, 0, 0, 0])]}, "results.poses[0].rotation_xyzw: has the length 0,"),
        ({"poses": [pose(rotation_xyzw=[1, 0, 0, 1])]}, "results.poses[0].rotation_xyzw: has the length 1.414,"),
    ],
)
def test_what_breaks_it_is_named_with_its_place(results: Any, why: str) -> None:
    with pytest.raises(BenchbotError, match="not a valid trajectory") as caught:
        formats.validate(DECLARED, results)

    assert caught.value.why.startswith(why)
