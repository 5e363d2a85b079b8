"""Floors whose clearance is known in closed form, and runs on them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from benchbot_sample import world

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.core.session import Session
from benchbot.plugin import GroundTruth
from benchbot_task_navigation.floor_plan import FloorPlan

LASER_TASK = "navigation:point_goal:ground_truth:laser"
ARENA_MAP = Path(world.__file__).parent / "maps" / "arena_1.yaml"


def floor(
    size_m: float, posts: Sequence[tuple[float, float, float]] = (), resolution_m: float = 0.025, **walls: Any
) -> FloorPlan:
    """Return the plan of a square room around the origin with round posts (x, y, radius) and walls (x0, y0, x1, y1)."""
    half = size_m / 2
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    sides = [(*start, *end) for start, end in zip(corners, corners[1:] + corners[:1], strict=True)]
    everything = world.World(
        np.array(posts, np.float64).reshape(-1, 3),
        np.array([*sides, *walls.get("walls", ())], np.float64),
        (),
    )
    return plan_of(everything, (-half, -half), (half, half), resolution_m)


def plan_of(
    there: world.World, low: tuple[float, float], high: tuple[float, float], resolution_m: float = 0.05
) -> FloorPlan:
    """Return the plan of a sample world between two corners, as it comes out of a ground truth."""
    x = np.arange(round((high[0] - low[0]) / resolution_m) + 1) * resolution_m + low[0]
    y = np.arange(round((high[1] - low[1]) / resolution_m) + 1) * resolution_m + low[1]
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    clearance_m = there.clearance_m(nodes.reshape(-1, 2)).reshape(nodes.shape[:2])
    return FloorPlan.from_ground_truth(FloorPlan(low, resolution_m, clearance_m).as_ground_truth())


def arena() -> FloorPlan:
    """Return the plan of `arena:1`."""
    return plan_of(world.read(ARENA_MAP), (-3.0, -2.0), (3.0, 2.0))


def arena_truth() -> GroundTruth:
    """Return the ground truth of navigation in `arena:1`."""
    catalog = Catalog(load())
    return {
        "environment": {"name": "arena", "variant": 1},
        "format": catalog.get("formats", "floor_plan").data,
        "ground_truth": arena().as_ground_truth(),
    }


def arena_session(episode: int, task: str = LASER_TASK, robot: str = "sample_robot") -> Session:
    """Return a session in `arena:1` that has not begun."""
    selection = select(Catalog(load()), RunRequest(task=task, robot=robot, environment="arena:1", episode=episode))

    def start() -> InProcessHost:
        spec = PlatformSpec(selection.robot.data, selection.localisation, Path())
        platform = load().record("simulators", "sim_sample").create(spec)
        return InProcessHost(platform, session.scenes, MotionConfig.from_robot(spec.robot, spec.localisation))

    session = Session(selection, start)
    return session
