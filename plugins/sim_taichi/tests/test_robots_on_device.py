"""Actions of many robots in one launch end as those of each robot alone, to the last bit on a processor."""

import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core import motion
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.platform import ManyTensors, PlatformSpec, Scene
from benchbot.simulation import matrices
from benchbot_sim_taichi.robots_on_device import STATES, TracedRobots
from benchbot_sim_taichi.simulator import RayTracedSimulator

MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
SCENE = Scene(schema.read(MINIROOM), MINIROOM.parent)
CARTER = schema.read(Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter_lowres.yaml")
ACTIONS = [("move_distance", 0.25), ("move_angle", 15.0), ("move_angle", -200.0), ("move_distance", -0.6)]
AHEAD = [("move_distance", 4.0)]

pytestmark = pytest.mark.xdist_group("renderer")


def spec(kernel_cache: Path, **changes: Any) -> PlatformSpec:
    return PlatformSpec(CARTER | changes, "ground_truth", kernel_cache)


@pytest.mark.parametrize("stops", [True, False])
def test_they_end_where_each_alone_would(kernel_cache: Path, stops: bool) -> None:
    simulator = RayTracedSimulator(spec(kernel_cache, stops_before_contact=stops))
    robots = simulator.many(3)
    assert isinstance(robots, TracedRobots)
    alone = [RayTracedSimulator(simulator.spec) for _ in range(3)]
    drawn = np.random.default_rng(0)
    for number, one in enumerate(alone):
        robots.load(number, SCENE, number)
        one.load(SCENE, number)
    ends = set()
    for _ in range(12):
        chosen = [(ACTIONS + AHEAD)[i] for i in drawn.integers(len(ACTIONS + AHEAD), size=3)]
        straight = np.array([action == "move_distance" for action, _ in chosen])
        told = robots.execute(np.arange(3), straight, np.array([argument for _, argument in chosen]))
        for one, (action, argument), end in zip(alone, chosen, told.tolist(), strict=True):
            name = "distance" if action == "move_distance" else "angle"
            outcome = motion.execute(one, action, {name: argument}, None, one.config)
            assert outcome == robots.outcomes[end]
            ends.add(str(outcome))
        states = robots._motion.states
        for number, one in enumerate(alone):
            moved = {name: float(getattr(states, name)[number]) for name in STATES if hasattr(one.state, name)}
            assert moved == {name: getattr(one.state, name) for name in moved}
            assert (states.clock_s[number], states.collided[number]) == (one.clock(), one.collided)
    assert ends == {"reached", "blocked"} if stops else {"reached", "collided"}


def test_robots_apart_from_all_obstacles_and_moved_objects(kernel_cache: Path) -> None:
    simulator = RayTracedSimulator(spec(kernel_cache))
    robots = simulator.many(2)
    assert isinstance(robots, TracedRobots)
    for number in range(2):
        robots.load(number, SCENE, number)
    states = robots._motion.states
    states.x[1] = 500.0
    ahead = np.ones(2, bool)
    ended = robots.execute(np.arange(2), ahead, np.full(2, 1.0))
    assert [robots.outcomes[end] for end in ended] == ["blocked", "reached"]
    before = robots.poses_xyyaw(np.arange(2))
    names = [instance.name for instance in simulator.world.renderer.scene.instances]
    away = np.eye(4)
    away[2, 3] = 10.0
    for name in set(names):
        simulator.world.show_object(name, away)
    simulator.world.move_object(names[0], away)
    ended = robots.execute(np.arange(2), ahead, np.full(2, 1.0))
    assert [robots.outcomes[end] for end in ended] == ["reached", "reached"]
    moved_m = np.hypot(*(robots.poses_xyyaw(np.arange(2)) - before)[:, :2].T)
    assert moved_m == pytest.approx(1.0, abs=0.01)


def test_fans_of_rays_are_cast_as_rays_are(kernel_cache: Path) -> None:
    simulator = RayTracedSimulator(spec(kernel_cache))
    simulator.load(SCENE, 0)
    laser, renderer = simulator.robot.laser, simulator.world.renderer
    assert laser is not None
    poses = [Pose.planar(x, 0.1, yaw, 0.6) for x, yaw in ((0.2, 0.3), (0.9, -2.0))]
    distances = np.empty(2 * laser.rays, np.float32)
    renderer.cast_fans(matrices(poses), laser.along(), 20.0, distances)
    ranges_m = laser.ranges(simulator.world.raycast, poses, iter(()))
    distances[distances >= 20.0] = np.inf
    assert distances.tobytes() == ranges_m.astype(np.float32).tobytes()


def test_tensors_need_torch(kernel_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robots = RayTracedSimulator(spec(kernel_cache)).many(1)
    assert isinstance(robots, ManyTensors)
    robots.load(0, SCENE, 0)
    monkeypatch.setitem(sys.modules, "torch", None)
    assert robots.tensors(np.arange(1), ["poses"]) == {}
    with pytest.raises(BenchbotError, match="torch is not installed"):
        robots.tensors(np.arange(1), ["laser"])
