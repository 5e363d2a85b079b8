"""What names say."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_scenes.importing import names
from benchbot_scenes.importing.vocabulary import CLASSES, NO_CLASS, SYNONYMS, TYPICAL_SIZE_M


@pytest.mark.parametrize(
    ("name", "class_name"),
    [
        ("Chair.003", "chair"),
        ("SM_couch_01", "couch"),
        ("DiningChairs", "chair"),
        ("Armchair_LOD0", "chair"),
        ("office-desk-2", "table"),
        ("wine_glass.001", "wine glass"),
        ("WineGlasses", "wine glass"),
        ("Mesh1 Chair1 Model", "chair"),
        ("Chair_wood_01", "chair"),
        ("PottedPlant_A", "potted plant"),
        ("SamsungTV", "tv"),
        ("kitchen_knives", "knife"),
        ("Keyboard", "keyboard"),
        ("iPhone", "cell phone"),
        ("fridge freezer", "refrigerator"),
        ("LampTable", "table"),
    ],
)
def test_a_name_says_its_class(name: str, class_name: str) -> None:
    found = names.meaning(name)
    assert found is not None
    assert found.class_name == class_name


@pytest.mark.parametrize(
    "name",
    ["tv stand", "TVStand_2", "BookShelf", "TableLamp", "bedroom", "MousePad", "glass", "toilet_paper", "chair_leg"],
)
def test_what_only_sounds_like_a_class_is_none(name: str) -> None:
    found = names.meaning(name)
    assert found is not None
    assert found.class_name is None


@pytest.mark.parametrize("name", ["", "pCube12", "Object_7", "geometry_0", "テーブル", "...", "lampe"])
def test_a_name_may_say_nothing(name: str) -> None:
    assert names.meaning(name) is None


@pytest.mark.parametrize(
    ("name", "is_plural"), [("books", True), ("Book", False), ("knives", True), ("BookStack", True)]
)
def test_several_in_one_are_told(name: str, is_plural: bool) -> None:
    found = names.meaning(name)
    assert found is not None
    assert (found.class_name in {"book", "knife"}, found.is_plural) == (True, is_plural)


@pytest.mark.parametrize(
    ("name", "is_collider"),
    [
        ("UCX_Floor_01", True),
        ("wall_collision", True),
        ("Room-colonly", True),
        ("Collider", True),
        ("Chair_LOD1", True),
        ("Chair_LOD0", False),
        ("column", False),
        ("Color_wheel", False),
        ("table", False),
    ],
)
def test_colliders_are_known_by_their_names(name: str, is_collider: bool) -> None:
    assert names.is_collider(name) is is_collider


def test_the_vocabulary_does_not_contradict_itself() -> None:
    synonyms = [word for words in SYNONYMS.values() for word in words]
    assert set(SYNONYMS) == set(CLASSES)
    assert len(set(synonyms)) == len(synonyms)
    assert not set(CLASSES) & set(synonyms)
    assert not NO_CLASS & {*CLASSES, *synonyms}
    assert set(CLASSES) <= set(TYPICAL_SIZE_M)


@given(
    st.sampled_from(sorted(CLASSES)),
    st.sampled_from(["SM_{}_01", "{}.003", "prop {} A", "{}s", "Mesh_{}"]),
    st.booleans(),
)
def test_every_class_is_known_by_its_own_name(class_name: str, pattern: str, in_camel_case: bool) -> None:
    name = class_name.title().replace(" ", "") if in_camel_case else class_name.replace(" ", "_")
    if pattern == "{}s" and class_name in {"knife", "tv", "toilet", "couch", "wine glass"}:
        return
    found = names.meaning(pattern.format(name if class_name != "tv" else "TV"))
    assert found is not None
    assert found.class_name == class_name


@given(st.text(max_size=40))
def test_any_text_is_a_name(name: str) -> None:
    names.meaning(name)
    names.is_collider(name)
