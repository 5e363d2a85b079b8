"""Coverage of floors whose visible part is known in closed form."""

import math

import numpy as np
import pytest

from benchbot_eval_exploration.coverage import Coverage, covered
from benchbot_task_navigation.floor_plan import Floats, FloorPlan
from plugins.task_navigation.tests.floors import floor


def cover(plan: FloorPlan, *way: tuple[float, float]) -> Coverage:
    """Return what is covered by looking around at each of these places."""
    quarters_rad = [quarter * math.pi / 2 for quarter in range(4)]
    found = covered(plan, np.array([(*place, heading_rad) for place in way for heading_rad in quarters_rad]))
    assert found is not None
    return found


def test_all_of_an_empty_room_is_seen_from_its_middle() -> None:
    found = cover(floor(4.0), (0, 0))

    assert found.seen_share == 1.0
    # The centre of a body of 0.3 m gets as near to the walls as that.
    assert found.seen_m2 == pytest.approx(3.4**2, rel=0.02)
    assert found.visited_share == pytest.approx(math.pi * 0.3**2 / 3.4**2, rel=0.05)


def test_what_is_further_than_3_m_is_not_seen() -> None:
    found = cover(floor(10.0, resolution_m=0.05), (0, 0))

    assert found.seen_m2 == pytest.approx(math.pi * 3**2, rel=0.02)


@pytest.mark.parametrize("heading_rad", [0.0, math.pi / 2, -3.0])
def test_a_robot_sees_ahead(heading_rad: float) -> None:
    found = covered(floor(10.0, resolution_m=0.05), np.array([[0.0, 0.0, heading_rad]]))
    assert found is not None

    places = np.argwhere(found.seen) * 0.05 - 5.0
    aside_rad = np.angle(np.exp(1j * (np.arctan2(places[:, 1], places[:, 0]) - heading_rad)))
    assert np.abs(aside_rad[np.linalg.norm(places, axis=1) > 0.5]).max() == pytest.approx(math.pi / 4, abs=0.06)
    # A ray marks the node next to it: all around, the area is too large by up to half a node.
    assert found.seen_m2 == pytest.approx(math.pi * 3**2 / 4, rel=0.05)


def test_a_wall_hides_what_is_behind_it() -> None:
    """A thin wall, off the grid, with a way around one end: what it hides is bounded by the ray past that end."""
    divided = floor(4.0, walls=[(0.01, -2.0, 0.01, 1.0)])
    found = cover(divided, (-1.0, -1.0))

    x, y = np.meshgrid(*[np.arange(161) * 0.025 - 2.0] * 2, indexing="ij")
    beyond = found.seen & (x > 0.05)
    assert beyond.any()
    assert (y > -1.0 + (x + 1.0) * (2.0 / 1.01))[beyond].all()
    assert found.seen[(x < -0.3) & found.floor].all()

    around = cover(divided, (-1.0, -1.0), (-1.0, 1.5), (1.0, 1.5), (1.0, -1.0))
    assert around.seen_share == 1.0


def test_a_room_next_door_does_not_count() -> None:
    found = cover(floor(4.0, walls=[(0.0, -2.0, 0.0, 2.0)]), (-1.0, 0.0))

    assert found.seen_share == 1.0
    assert found.seen_m2 == pytest.approx(1.4 * 3.4, rel=0.03)


def test_it_counts_how_soon_the_floor_is_seen() -> None:
    """Half of the floor for the first 4 of 10 metres, then all of it."""
    looks: Floats = np.array([[0.0, 0.5], [4.0, 1.0], [12.0, 1.0]])
    found = Coverage(np.ones((1, 1), bool), np.ones((1, 1), bool), np.ones((1, 1), bool), 1.0, looks)

    assert found.seen_share_over(10.0) == pytest.approx(0.8)
    assert found.seen_share_over(4.0) == pytest.approx(0.5)


def test_more_of_a_way_never_shows_less() -> None:
    plan = floor(4.0, posts=[(0.5, 0.5, 0.3)], walls=[(-1.0, -2.0, -1.0, 0.0)], resolution_m=0.05)
    way = [(-1.5, -1.5), (-1.5, 0.5), (0.0, 1.0), (1.2, 0.0)]
    shares = [(found.seen_share, found.visited_share) for found in (cover(plan, *way[:count]) for count in range(1, 5))]

    assert shares == sorted(shares)
    assert shares[0][0] < shares[-1][0] <= 1.0


def test_a_plan_without_room_has_no_floor() -> None:
    assert covered(FloorPlan((0.0, 0.0), 0.1, np.zeros((5, 5))), np.zeros((1, 3))) is None
