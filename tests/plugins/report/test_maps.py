from collections.abc import Sequence
from typing import Any

import pytest

from benchbot.core import episodes
from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.drawing.map_layout import MOST_LABELS
from benchbot.plugins.drawing.map_model import FALSE_POSITIVE, MATCH, Box, MapObject, MapPath, SceneMap
from benchbot.plugins.report import page
from benchbot.plugins.report.camera_pictures import Budget
from benchbot.plugins.report.rendering import render
from benchbot.plugins.report.summary import by_class
from tests.made_results import Make, Save
from tests.plugins.report.conftest import START, TRACK, Report, provenance
from tests.plugins.report.pages import Page

NOWHERE = MapPath()


def thing(x: float, y: float = 0.0, verdict: str | None = MATCH, name: str = "chair") -> MapObject:
    box = Box((x, y, 0.5), (1.0, 0.5, 1.0))
    there = None if verdict == FALSE_POSITIVE else box
    return MapObject(name, name, box, there, 0, verdict, 0.5, "Because.")


def draw(objects: Sequence[MapObject], path: MapPath = NOWHERE) -> page.Drawing | None:
    return page.draw(SceneMap(objects=tuple(objects), path=path), [], Budget())


def test_a_map_has_one_scale_x_to_the_right_and_y_up() -> None:
    drawing = draw([thing(0.0), thing(4.0), thing(0.0, 2.0)])

    assert drawing is not None
    first, east, north = [shape.box for shape in drawing.layout.shapes if shape.role == "truth"]
    assert east.left > first.left
    assert north.top < first.top
    assert (east.left - first.left) / 4 == pytest.approx((first.top - north.top) / 2, rel=0.01)
    assert first.width == pytest.approx(2 * first.height, rel=0.01)
    (zero, _), (one, _) = (column for column in drawing.layout.columns if column[1] in (0, 1))
    assert one - zero == pytest.approx((east.left - first.left) / 4, rel=0.01)


def test_nothing_to_show_is_no_map() -> None:
    assert draw([]) is None
    assert draw([MapObject("a", "a", None, None, 0, MATCH, 0.5, "Because.")]) is None


def test_a_single_place_is_a_map() -> None:
    drawing = draw([], MapPath(((1.0, 2.0),), (), recorded=True))

    assert drawing is not None
    assert len(drawing.layout.path) == 1


def test_what_lies_far_outside_is_counted_and_does_not_shrink_the_rest() -> None:
    alone, crowded = draw([thing(0.0)]), draw([thing(0.0), thing(1e5, verdict=FALSE_POSITIVE)])

    assert alone is not None
    assert crowded is not None
    assert crowded.layout.shapes == alone.layout.shapes
    assert (alone.outside, crowded.outside) == (0, 1)


def test_of_very_many_objects_the_failures_are_named() -> None:
    found = [thing(0.02 * i, 0.01 * i) for i in range(MOST_LABELS)]
    wrong = [thing(1.5 * i, 3.0, FALSE_POSITIVE, f"cup {i}") for i in range(5)]

    drawing = draw([*found, *wrong])

    assert drawing is not None
    assert sum(label.kind == "extra" for label in drawing.layout.labels) == 5
    # There is no room for all others.
    assert 5 < len(drawing.layout.labels) < MOST_LABELS


def test_the_way_is_the_track_and_otherwise_what_was_planned(report: Report, make_result: Make, save: Save) -> None:
    document = make_result(0.0, provenance=provenance(), track=[TRACK])
    planned = make_result(0.0, provenance=provenance())
    planned["environment_details"][0] |= {"start_pose": START, "trajectory_poses": [START, START]}
    driven, meant = (
        report([save(f"{name}.json", item)]).episodes[0].paths[0]
        for name, item in (("driven", document), ("meant", planned))
    )

    assert (driven.recorded, len(driven.points), len(driven.observed)) == (True, 9, 5)
    assert (driven.path_length_m, driven.collisions) == (1.5, 1)
    assert (meant.recorded, len(meant.points), meant.path_length_m) == (False, 3, None)
    planned["task_details"]["actions"] = ["move_distance"]
    assert len(report([save("active.json", planned)]).episodes[0].paths[0].points) == 1


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

    data = report([save("right.json", right)])

    goal = listed.data["episodes"][0]["goal"]
    assert data.episodes[0].goals == (tuple(goal["position"][:2]),)
    assert "episode 0" in data.episodes[0].label
    assert Page(render(data, "html")).all("g", class_="goal")
    assert report([save("other.json", other)]).episodes[0].goals == ()


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
