import math
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core import plugin_manager
from benchbot.core.channels import LaserScan
from benchbot.core.geometry import Pose
from benchbot.gymnasium import Coverage, MapQuality, Move, Transition

Make = Callable[..., gymnasium.Env[Any, Any]]


def transition(ranges_m: list[float], *, step: int = 1, scene_number: int = 0, base: Pose | None = None) -> Transition:
    angles_rad = np.linspace(-np.pi, np.pi, len(ranges_m), endpoint=False)
    laser: LaserScan = {"scans": np.stack([np.array(ranges_m), angles_rad], 1), "range_min": 0.1, "range_max": 20.0}
    return Transition(
        step=step,
        scene_number=scene_number,
        command=None,
        outcome=None,
        collided=False,
        base=base or Pose(),
        observations={},
        observe=lambda channels: {"laser": laser},
        robot={},
    )


def test_a_disc_of_free_floor_has_its_area() -> None:
    coverage = Coverage(cell_m=0.05, range_m=4.0)
    assert coverage(transition([2.0] * 900, step=0)) == pytest.approx(math.pi * 2.0**2, rel=0.05)


def test_floor_counts_once_per_episode_and_scene() -> None:
    coverage = Coverage()
    first = coverage(transition([2.0] * 900, step=0))
    assert coverage(transition([2.0] * 900)) == 0.0
    assert coverage(transition([2.0] * 900, scene_number=1)) == first
    assert coverage(transition([2.0] * 900, step=0)) == first


@pytest.mark.parametrize("nothing", [math.nan, -math.inf, 0.0])
def test_beams_that_measured_nothing_sweep_nothing(nothing: float) -> None:
    assert Coverage()(transition([nothing] * 90)) == 0.0


def test_beams_that_hit_nothing_count_up_to_the_range() -> None:
    assert Coverage(range_m=3.0)(transition([math.inf] * 900)) == pytest.approx(math.pi * 3.0**2, rel=0.1)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=5))
def test_coverage_is_never_negative_and_the_order_of_places_does_not_matter(
    places: list[tuple[float, float, float]],
) -> None:
    def total(order: list[tuple[float, float, float]]) -> float:
        coverage = Coverage(cell_m=0.2)
        gains = [coverage(transition([1.5] * 60, base=Pose.planar(*place))) for place in order]
        assert min(gains) >= 0.0
        return sum(gains)

    assert total(places) == pytest.approx(total(places[::-1]))


def test_weights_are_applied(make: Make) -> None:
    plain, weighted = make(reward="coverage"), make(reward={"coverage": 0.5, "collision": 10})
    for env in (plain, weighted):
        env.reset(seed=1)
    move = Move("move_distance", 0.5)
    gained = float(plain.step(move)[1])
    assert gained > 0
    assert float(weighted.step(move)[1]) == pytest.approx(gained / 2)
    wall = Move("move_distance", 9.0)
    assert float(weighted.step(wall)[1]) == pytest.approx(float(plain.step(wall)[1]) / 2 - 10)


def test_a_function_is_a_reward_and_sees_what_the_task_hides(make: Make) -> None:
    def progress(transition: Transition) -> float:
        return transition.base.translation_xyz[0]

    env = make(task="sample:noisy", reward=progress)
    env.reset(seed=1)
    assert env.step(Move("move_distance", 0.0))[1] == -2.0


def test_a_class_makes_a_reward_for_each_environment() -> None:
    made: list[object] = []

    class Counting(Coverage):
        def __init__(self) -> None:
            super().__init__()
            made.append(self)

    choices: dict[str, Any] = {"task": "sample:active", "robot": "sample_robot", "env": "arena:1", "reward": Counting}
    envs = gymnasium.make_vec("benchbot/Task-v0", 3, "sync", **choices)
    envs.close()
    assert len(set(map(id, made))) == 3


def test_a_better_map_is_a_reward(make: Make) -> None:
    omq = plugin_manager.load().record("evaluators", "omq")
    chair = {"class": "chair", "class_id": 1, "centroid": [0, 0, 0], "extent": [1, 1, 1]}
    truth = {
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"class_list": ["chair"], "objects": [chair]},
    }
    found: list[dict[str, Any]] = []

    def estimate() -> dict[str, Any]:
        return {
            "task_details": {"results_format": "object_map"},
            "results": {"class_list": ["chair", "background"], "objects": found},
        }

    env = make(reward=MapQuality(omq, [truth], estimate))
    env.reset()
    assert env.step(Move("move_distance", 0.1))[1] == 0.0
    found.append({"label_probs": [1.0, 0.0], "centroid": [0, 0, 0], "extent": [1, 1, 1]})
    assert env.step(Move("move_distance", 0.1))[1] == pytest.approx(1.0)
    assert env.step(Move("move_distance", 0.1))[1] == 0.0
