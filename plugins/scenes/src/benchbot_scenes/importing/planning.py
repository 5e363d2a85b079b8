"""A start pose in an imported scene, and a trajectory from which the robot sees its objects."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot.plugin import BenchbotError
from benchbot_scenes.coverage import MARGIN_M, Coverage, plan_coverage
from benchbot_scenes.free_space import FreeSpace, free_space
from benchbot_scenes.importing.light import roofed
from benchbot_scenes.scene import Instance, SceneGeometry, only
from benchbot_scenes.visibility import Observer

Bools = npt.NDArray[np.bool_]
Start = tuple[float, float, float]
WIDE_M = 1.0
# Less floor under a ceiling is that below a table or a porch.
LEAST_INDOORS_M2 = 2.0
LONGEST_VIEW_M = 8.0
HEADINGS = 24
# A scene in one piece is seen when pieces of this size are.
PIECE_M = 1.5
LARGEST_M = 100.0
EYE_M = 1.05
# Trajectories reach so far from the start, and look at what lies between these heights.
REACH_M, BOTTOM_M, TOP_M = 25.0, -1.0, 4.0


@dataclass(frozen=True)
class Room:
    """The floor that a robot can reach: clearances, and the cells reached from `start` (x, y, heading in radians)."""

    space: FreeSpace
    reached: Bools
    start: Start

    @property
    def area_m2(self) -> float:
        """The area of the positions that the robot's centre can reach."""
        return float(self.reached.sum()) * self.space.cell_m**2


def find_room(geometry: SceneGeometry, robot: Observer, start_pose: Start | None) -> Room:
    """Return the largest free region and a start in its middle, or that around a start (x, y, heading in degrees).

    Where there is a ceiling, the largest has most floor under it, and the start is there, too: not in the garden.

    Raises BenchbotError when the robot fits nowhere, or not at the start that is asked for.
    """
    sides_m = np.ptp(geometry.vertices[:, :2], axis=0)
    if sides_m.max() > LARGEST_M:
        raise BenchbotError(
            "The scene is too large for one environment",
            f"It is {sides_m[0]:.0f} x {sides_m[1]:.0f} m; up to {LARGEST_M:.0f} m are planned in.",
            "Cut out the part that the robot shall be in, or say which unit it has: --units.",
        )
    space = free_space(geometry, robot.z_min_m, robot.z_max_m)
    radius_m = robot.radius_m + MARGIN_M
    if start_pose is not None:
        x, y, heading_deg = start_pose
        reached = space.region((x, y), radius_m)
        if not reached.any():
            raise BenchbotError(
                f"The robot does not fit at the start pose ({x:g}, {y:g})",
                f"It has {space.clearance_at(x, y):.2f} m of floor around it there and needs {radius_m:.2f} m.",
                "Choose another start_pose in the guesses, or delete it to have one chosen.",
            )
        return Room(space, reached, (x, y, math.radians(heading_deg)))
    roof = roofed(geometry, space)
    labels, count = ndimage.label(space.clearance_m >= radius_m)
    if count:
        under_roof = np.bincount(labels[roof], minlength=count + 1)[1:]
        sizes = np.bincount(labels.ravel())[1:]
        indoors = under_roof.max() * space.cell_m**2 >= LEAST_INDOORS_M2
        reached = labels == 1 + int(np.argmax(under_roof if indoors else sizes))
    else:
        raise BenchbotError(
            "There is no place in the scene that the robot fits in",
            f"It needs {radius_m:.2f} m all around and floor below; the widest place has "
            f"{float(space.clearance_m.max()):.2f} m, taking the floor at z = 0 of the converted scene.",
            "Check unit, up axis and floor: --units, --up, --floor-z; or choose a smaller robot: --robot.",
        )
    return Room(space, reached, _start(space, reached & roof if indoors else reached))


def _start(space: FreeSpace, reached: Bools) -> Start:
    """A wide place near the middle of the region, facing the longest free way."""
    clearance = np.where(reached, space.clearance_m, 0.0)
    wide = np.argwhere(clearance >= 0.8 * min(float(clearance.max()), WIDE_M))
    middle = np.argwhere(reached).mean(axis=0)
    column, row = wide[int(np.hypot(*(wide - middle).T).argmin())]
    x, y = (round(value, 4) for value in space.centre(int(column), int(row)))
    headings = [2 * math.pi * number / HEADINGS for number in range(HEADINGS)]
    heading = max(headings, key=lambda angle: (_free_way_m(space, x, y, angle), -angle))
    return x, y, math.remainder(heading, 2 * math.pi)


def _free_way_m(space: FreeSpace, x: float, y: float, heading: float) -> float:
    way = 0.0
    while way < LONGEST_VIEW_M:
        column, row = space.cell(x + (way + 0.05) * math.cos(heading), y + (way + 0.05) * math.sin(heading))
        inside = 0 <= column < space.shape[0] and 0 <= row < space.shape[1]
        if not inside or space.is_blocked[column, row]:
            break
        way += 0.05
    return way


def plan(geometry: SceneGeometry, start: Start, robot: Observer) -> Coverage:
    """A trajectory past all objects of a class or, where there are none, past all of the scene piece by piece."""
    near = _near(geometry, start)
    named = [found.name for found in geometry.instances if found.class_name is not None]
    if named:
        within = set(np.unique(near.triangle_instance).tolist())
        near = replace(near, instances=tuple(found for found in near.instances if found.index in within))
        planned = plan_coverage(near, start, robot)
        left = {found.name for found in near.instances}
        return replace(planned, unseen=(*planned.unseen, *(name for name in named if name not in left)))
    pieces = in_pieces(near)
    planned = plan_coverage(pieces, start, robot, names=[found.name for found in pieces.instances])
    return Coverage(planned.poses, ())


def _near(geometry: SceneGeometry, start: Start) -> SceneGeometry:
    """The part of a scene that planning needs: the rest of a large place would take too much memory."""
    corners = geometry.vertices[geometry.triangles]
    off = np.abs(corners[..., :2] - np.array(start[:2], np.float32))
    is_near = (off.min(axis=1) < REACH_M).all(axis=1)
    is_level = (corners[..., 2].min(axis=1) < TOP_M) & (corners[..., 2].max(axis=1) > BOTTOM_M)
    return geometry if (is_near & is_level).all() else only(geometry, is_near & is_level)


def in_pieces(geometry: SceneGeometry) -> SceneGeometry:
    """The scene with its triangles sorted into cubes of 1.5 m instead of objects."""
    middle = geometry.vertices[geometry.triangles].mean(axis=1)
    cubes = np.floor(middle / PIECE_M).astype(np.int64)
    _, number = np.unique(cubes, axis=0, return_inverse=True)
    number = number.reshape(-1).astype(np.int32)
    instances = tuple(Instance(index + 1, f"piece {index + 1}", None) for index in range(int(number.max()) + 1))
    return replace(geometry, triangle_instance=number + np.int32(1), instances=instances)


def level_camera(pose: Sequence[float], turn_rad: float = 0.0) -> npt.NDArray[np.float64]:
    """The optical frame (x right, y down, z forward) of a camera above a base pose [qw, qx, qy, qz, x, y, z].

    It is turned to the left of where the base heads by `turn_rad`.
    """
    heading = 2 * math.atan2(pose[3], pose[0]) + turn_rad
    cos, sin = math.cos(heading), math.sin(heading)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[sin, 0.0, cos], [-cos, 0.0, sin], [0.0, -1.0, 0.0]])
    matrix[:3, 3] = (pose[4], pose[5], pose[6] + EYE_M)
    return matrix
