from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import overrides
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError

SUNNY = {
    "sun": {"azimuth_deg": 200, "elevation_deg": 30, "irradiance": [9, 8, 7]},
    "sky": {"zenith": [1, 1, 2], "horizon": [2, 2, 2], "ground": [0.4, 0.4, 0.4]},
    "exposure": 1.5,
}
EVENING = {"time": "18:50", "date": "2023-04-10", "latitude_deg": 52, "lamps": {"temperature_k": 2700}}


def room(**data: Any) -> Declaration:
    base = {"name": "room", "variant": 1, "type": "sim", "start_pose": [1, 0, 0, 0, 0, 0, 0]}
    return Declaration("environments", "room:1", Path("room.yaml"), "acme-world", {**base, **data})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("21:30", "21:30"),
        ("2023-06-21", "2023-06-21"),
        ("none", "none"),
        ("on", "on"),
        ("0.5", 0.5),
        ("1e-3", 0.001),
        (".5", 0.5),
        ("1.0e+3", 1000.0),
        ("-3", -3),
        ("010", "010"),
        ("true", True),
        ("null", None),
        ("[lamp_1, lamp_2]", ["lamp_1", "lamp_2"]),
        ('["lamp 1"]', ["lamp 1"]),
        ('"0.5"', "0.5"),
        ("{azimuth_deg: 3}", {"azimuth_deg": 3}),
        ("a=b", "a=b"),
    ],
)
def test_values_are_read_as_people_mean_them(text: str, value: Any) -> None:
    assert overrides.parse([f"lighting.x={text}"]) == {"lighting.x": value}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("8", "08:00"),
        ("8:05", "08:05"),
        ("21.5", "21:30"),
        ("0", "00:00"),
        ("23.99", "23:59"),
        ("24", 24),
        ("23.999", 23.999),
        ("-1", -1),
        ("true", True),
        ("noon", "noon"),
    ],
)
def test_a_time_of_day_may_be_given_in_hours(text: str, value: Any) -> None:
    assert overrides.parse([f"lighting.time={text}"]) == {"lighting.time": value}


@pytest.mark.parametrize(
    ("texts", "title"),
    [
        (["lighting.time"], "--set lighting.time sets nothing."),
        (["=3"], "--set =3 sets nothing."),
        (["lighting.exposure=1", "lighting.exposure=2"], "--set lighting.exposure is given twice."),
        (["lighting.lamps.on=[a"], "The value of --set lighting.lamps.on cannot be read."),
        (["options.x=" + "[" * 5000], "The value of --set options.x cannot be read."),
        (["options.x=" + "9" * 5000], "The value of --set options.x cannot be read."),
    ],
)
def test_what_cannot_be_read_is_refused(texts: list[str], title: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        overrides.parse(texts)
    assert caught.value.title == title


def test_settings_go_into_the_declaration_which_stays_as_it_was() -> None:
    scene = room(lighting=EVENING, options={"device": "cpu"})

    changed = overrides.applied(
        scene, {"lighting.lamps.scale": 0.5, "lighting.date": "2023-12-24", "options.quality": "path", "assets": "own"}
    )

    assert changed.data["lighting"] == {
        **EVENING,
        "date": "2023-12-24",
        "lamps": {"temperature_k": 2700, "scale": 0.5},
    }
    assert changed.data["options"] == {"device": "cpu", "quality": "path"}
    assert changed.data["assets"] == "own"
    assert scene.data["lighting"] == EVENING
    assert overrides.applied(scene, {}) is scene


def test_a_time_of_day_takes_the_place_of_sun_and_sky_and_leaves_the_rest() -> None:
    changed = overrides.applied(room(lighting=SUNNY), {"lighting.time": "21:30"})

    assert changed.data["lighting"] == {"exposure": 1.5, "time": "21:30"}


def test_a_sun_takes_the_place_of_a_time_of_day() -> None:
    changed = overrides.applied(room(lighting=EVENING), {"lighting.sun": SUNNY["sun"]})

    assert changed.data["lighting"] == {"lamps": {"temperature_k": 2700}, "sun": SUNNY["sun"]}


def test_an_environment_that_declares_no_light_gets_what_is_set() -> None:
    assert overrides.applied(room(), {"lighting.lamps.on": "none"}).data["lighting"] == {"lamps": {"on": "none"}}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"lighting.time": "25:00"}, "lighting.time: '25:00' does not match"),
        ({"lighting.time": 1290}, 'such as "21:30"'),
        ({"lighting.tme": "21:30"}, "unknown key 'tme'. Did you mean 'time'?"),
        ({"lighting.lamps.on": "floor_lamp"}, "all, none, or a list of the names"),
        ({"lighting.lamps.scale": -1}, "lighting.lamps.scale: -1 is less than the minimum of 0"),
        ({"lighting.date": "2023-06-21"}, "'time' is a dependency of 'date'"),
        ({"lighting": 3}, "lighting: 3 is not of type 'object'"),
        ({"assets": ["a"]}, "assets: ['a'] is not of type 'string'"),
        ({"lighting.exposure": None}, "lighting.exposure: None is not of type 'number'"),
    ],
)
def test_what_the_schema_forbids_is_named_with_what_is_allowed(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        overrides.applied(room(), settings)
    assert caught.value.title == "These settings do not fit the environment 'room:1'."
    assert message in caught.value.why


@pytest.mark.parametrize("key", [*overrides.FIXED_KEYS, "start_pose.0", "name.x"])
def test_what_makes_results_comparable_cannot_be_set(key: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        overrides.applied(room(), {key: 1})
    assert caught.value.title == f"A run cannot set '{key.partition('.')[0]}'."


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"lightning.time": "21:30"}, "Did you mean 'lighting'?"),
        ({"lighting..time": "21:30"}, "'lighting..time' is not a setting."),
        ({"lighting.lamps": {}, "lighting.lamps.on": "all"}, "'lighting.lamps' and 'lighting.lamps.on' overlap"),
        ({"lighting.time": "21:30", "lighting.sun.azimuth_deg": 3}, "lighting.sun is given, and lighting.time says"),
        ({"assets.name": "own"}, "'assets' is 'own', which has no parts."),
    ],
)
def test_keys_that_make_no_sense_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        overrides.applied(room(assets="own"), settings)
    assert message in str(caught.value)


def test_settings_are_shown_as_they_are_written() -> None:
    settings = {"lighting.time": "21:30", "assets": "own", "lighting.lamps.on": ["a"], "options.x": 2.0}

    assert overrides.label(settings) == 'assets=own, lighting.lamps.on=["a"], lighting.time=21:30, options.x=2.0'
    assert overrides.label({}) == ""


@given(
    st.dictionaries(
        st.sampled_from(["options.a", "options.b.c", "options.b.d", "lighting.lamps.scale"]), st.floats(0, 10)
    )
)
def test_the_order_of_settings_does_not_matter(settings: dict[str, float]) -> None:
    there = overrides.applied(room(), settings).data
    back = overrides.applied(room(), dict(reversed(settings.items()))).data

    assert there == back
