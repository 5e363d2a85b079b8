"""A lidar's ranges as points and as a cloud, and its elevations as a robot declares them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot.core.channels import LidarScan
from benchbot.core.lidar import FIELDS, OFFSETS, POINT, cloud, elevations_deg, points_m

ANGLES = st.floats(-1.5, 1.5)
LIDARS = st.tuples(st.integers(1, 4), st.integers(1, 6)).flatmap(
    lambda shape: st.fixed_dictionaries(
        {
            "frame_id": st.just("lidar"),
            "ranges_m": arrays.arrays(np.float32, shape),
            "elevations_rad": arrays.arrays(np.float64, shape[0], elements=ANGLES),
            "azimuths_rad": arrays.arrays(np.float64, shape[1], elements=ANGLES),
        }
    )
)


def test_points_lie_ahead_to_the_left_and_above() -> None:
    lidar: LidarScan = {
        "frame_id": "lidar",
        "ranges_m": np.array([[2.0, 3.0], [4.0, np.inf]], np.float32),
        "elevations_rad": np.array([0.0, math.pi / 2]),
        "azimuths_rad": np.array([0.0, math.pi / 2]),
    }
    expected = np.array([[[2, 0, 0], [0, 3, 0]], [[0, 0, 4], [np.nan] * 3]])
    np.testing.assert_allclose(points_m(lidar), expected, atol=1e-12)


@given(LIDARS)
def test_a_cloud_says_which_way_every_beam_went_and_why_it_met_nothing(lidar: LidarScan) -> None:
    records = cloud(lidar)
    np.testing.assert_array_equal(records["distance"], lidar["ranges_m"])
    np.testing.assert_array_equal(records["elevation"][:, 0], lidar["elevations_rad"].astype(np.float32))
    np.testing.assert_array_equal(records["azimuth"][0], lidar["azimuths_rad"].astype(np.float32))
    np.testing.assert_array_equal(np.isnan(records["x"]), ~np.isfinite(lidar["ranges_m"]))


def test_a_point_is_laid_out_as_told() -> None:
    assert POINT.names == FIELDS
    assert {name: POINT.fields[name][1] for name in FIELDS} == OFFSETS  # type: ignore[index]


def test_ranges_of_another_shape_than_the_angles_are_no_cloud() -> None:
    ranges_m = np.zeros((2, 3), np.float32)
    with pytest.raises(ValueError, match=r"\(2, 3\)"):
        cloud(LidarScan(frame_id="", ranges_m=ranges_m, elevations_rad=np.zeros(3), azimuths_rad=np.zeros(2)))


def test_elevations_are_listed_or_evenly_spaced() -> None:
    assert elevations_deg([-7, 0, 3.5]) == (-7.0, 0.0, 3.5)
    assert elevations_deg({"count": 16, "from_deg": -15, "to_deg": 15}) == tuple(range(-15, 16, 2))


@pytest.mark.parametrize("values", [{"count": 16}, {"count": 2, "from_deg": 0, "to_deg": 1, "step_deg": 1}, 3, ["up"]])
def test_other_elevations_are_refused(values: Any) -> None:
    with pytest.raises((KeyError, TypeError, ValueError)):
        elevations_deg(values)
