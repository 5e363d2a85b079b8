"""The `lighting` mapping of an environment."""

from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun


def test_nothing_declared_is_a_clear_day() -> None:
    assert Lighting.from_mapping(None) == Lighting.from_mapping({}) == Lighting(Sun(), Sky(), None)


def test_what_is_declared_is_taken_and_the_rest_stays() -> None:
    lighting = Lighting.from_mapping({"sun": {"azimuth_deg": 90, "irradiance": [1, 2, 3]}, "exposure": 2})
    assert lighting.sun == Sun(azimuth_deg=90.0, irradiance=(1.0, 2.0, 3.0))
    assert lighting.sky == Sky()
    assert lighting.exposure == 2.0


def test_azimuth_turns_counterclockwise_from_x_and_elevation_upwards() -> None:
    assert Sun(azimuth_deg=90.0, elevation_deg=0.0).direction == pytest.approx((0.0, 1.0, 0.0))
    assert Sun(azimuth_deg=10.0, elevation_deg=90.0).direction == pytest.approx((0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("mapping", "title"),
    [
        ([], "lighting is not a mapping"),
        ({"sunn": {}}, "unknown key 'sunn'"),
        ({"sun": 3}, "lighting.sun is not a mapping"),
        ({"sun": {"azimuth_deg": "south"}}, "lighting.sun.azimuth_deg is not a number"),
        ({"sun": {"elevation_deg": True}}, "lighting.sun.elevation_deg is not a number"),
        ({"sun": {"irradiance": [1, 2]}}, "lighting.sun.irradiance is not a colour"),
        ({"sky": {"zenith": [1, 2, -1]}}, "lighting.sky.zenith is negative"),
        ({"sky": {"zenith": [1, 2, float("nan")]}}, r"lighting.sky.zenith\[2\] is not a number"),
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
