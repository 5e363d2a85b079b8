"""What is told of two results of one run: that they are the same, or what differs first."""

import json
from typing import Any

import pytest

from benchbot.plugins.bundles import comparing


def changed(document: dict[str, Any], *changes: tuple[str, Any]) -> dict[str, Any]:
    copy: dict[str, Any] = json.loads(json.dumps(document))
    for pointer, value in changes:
        *way, last = [int(key) if key.isdigit() else key for key in pointer.split("/")]
        place: Any = copy
        for key in way:
            place = place[key]
        place[last] = value
    return copy


def test_where_and_how_it_ran_makes_no_difference(driven: dict[str, Any]) -> None:
    elsewhere = changed(
        driven,
        ("provenance/solution", {"command": ["other"], "mode": "sandbox"}),
        ("provenance/machine", {"python": "3.13.0"}),
        ("provenance/benchbot", "9.9"),
    )
    assert comparing.differences(driven, elsewhere) == []


SEEN = ("provenance/observation_digest", "0" * 64)


@pytest.mark.parametrize(
    ("changes", "first"),
    [
        (
            [SEEN, ("actions/0/rows/3", ["0" * 16, "move_angle", {"angle": 45}])],
            "before observation 3 (arena:1): move_a",
        ),
        ([SEEN, ("actions/0/rows/1/0", "0" * 16)], "seen, first at observation 1 (arena:1, after move_distance(0.5))"),
        ([SEEN, ("actions/0/rows", [])], "the digests of the observations differ"),
        ([SEEN, ("actions", None)], "the digests of the observations differ"),
        ([("provenance/failure", {"class": "agent", "why": "Oh."})], "It ended otherwise: agent (Oh.) instead of well"),
        ([("results/objects", [{"centroid": [0, 0, 1]}])], "first at /results/objects (1 items instead of 0 items)"),
        ([("results", None)], "first at /results (None instead of a mapping)"),
        ([("track/0/rows/1/2", 7.5)], "The documents differ, first at /track/0/rows/1/2 (7.5 instead of"),
        ([("provenance/steps", 4.0)], "The documents differ, first at /provenance/steps"),
    ],
)
def test_what_differs_first_is_told_first(driven: dict[str, Any], changes: list[Any], first: str) -> None:
    assert first in comparing.differences(driven, changed(driven, *changes))[0]


def test_another_device_is_told_before_what_it_shows(driven: dict[str, Any]) -> None:
    elsewhere = changed(driven, ("provenance/machine/device", "cuda: NVIDIA H100"))
    assert comparing.differences(driven, elsewhere) == []
    device, seen, *_ = comparing.differences(driven, changed(elsewhere, SEEN, ("actions/0/rows/1/0", "0" * 16)))
    assert device.startswith("It was simulated on cuda: NVIDIA H100 instead of cpu, whose pictures are not the same")
    assert seen.startswith("Something else is seen")


def test_a_run_that_is_cut_short_agrees_as_far_as_it_goes(driven: dict[str, Any]) -> None:
    rows = driven["actions"][0]["rows"]
    (text, *_) = comparing.differences(driven, changed(driven, SEEN, ("actions/0/rows", rows[:3])))
    assert text == "There are 3 observations instead of 5; as long as there are both, they agree."


def test_scores_are_held_against_scores_within_the_tolerance() -> None:
    def document(value: float, environment: str = "arena:1", method: str = "omq") -> dict[str, Any]:
        rows = [{"environment": environment, "seed": 3, "scores": {"OMQ": value}}]
        return {"method": {"name": method}, "rows": rows, "scores": {"OMQ": value}}

    assert comparing.score_contradictions(document(0.5), document(0.5)) == []
    assert comparing.score_contradictions(document(0.5), document(0.52), tolerance=0.03) == []
    assert comparing.score_contradictions(document(0.5), document(0.7)) == [
        "arena:1, seed 3: OMQ is 0.7, not 0.5",
        "all: OMQ is 0.7, not 0.5",
    ]
    assert "not among the results" in comparing.score_contradictions(document(0.5), document(0.5, "arena:2"))[0]
    assert "of the method 'other'" in comparing.score_contradictions(document(0.5, method="other"), document(0.5))[0]
