"""Contact physics of one robot in one scene: wheels on the floor, obstacles of the footprint, loose objects."""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, Pose
from benchbot.simulation import DriveLimits, Robot, State
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import Instance, SceneGeometry
from benchbot_sim_mujoco import base
from benchbot_sim_mujoco.arm import Arm, ArmDeclaration
from benchbot_sim_mujoco.base import FOOTPRINT
from benchbot_sim_mujoco.drawing import Shape
from benchbot_sim_mujoco.model import AWAY_M, POST_RADIUS_M, POST_REACH_M, POSTS, TIMESTEP_S, centres, compiled

Floats = npt.NDArray[np.float64]

# Warnings are looked for after each tick; MuJoCo itself would write a file into the current folder.
mujoco.set_mju_user_warning(lambda message: None)

SETTLING_S = 1.0
LIFTED_M, ARRANGING_S = 0.002, 0.5
"""Objects of an episode are let go a little above where they begin, and have so long to come to rest."""
FALLEN_M = 0.05


class Physics:
    """The state of robot and loose objects. A step takes `TIMESTEP_S`; the same commands give the same bytes."""

    def __init__(
        self,
        geometry: SceneGeometry,
        loose: Mapping[str, Instance],
        obstacles: ObstacleMap,
        robot: Robot,
        floor_z_m: float,
        arm: ArmDeclaration | None = None,
    ) -> None:
        self._obstacles = obstacles
        self._robot = robot
        self._floor_z_m = floor_z_m
        self.loose = tuple(loose)
        self.model, self.wheels = compiled(geometry, loose, robot, floor_z_m, arm)
        self._data = mujoco.MjData(self.model)
        self.arm = Arm(arm, self.model, self.loose) if arm else None
        self._centres = centres(geometry, loose)
        self.energy_j = self.end_effector_path_m = 0.0
        self._footprint = self.model.geom(FOOTPRINT).id
        self._is_post = np.array([name.startswith("post") for name in self._geom_names()])
        # Where everything has come to rest, and the pose at which the robot stood then.
        self._settled: tuple[Pose, Floats] | None = None

    def load(self, start: Pose, objects: Sequence[Mapping[str, Any]] = ()) -> None:
        """Put everything where the scene begins, at rest: the robot at a pose, objects where they came to rest.

        `objects` are those that begin elsewhere than the scene has them: `name`, `position` (of the middle of its box's
        bottom face), `turn_deg`. Raises BenchbotError for one that is not loose, or does not stay there.
        """
        if self._settled is None or self._settled[0] != start:
            # Anew for each start, or an episode would differ in its last bits by which one came before.
            self._settled = None
            self._settled = start, self._settle(start)
        self._reset()
        self._data.qpos[:] = self._settled[1]
        self.place(start)
        if objects:
            self._arrange(objects)
        self.energy_j = self.end_effector_path_m = 0.0

    def place(self, pose: Pose) -> None:
        """Put the robot, at rest, at a pose; its wheels do not turn."""
        x, y, _ = pose.translation_xyz
        upright = self._data.qpos[:7] if self._settled is None else self._settled[1][:7]
        yaw_rad = base.planar(upright)[2]
        self._data.qpos[:7] = [x, y, upright[2], *base.turned(upright[3:7], pose.yaw_rad - yaw_rad)]
        self._data.qvel[:8] = 0.0
        self._command = (0.0, 0.0)
        self._gather_posts()
        mujoco.mj_forward(self.model, self._data)

    def advance(
        self,
        linear_mps: float,
        angular_radps: float,
        duration_s: float,
        limits: DriveLimits,
        told: Floats | None = None,
    ) -> bool:
        """Step through a control tick, ramping to the command; return whether the robot hit something.

        `told` (T, 7) are targets of the arm's servos in each step, the last one holds on. The footprint hits what it
        touches, the arm what it pushes hard; then it stays where it is.
        """
        target = limits.clipped(linear_mps, angular_radps)
        contact = False
        data, arm = self._data, self.arm
        steps = max(1, round(duration_s / TIMESTEP_S))
        tip = None if arm is None else data.site_xpos[arm.site].copy()
        for step in range(steps):
            if not contact:
                self._command = self._ramped(target, limits)
            data.ctrl[:2] = self.wheels.speeds_radps(*self._command)
            if arm is not None and told is not None:
                data.ctrl[arm.servos] = told[min(step, len(told) - 1)]
            self._gather_posts()
            mujoco.mj_step(self.model, data)
            if arm is not None:
                self.energy_j += arm.power_w(data) * TIMESTEP_S
                if arm.pushes(data):
                    contact, self._command = True, (0.0, 0.0)
                    data.ctrl[arm.servos[:-1]] = arm.joints(data)
                    told = None
            if self._touches():
                # The bumper gives: all of the impact is lost, and the robot stands still for the rest of the tick.
                contact, self._command = True, (0.0, 0.0)
                self._data.qvel[:8] = 0.0
        self._check()
        # What depends on positions is of the last but one step until now.
        mujoco.mj_kinematics(self.model, self._data)
        if arm is not None:
            self.end_effector_path_m += float(np.linalg.norm(data.site_xpos[arm.site] - tip))
        return contact

    @property
    def state(self) -> State:
        """Pose and velocity of the base, seen from above."""
        x, y, yaw_rad = base.planar(self._data.qpos)
        vx, vy = self._data.qvel[:2]
        # Linear velocities of a free joint are in the map frame, angular ones in the body's.
        return State(x, y, yaw_rad, float(vx * np.cos(yaw_rad) + vy * np.sin(yaw_rad)), float(self._data.qvel[5]))

    @property
    def pose(self) -> Pose:
        """The pose of the base in the map frame, as it rocks on its wheels."""
        x, y, z, qw, qx, qy, qz = (float(value) for value in self._data.qpos[:7])
        norm = float(np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz))
        return Pose((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))

    @property
    def wheel_angles_rad(self) -> tuple[float, float]:
        """The angles by which the left and the right wheel have turned."""
        left, right = self._data.qpos[7:9]
        return float(left), float(right)

    def moved(self, name: str) -> tuple[Floats, Floats]:
        """Return translation (3,) and quaternion (4, w first) that take a loose object from where it began."""
        joint = self._data.joint(name)
        turned = np.empty(3)
        mujoco.mju_rotVecQuat(turned, self._centres[name][0], joint.qpos[3:7])
        return joint.qpos[:3] - turned, joint.qpos[3:7].copy()

    def centre(self, name: str) -> Pose:
        """Return the pose of the middle of an object's box, in the map frame; no rotation is how the scene has it."""
        x, y, z, qw, qx, qy, qz = (float(value) for value in self._data.joint(name).qpos)
        norm = float(np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz))
        return Pose((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))

    @property
    def data(self) -> Any:
        """The state, for the arm to read."""
        return self._data

    def shapes(self) -> list[Shape]:
        """Return the parts of a robot with an arm, as they are now; none of a robot without, which nothing shows."""
        if self.arm is None:
            return []
        model, data = self.model, self._data
        root = model.body("base").id
        return [
            Shape(
                int(model.geom_type[geom]),
                model.geom_size[geom].copy(),
                model.geom_rgba[geom].copy(),
                data.geom_xpos[geom].copy(),
                data.geom_xmat[geom].copy(),
            )
            for geom in range(model.ngeom)
            if model.body_rootid[model.geom_bodyid[geom]] == root
        ]

    def transform(self, name: str) -> Floats:
        """Return the rigid transform (4, 4) that takes a loose object from where it began."""
        translation_m, quaternion = self.moved(name)
        matrix, rotation = np.eye(4), np.empty(9)
        mujoco.mju_quat2Mat(rotation, quaternion)
        matrix[:3, :3], matrix[:3, 3] = rotation.reshape(3, 3), translation_m
        return matrix

    def _geom_names(self) -> list[str]:
        return [self.model.geom(index).name for index in range(self.model.ngeom)]

    def _reset(self) -> None:
        mujoco.mj_resetData(self.model, self._data)
        if self.arm is not None:
            self.arm.home(self._data)

    def _arrange(self, objects: Sequence[Mapping[str, Any]]) -> None:
        """Put objects elsewhere and let them come to rest."""
        wanted: dict[str, Floats] = {}
        for entry in objects:
            name, position = str(entry["name"]), np.array(entry["position"], float)
            if name not in self.loose:
                raise BenchbotError(
                    f"The object '{name}' cannot begin elsewhere.",
                    f"It is not loose; these are: {', '.join(self.loose) or 'none'}.",
                    "Add it to options.loose of the environment, or leave it out of the episode's objects.",
                )
            _, height_m = self._centres[name]
            turn = np.zeros(4)
            half_rad = np.radians(float(entry.get("turn_deg", 0.0))) / 2
            turn[[0, 3]] = np.cos(half_rad), np.sin(half_rad)
            middle_m = position + np.array([0.0, 0.0, height_m / 2 + LIFTED_M])
            joint = self._data.joint(name)
            joint.qpos[:3], joint.qpos[3:] = middle_m, turn
            joint.qvel[:] = 0.0
            wanted[name] = middle_m
        for _ in range(round(ARRANGING_S / TIMESTEP_S)):
            mujoco.mj_step(self.model, self._data)
        for name, middle_m in wanted.items():
            moved_m = float(np.linalg.norm(np.array(self.centre(name).translation_xyz) - middle_m))
            if not moved_m < FALLEN_M:
                raise BenchbotError(
                    f"The object '{name}' does not stay where the episode begins.",
                    f"It moves by {moved_m:.2g} m within {ARRANGING_S:g} s: nothing is below, or something is there.",
                    "Mend its position in the episode's objects: the middle of its bottom, on top of something.",
                )
        self._data.qvel[:] = 0.0
        self._data.time = 0.0
        mujoco.mj_forward(self.model, self._data)

    def _settle(self, start: Pose) -> Floats:
        self._reset()
        self.place(start)
        for _ in range(round(SETTLING_S / TIMESTEP_S)):
            mujoco.mj_step(self.model, self._data)
        settled: Floats = self._data.qpos.copy()
        settled[:2] = start.translation_xyz[:2]
        settled[7:9] = 0.0
        for name in self.loose:
            moved_m = float(np.linalg.norm(self._data.body(name).xpos - self.model.body(name).pos))
            if not moved_m < FALLEN_M:
                raise BenchbotError(
                    f"The object '{name}' does not stay where it is when it is loose.",
                    f"It moves by {moved_m:.2g} m within {SETTLING_S:g} s: it hangs, leans, or lies inside of another.",
                    "Leave it out of options.loose: objects that stand on the floor or on a table can be loose.",
                )
        return settled

    def _check(self) -> None:
        """Raise BenchbotError where MuJoCo gave a warning: it begins anew by itself when values are not finite."""
        given = np.flatnonzero(self._data.warning.number)
        if len(given):
            stats = self._data.warning[int(given[0])]
            raise BenchbotError(
                "MuJoCo lost hold of this scene.",
                mujoco.mju_warningText(int(given[0]), stats.lastinfo),
                "Leave the objects that were touched last out of options.loose.",
            )

    def _ramped(self, target: tuple[float, float], limits: DriveLimits) -> tuple[float, float]:
        steps = (limits.linear_acceleration_mps2 * TIMESTEP_S, limits.angular_acceleration_radps2 * TIMESTEP_S)
        linear, angular = (
            now + min(max(wanted - now, -step), step)
            for now, wanted, step in zip(self._command, target, steps, strict=True)
        )
        return linear, angular

    def _gather_posts(self) -> None:
        """Put posts where obstacles are nearest to the footprint, the others away."""
        x, y, _ = base.planar(self._data.qpos)
        self._data.mocap_pos[:, 0] = AWAY_M + np.arange(POSTS)
        points, distances_m = self._obstacles.nearest_points(x, y)
        near = distances_m < self._robot.footprint.radius_m + POST_REACH_M
        if not near.any():
            return
        points, distances_m = points[near], distances_m[near]
        directions = points - (x, y)
        sectors = ((np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) + 0.5) * POSTS).astype(int) % POSTS
        order = np.argsort(distances_m, kind="stable")
        used, first = np.unique(sectors[order], return_index=True)
        nearest = order[first]
        outwards = directions[nearest] / np.maximum(distances_m[nearest, None], 1e-9)
        self._data.mocap_pos[used, :2] = points[nearest] + POST_RADIUS_M * outwards

    def _touches(self) -> bool:
        contact = self._data.contact
        pairs = contact.geom[contact.dist < 0]
        return bool((self._is_post[pairs].any(1) & (pairs == self._footprint).any(1)).any())
