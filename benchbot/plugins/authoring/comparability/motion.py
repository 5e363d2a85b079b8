"""Where a robot drove, held against what stands there: walls stop robots, and nothing else does."""

from collections.abc import Sequence

import numpy as np

from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.comparability.world import World

TOLERANCE_M = 0.05
NEAR_M = 0.25
"""A robot that stops this far before something is still taken to have stopped at it: not all are discs."""


def check_contact(way: Sequence[Pose], collided: bool, radius_m: float, world: World) -> Finding:
    """Return the finding on a robot, a disc, that was driven towards a wall until it collided or time was up."""
    points = np.array([pose.translation_xyz for pose in way])
    # The disc is compared at the middle of the solid things' heights: neither floor nor lamp stops it.
    solid = World(tuple(box for box in world.boxes if box.low[2] < 1.0 and box.high[2] > 0.1))
    points[:, 2] = 0.1
    free_m = solid.distances_m(points) - radius_m
    last, nearest = free_m[-1], int(free_m[-1].argmin())
    deepest = float(free_m.min())
    if deepest < -TOLERANCE_M:
        name = solid.boxes[int(free_m.min(axis=0).argmin())].name
        through = " and through it" if deepest < -TOLERANCE_M - radius_m / 2 else ""
        detail = f"The robot drives through walls: {-deepest:.3g} m into '{name}'{through}, collided is {collided}."
        return Finding(Level.BROKEN, "walls", detail, "Stop at contact with the scene's geometry, and say collided.")
    if collided and last[nearest] > NEAR_M:
        detail = f"The robot is stopped by nothing: '{solid.boxes[nearest].name}' is still {last[nearest]:.3g} m away."
        return Finding(Level.BROKEN, "walls", detail, "Collide with the scene's geometry and the robot's footprint.")
    if not collided:
        detail = (
            f"It is not collided, {last[nearest]:.3g} m before '{solid.boxes[nearest].name}' that it was driven at."
        )
        return Finding(Level.BROKEN, "walls", detail, "Drive as commanded, and say so when something is touched.")
    return Finding(Level.OK, "walls", f"stopped {last[nearest]:.2g} m from '{solid.boxes[nearest].name}'")
