"""The `lighting` mapping of an environment."""

from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_sim_taichi.daylight import Daylight
from benchbot_sim_taichi.lamps import Lamps
from benchbot_sim_taichi.lighting import Exterior, Lighting, Sky, Sun


def test_nothing_declared_is_a_clear_day() -> None:
    clear_day = Lighting(Sun(), Sky(), None, exterior=Exterior("field", 0))
    assert Lighting.from_mapping(None) == Lighting.from_mapping({}) == clear_day


def test_what_is_declared_is_taken_and_the_rest_stays() -> None:
    lighting = Lighting.from_mapping({"sun": {"azimuth_deg": 90, "irradiance": [1, 2, 3]}, "exposure": 2})
    assert lighting.sun == Sun(azimuth_deg=90.0, irradiance=(1.0, 2.0, 3.0))
    assert lighting.sky == Sky()
    assert lighting.exposure == 2.0


def test_azimuth_turns_counterclockwise_from_x_and_elevation_upwards() -> None:
    assert Sun(azimuth_deg=90.0, elevation_deg=0.0).direction == pytest.approx((0.0, 1.0, 0.0))
    assert Sun(azimuth_deg=10.0, elevation_deg=90.0).direction == pytest.approx((0.0, 0.0, 1.0))


def test_a_time_of_day_gives_sun_and_sky() -> None:
    lighting = Lighting.from_mapping({"time": "12:30", "date": "2023-06-21", "latitude_deg": 52, "turbidity": 4})
    assert lighting.sky == Daylight(time_h=12.5, day=172, latitude_deg=52.0, turbidity=4.0)
    assert lighting.sun.elevation_deg == pytest.approx(61.0, abs=0.5)
    assert min(lighting.sun.irradiance) > 4


def test_lamps_are_switched_and_tuned() -> None:
    assert Lighting.from_mapping({"lamps": {"on": "all"}}).lamps == Lamps()
    assert Lighting.from_mapping({"lamps": {"on": "none"}}).lamps == Lamps(on=())
    given = {"on": ["desk", "ceiling"], "temperature_k": 2700, "scale": 0.5}
    assert Lighting.from_mapping({"lamps": given}).lamps == Lamps(("desk", "ceiling"), 2700.0, 0.5)


def test_surroundings_are_of_a_kind_and_a_seed() -> None:
    given = {"time": "12:00", "exterior": {"kind": "town", "seed": 3}}
    assert Lighting.from_mapping(given).exterior == Exterior("town", 3)
    assert Lighting.from_mapping({"exterior": {"kind": "none"}}).exterior == Exterior("none", 0)


@pytest.mark.parametrize(
    ("mapping", "title"),
    [
        ({"time": 1290}, "lighting.time is not a time of day"),
        ({"time": "24:00"}, "lighting.time is not a time of day"),
        ({"time": "12:00", "date": "2023-02-30"}, "lighting.date is not a date"),
        ({"time": "12:00", "latitude_deg": 91}, "lighting.latitude_deg is out of range"),
        ({"time": "12:00", "turbidity": 1}, "lighting.turbidity is out of range"),
        ({"time": "12:00", "sun": {}}, "lighting.sun contradicts lighting.time"),
        ({"latitude_deg": 50}, "lighting.latitude_deg says nothing without lighting.time"),
        ({"lamps": {"on": "some"}}, "lighting.lamps.on is neither all nor none"),
        ({"lamps": {"on": [1]}}, "lighting.lamps.on is neither all nor none"),
        ({"lamps": {"temperature_k": 100}}, "lighting.lamps.temperature_k is out of range"),
        ({"lamps": {"scale": -1}}, "lighting.lamps.scale is negative"),
        ({"lamps": {"off": []}}, "lighting.lamps has an unknown key 'off'"),
        ([], "lighting is not a mapping"),
        ({"sunn": {}}, "unknown key 'sunn'"),
        ({"sun": 3}, "lighting.sun is not a mapping"),
        ({"sun": {"azimuth_deg": "south"}}, "lighting.sun.azimuth_deg is not a number"),
        ({"sun": {"elevation_deg": True}}, "lighting.sun.elevation_deg is not a number"),
        ({"sun": {"irradiance": [1, 2]}}, "lighting.sun.irradiance is not a colour"),
        ({"sky": {"zenith": [1, 2, -1]}}, "lighting.sky.zenith is negative"),
        ({"sky": {"zenith": [1, 2, float("nan")]}}, r"lighting.sky.zenith\[2\] is not a number"),
        ({"exterior": {"kind": "forest"}}, "lighting.exterior.kind is not known"),
        ({"exterior": {"kind": ["town"]}}, "lighting.exterior.kind is not known"),
        ({"exterior": {"seed": -1}}, "lighting.exterior.seed is no seed"),
        ({"exterior": {"seed": 1.5}}, "lighting.exterior.seed is no seed"),
        ({"exterior": "town"}, "lighting.exterior is not a mapping"),
        ({"exposure": 0}, "lighting.exposure is not positive"),
    ],
)
def test_mistakes_are_named(mapping: Any, title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        Lighting.from_mapping(mapping)


def test_a_typo_gets_a_suggestion() -> None:
    with pytest.raises(BenchbotError) as caught:
        Lighting.from_mapping({"exposur": 1.0})
    assert "exposure" in caught.value.fix
