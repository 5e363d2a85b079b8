"""Where and why episodes of navigation ended: each way to fail, driven on a floor that is known."""

import math
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot_task_navigation.ending import explain
from plugins.task_navigation.tests.floors import arena_truth
from plugins.task_navigation.tests.test_evaluator import ended_at

GOAL = (-1.4, -0.65)


def driven(*places: tuple[float, float, float], **changes: Any) -> dict[str, Any]:
    """Return how an episode in `arena:1` ended that drove over these places (x, y, yaw)."""
    x, y, _ = places[-1]
    result = ended_at(x, y, **changes)
    rows = [[None, float(i), *place] for i, place in enumerate(places)]
    rows[-1][0] = 0
    result["track"][0]["rows"] = rows
    told = explain(result, [arena_truth()])
    head = {"source": None, "environment": "arena:1", "seed": 0}
    document = {"version": 1, "method": {"name": "navigation", "version": "1"}, "results": [{**told, **head}]}
    schema.check(document, "explanation", Path("ending"))
    ending: dict[str, Any] = told["diagnosis"]["ending"]
    return ending


START = (0.05, -1.6, 0.0)
AWAY = (1.0, -1.6, 0.0)
CIRCLES = [(1 + 0.5 * math.cos(a / 4), -1 + 0.5 * math.sin(a / 4), a / 4 + 1.57) for a in range(100)]
TIMEOUT = {"class": "timeout", "why": "The limit of 9 steps is used up."}
ENDINGS: list[tuple[str, list[tuple[float, float, float]], dict[str, Any]]] = [
    ("reached", [START, (*GOAL, 0.0)], {}),
    ("collision", [START, AWAY], {"failure": {"class": "collision", "why": "A wall."}, "collisions": 1}),
    ("not_alone", [START, (-1.0, 0.3, -2.0)], {"restarts": 1}),
    ("failed", [START, AWAY], {"failure": {"class": "platform", "why": "It died."}}),
    ("passed", [START, (*GOAL, 0.0), AWAY], {}),
    ("loop", [START, *CIRCLES], {}),
    ("loop", [START, *CIRCLES], {"failure": TIMEOUT}),
    ("never_saw", [START, AWAY], {}),
    ("limit", [START, (-1.4, -0.2, -1.57)], {"failure": TIMEOUT}),
    ("stopped_short", [START, (-1.4, -0.2, -1.57)], {}),
]


@pytest.mark.parametrize(("kind", "places", "changes"), ENDINGS)
def test_an_ending_is_told_by_its_reason(
    kind: str, places: list[tuple[float, float, float]], changes: dict[str, Any]
) -> None:
    ending = driven(*places, **changes)

    assert ending["kind"] == kind
    assert ending["place"] == list(places[-1][:2])
    assert ending["nearest_m"] == pytest.approx(min(math.dist(place[:2], GOAL) for place in places))
    assert (ending["revisited"] > 0.5) == (kind == "loop")


def test_what_the_goal_hides_behind_is_no_sight_of_it() -> None:
    # The chair at (-1, -1) stands between (-0.5, -1.4) and the goal.
    towards = math.atan2(GOAL[1] + 1.4, GOAL[0] + 0.5)

    assert driven(START, (-0.5, -1.4, towards))["kind"] == "never_saw"
