from typing import Any

import pytest

from benchbot.core import episodes
from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.driven import Way, ways
from benchbot.plugins.drawing.objects import FALSE_POSITIVE, MATCH, Thing, by_class, goals_of
from benchbot.plugins.report import render
from benchbot.plugins.report.maps import MOST_LABELS, draw
from tests.made_results import Make, Save
from tests.plugins.report.conftest import START, TRACK, Report, provenance
from tests.plugins.report.pages import Page

NOWHERE = Way((), (), recorded=False)


def thing(x: float, y: float = 0.0, verdict: str | None = MATCH, name: str = "chair") -> Thing:
    box = Box((x, y, 0.5), (1.0, 0.5, 1.0))
    there = None if verdict == FALSE_POSITIVE else box
    return Thing(0, verdict, name, name, box, there, 0.5, "Because.")


def test_a_map_has_one_scale_x_to_the_right_and_y_up() -> None:
    drawing = draw([thing(0.0), thing(4.0), thing(0.0, 2.0)], NOWHERE)

    assert drawing is not None
    first, east, north = [shape for shape in drawing.shapes if shape.role == "truth"]
    assert east.x > first.x
    assert north.y < first.y
    assert (east.x - first.x) / 4 == pytest.approx((first.y - north.y) / 2, rel=0.01)
    assert first.width == pytest.approx(2 * first.height, rel=0.01)
    (zero, _), (one, _) = (column for column in drawing.columns if column[1] in ("0 m", "1 m"))
    assert one - zero == pytest.approx((east.x - first.x) / 4, rel=0.01)


def test_nothing_to_show_is_no_map() -> None:
    assert draw([], NOWHERE) is None
    assert draw([Thing(0, MATCH, "a", "a", None, None, 0.5, "Because.")], NOWHERE) is None


def test_a_single_place_is_a_map() -> None:
    drawing = draw([], Way(((1.0, 2.0),), (), recorded=True))

    assert drawing is not None
    assert drawing.start is not None
    assert drawing.end is None


def test_what_lies_far_outside_is_counted_and_does_not_shrink_the_rest() -> None:
    alone, crowded = draw([thing(0.0)], NOWHERE), draw([thing(0.0), thing(1e5, verdict=FALSE_POSITIVE)], NOWHERE)

    assert alone is not None
    assert crowded is not None
    assert crowded.shapes == alone.shapes
    assert (alone.outside, crowded.outside) == (0, 1)


def test_of_very_many_objects_the_failures_are_named() -> None:
    found = [thing(0.02 * i, 0.01 * i) for i in range(MOST_LABELS)]
    wrong = [thing(1.5 * i, 3.0, FALSE_POSITIVE, f"cup {i}") for i in range(5)]

    drawing = draw([*found, *wrong], NOWHERE)

    assert drawing is not None
    assert sum(label.kind == "extra" for label in drawing.labels) == 5
    # There is no room for all others.
    assert 5 < len(drawing.labels) < MOST_LABELS


def test_the_way_is_the_track_and_otherwise_what_was_planned(report: Report, make_result: Make, save: Save) -> None:
    document = make_result(0.0, provenance=provenance(), track=[TRACK])
    planned = make_result(0.0, provenance=provenance())
    planned["environment_details"][0] |= {"start_pose": START, "trajectory_poses": [START, START]}
    driven, meant = (
        ways(report([save(f"{name}.json", item)]).episodes[0])[0]
        for name, item in (("driven", document), ("meant", planned))
    )

    assert (driven.recorded, len(driven.points), len(driven.observed)) == (True, 9, 5)
    assert (driven.path_length_m, driven.collisions) == (1.5, 1)
    assert (meant.recorded, len(meant.points), meant.path_length_m) == (False, 3, None)
    planned["task_details"]["actions"] = ["move_distance"]
    assert len(ways(report([save("active.json", planned)]).episodes[0])[0].points) == 1


def test_both_scenes_of_a_change_have_their_map(report: Report, make_result: Make, save: Save) -> None:
    document: dict[str, Any] = make_result(3.0, variant=[1, 2], track=[TRACK, {**TRACK, "scene": "flat:2"}])
    document["task_details"] |= {"name": "scd:passive:ground_truth", "results_format": "object_map_with_states"}
    document["results"]["state_list"] = ["added", "removed", "unchanged"]
    for item in document["results"]["objects"]:
        item["state_probs"] = [0.0, 1.0, 0.0]

    shown = Page(render(report([save("a.json", document)]), "html"))

    assert len(shown.all("polyline", class_="path")) == 2
    assert "flat:1:2" in shown.text
    assert {shape.attributes.get("class") for shape in shown.all("rect")} >= {"truth found", "proposal found"}


def test_the_goal_of_an_episode_is_marked(report: Report, catalog: Catalog, make_result: Make, save: Save) -> None:
    listed = catalog.get("episodes", "point_goal:arena:1")
    chosen = {"list": listed.name, "sha256": episodes.digest(listed.data), "number": 0, "id": "x"}
    right = make_result(0.0, provenance=provenance(episode=chosen), track=[TRACK])
    other = make_result(0.0, provenance=provenance(episode={**chosen, "sha256": "0" * 64}), track=[TRACK])

    material = report([save("right.json", right)])

    goal = listed.data["episodes"][0]["goal"]
    assert goals_of(material.episodes[0]) == [tuple(goal["position"][:2])]
    assert "episode 0" in material.episodes[0].label
    assert Page(render(material, "html")).all("g", class_="goal")
    assert goals_of(report([save("other.json", other)]).episodes[0]) == []


def test_it_is_shown_where_a_failed_episode_went(report: Report, make_result: Make, save: Save) -> None:
    failed = make_result(provenance=provenance(0, ("collision", "It touched a table.")), track=[TRACK])
    del failed["results"]

    shown = Page(render(report([save("a.json", failed), save("b.json", make_result(0.0, variant=2))]), "html"))

    assert shown.all("polyline", class_="path")
    assert "not scored" in shown.text


def test_classes_are_tallied_by_what_became_of_their_objects() -> None:
    first, second = by_class([thing(0.0), thing(1.0), thing(2.0, verdict=FALSE_POSITIVE, name="cup")])

    assert (first.name, first.there, first.found, first.missed, first.not_there, first.quality) == (
        "cup",
        0,
        0,
        0,
        1,
        None,
    )
    assert (second.name, second.there, second.found, second.not_there, second.quality) == ("chair", 2, 2, 0, 0.5)
