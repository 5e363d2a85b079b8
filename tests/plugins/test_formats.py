"""The formats in the box, called as solutions call them: through their declarations."""

import json
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.mapping import create_object

FORMATS = ("object_map", "object_map_with_states", "object_map_ground_truth")


def call(name: str, function: str, *args: Any, **kwargs: Any) -> Any:
    return formats.call(Catalog(load()).get("formats", name), function, list(args), kwargs)


def a_map(name: str = "object_map", **keys: Any) -> dict[str, Any]:
    """A valid map of one object, with `keys` of that object replaced."""
    instance: dict[str, Any] = call(name, "create", ["chair", "background"])
    instance["objects"] = [call(name, "create_object", 2) | {"label_probs": [0.9, 0.1]} | keys]
    return instance


@pytest.mark.parametrize("name", FORMATS)
def test_what_create_makes_is_valid(name: str) -> None:
    instance = call(name, "create")
    if name == "object_map_ground_truth":
        instance["class_list"] = ["chair"]
        item = call(name, "create_object") | {"class": "chair"}
    else:
        item = call(name, "create_object")
    call(name, "validate", instance | {"objects": [item]})


def test_the_default_classes_are_the_thirty_of_bear_and_the_background() -> None:
    classes = call("object_map", "create")["class_list"]

    assert len(classes) == len(set(classes)) == 31
    assert (classes[0], classes[-1]) == ("bottle", "background")
    assert len(call("object_map", "create_object")["label_probs"]) == 31


def test_sizes_may_be_chosen() -> None:
    assert call("object_map", "create", class_list=["a", "b"])["class_list"] == ["a", "b"]
    assert call("object_map", "create_object", num_classes=2)["label_probs"] == [0, 0]
    assert call("object_map_with_states", "create_object", num_classes=2, num_states=3)["state_probs"] == [0, 0, 0]


CLASSES = ["chair", "table", "background"]
MEANT: dict[str, Any] = {"label_probs": {"chair": 0.9, "background": 0.1}, "centroid": (1, 2, 0.5), "extent": (1, 1, 1)}


@pytest.mark.parametrize("kwargs", [{}, {"num_classes": 2}, {"num_classes": 0}])
def test_the_local_create_object_makes_what_the_format_makes(kwargs: dict[str, Any]) -> None:
    assert json.dumps(create_object(**kwargs)) == json.dumps(call("object_map", "create_object", **kwargs))


@pytest.mark.parametrize("listed", [list, tuple, np.float32])
def test_an_object_is_filled_in_from_numbers_of_any_kind(listed: Callable[[Any], Any]) -> None:
    by_name = create_object(class_list=CLASSES, **MEANT)
    by_class = create_object(
        class_list=CLASSES,
        label_probs=listed([0.9, 0, 0.1]),
        centroid=listed(MEANT["centroid"]),
        extent=listed(MEANT["extent"]),
    )

    assert by_name == {"label_probs": [0.9, 0.0, 0.1], "centroid": [1, 2, 0.5], "extent": [1, 1, 1]}
    assert by_class["label_probs"] == pytest.approx(by_name["label_probs"])
    call("object_map", "validate", {"objects": [by_name, json.loads(json.dumps(by_class))], "class_list": CLASSES})


@pytest.mark.parametrize(
    ("keys", "why", "fix"),
    [
        ({"label_probs": {"chiar": 1.0}}, "the class 'chiar' is not in class_list. Did you mean 'chair'?", "Name one"),
        ({"label_probs": {"sofa": 1.0}}, "It has: chair, table, background.", "count it as 'background'"),
        ({"label_probs": {"chair": 0.4}}, "sum to 0.4, not to 1", "Give the rest to 'background'"),
        ({"label_probs": [0.9, 0.9, 0]}, "sum to 1.8, not to 1", "Divide them by their sum."),
        ({"label_probs": [1.0, 0.0]}, "2 numbers, class_list has 3", "Give each class of class_list a probability"),
        ({"label_probs": {"chair": float("nan")}}, "not NaN", "from 0 to 1"),
        ({"label_probs": "chair"}, "must be a list, not text", "or name some"),
        ({"centroid": [0, float("nan"), 0]}, "object.centroid[1]", "Leave out pixels without depth"),
        ({"centroid": np.array([0, 0, np.inf])}, "object.centroid[2]", "Leave out pixels without depth"),
        ({"extent": [1, -1, 1]}, "object.extent[1]", "the full length along an axis, upper - lower: never negative"),
        ({"extent": [1, 1]}, "object.extent: 2 numbers, must be 3", "extent = upper - lower"),
        ({"extent": 2.0}, "object.extent: must be a list, not a number", "x, y, z in metres"),
        ({"extent": None}, "extent: is missing", "Give all three"),
    ],
)
def test_an_object_that_cannot_be_meant_is_told_where_it_is_made(keys: dict[str, Any], why: str, fix: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        create_object(class_list=CLASSES, **{**MEANT, **keys})

    assert why in caught.value.why
    assert fix in caught.value.fix


def test_maps_made_one_after_another_share_nothing() -> None:
    first = call("object_map", "create")
    first["class_list"].clear()

    assert len(call("object_map", "create")["class_list"]) == 31


def test_states_are_added_removed_and_unchanged() -> None:
    assert call("object_map_with_states", "create")["state_list"] == ["added", "removed", "unchanged"]


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"label_probs": [0.5] * 3}, "results.objects[0].label_probs: 3 numbers, class_list has 2"),
        ({"label_probs": [True, 0]}, "results.objects[0].label_probs[0]: must be a number, not true or false"),
        ({"label_probs": [float("nan"), 0]}, "label_probs[0]: must be from 0 to 1e+09, not NaN"),
        ({"label_probs": [-0.1, 0]}, "label_probs[0]: must be from 0 to 1e+09, not below 0"),
        ({"label_probs": "10"}, "label_probs: must be a list, not text"),
        ({"label_probs": None}, "label_probs: is missing"),
        ({"extent": [1, -1, 1]}, "results.objects[0].extent[1]: must be from 0 to 1e+06, not below 0"),
        ({"extent": [1, 1]}, "extent: 2 numbers, must be 3"),
        ({"centroid": [0, 0, float("inf")]}, "centroid[2]: must be from -1e+06 to 1e+06, not above 1e+06"),
        ({"centroid": [0, 0, 10**400]}, "centroid[2]: must be from -1e+06 to 1e+06, not above 1e+06"),
        ({"centroid": ["0", 0, 0]}, "centroid[0]: must be a number, not text"),
    ],
)
@pytest.mark.parametrize("name", ["object_map", "object_map_with_states"])
def test_a_broken_object_is_told_by_its_place(name: str, keys: dict[str, Any], text: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        call(name, "validate", a_map(name, **keys))

    assert text in caught.value.why


@pytest.mark.parametrize(
    ("instance", "text"),
    [
        (None, "results: must be a mapping, not nothing"),
        ([], "results: must be a mapping, not a list"),
        ({"class_list": ["a"]}, "results.objects: is missing"),
        ({"objects": [], "class_list": []}, "results.class_list: must name at least one"),
        ({"objects": [], "class_list": ["a", 1]}, "results.class_list[1]: must be a non-empty string"),
        ({"objects": [], "class_list": ["a", "a"]}, "results.class_list[1]: 'a' is named twice"),
        ({"objects": {}, "class_list": ["a"]}, "results.objects: must be a list, not a mapping"),
        ({"objects": [7], "class_list": ["a"]}, "results.objects[0]: must be a mapping, not a number"),
    ],
)
def test_a_broken_map_is_told_by_its_place(instance: Any, text: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        call("object_map", "validate", instance)

    assert text in caught.value.why


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"state_probs": [1.0]}, "results.objects[0].state_probs: 1 numbers, state_list has 3"),
        ({"state_probs": None}, "results.objects[0].state_probs: is missing"),
    ],
)
def test_states_are_checked_too(keys: dict[str, Any], text: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        call("object_map_with_states", "validate", a_map("object_map_with_states", **keys))

    assert text in caught.value.why


def test_states_in_another_order_are_refused() -> None:
    instance = a_map("object_map_with_states") | {"state_list": ["removed", "added", "unchanged"]}

    with pytest.raises(BenchbotError) as caught:
        call("object_map_with_states", "validate", instance)

    assert "results.state_list: must be ['added', 'removed', 'unchanged']" in caught.value.why


def test_every_problem_is_told_up_to_ten() -> None:
    instance = a_map()
    instance["objects"] = [{"label_probs": [], "centroid": [], "extent": []}] * 4

    with pytest.raises(BenchbotError) as caught:
        call("object_map", "validate", instance)

    assert len(caught.value.why.splitlines()) == 11


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"class": ""}, "ground_truth.objects[0].class"),
        ({"isgroup": "no"}, "ground_truth.objects[0].isgroup: must be true or false, not text"),
        ({"extent": [0, 0, -1]}, "ground_truth.objects[0].extent[2]"),
    ],
)
def test_a_broken_ground_truth_is_told_by_its_place(keys: dict[str, Any], text: str) -> None:
    item = call("object_map_ground_truth", "create_object") | {"class": "chair"} | keys

    with pytest.raises(BenchbotError) as caught:
        call("object_map_ground_truth", "validate", {"objects": [item]})

    assert text in caught.value.why


anything: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["objects", "class_list", "state_list", "synonyms", "class", "label_probs", "centroid", "extent"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=20,
)


@pytest.mark.parametrize("name", FORMATS)
@settings(deadline=None)
@given(instance=anything)
def test_no_document_whatever_raises_anything_but_the_one_error(name: str, instance: Any) -> None:
    with suppress(BenchbotError):
        call(name, "validate", instance)
