"""The arm of a robot in its physics: its model, what it is told, and what it meets."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, FailureClass, Outcome, Pose, did_you_mean
from benchbot_sim_mujoco.joint_path import Limits, Timed, timed
from benchbot_sim_mujoco.kinematics import JOINTS, Kinematics, straight, turn_rad

Floats = npt.NDArray[np.float64]

MODELS = Path(__file__).parent / "models"
GRIPPER, END_EFFECTOR = "gripper", "end_effector"
LINE_M, LINE_RAD = 0.01, 0.05
"""Straight lines are followed by poses so near each other."""
LONGEST_JUMP_RAD = 0.35
"""Where a joint moves by more between two of these, it flips over: the line cannot be followed."""
LAG_RAD = 0.25
"""A joint that is so far behind is held by something."""
GRIPPER_MPS2 = 1.0
REACHED_RAD, REACHED_M, REST_RADPS = 0.01, 0.003, 0.02


@dataclass(frozen=True)
class ArmDeclaration:
    """The key `arm` of a robot: its model, where it is mounted, how it is folded, and how fast it may be.

    `mount` is the pose of the model in the robot's frame, `frame` the name of the frame between the fingers; `home_rad`
    are the joints (6,) when a scene begins; it stops, `collided`, where it pushes something fixed harder than
    `contact_force_n`.
    """

    model: Path
    mount: Pose
    frame: str
    home_rad: Floats
    limits: Limits
    gripper_mps: float
    contact_force_n: float

    @classmethod
    def of(cls, robot: Mapping[str, Any]) -> Self | None:
        """Read a robot's declaration, None where it has no arm; raises BenchbotError saying what is wrong."""
        if "arm" not in robot:
            return None
        arm = robot["arm"]
        try:
            speeds = np.array([float(joint["radps"]) for joint in arm["joints"].values()])
            accelerations = np.array([float(joint["radps2"]) for joint in arm["joints"].values()])
            home_rad = np.radians([float(angle) for angle in arm["home_deg"]])
            mount = Pose.from_xyz_rpy_deg(arm["mount"]["xyz"], arm["mount"].get("rpy_deg", (0.0, 0.0, 0.0)))
            found = cls(
                MODELS / f"{arm['model']}.xml",
                mount,
                str(arm["frame"]),
                home_rad,
                Limits(speeds, accelerations),
                float(arm["gripper_mps"]),
                float(arm["contact_force_n"]),
            )
            found.check()
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BenchbotError(
                f"The arm of the robot '{robot.get('name')}' cannot be simulated.",
                f"Its declaration lacks something, or has it in another form: {type(error).__name__}: {error}.",
                "Compare its key 'arm' with: benchbot show robot carter_arm",
            ) from error
        if not found.model.is_file():
            known = sorted(path.stem for path in MODELS.glob("*.xml"))
            raise BenchbotError(
                f"The arm of the robot '{robot.get('name')}' has no model '{arm['model']}'.",
                f"Known: {', '.join(known)}.{did_you_mean(str(arm['model']), known)}",
                "Name one of these.",
            )
        return found

    def check(self) -> None:
        """Raise ValueError for another number of joints, and for limits that are none."""
        positive = (*self.limits.speeds, *self.limits.accelerations, self.gripper_mps, self.contact_force_n)
        if not all(0 < value < math.inf for value in positive):
            raise ValueError("speeds, accelerations and forces are positive")
        if not len(self.home_rad) == len(self.limits.speeds) == JOINTS:
            raise ValueError(f"joints and home_deg are of {JOINTS} joints")

    def add(self, spec: Any, base: Any) -> None:
        """Add the arm to a model, on the body of the base."""
        x, y, z, w = self.mount.rotation_xyzw
        frame = base.add_frame(pos=self.mount.translation_xyz, quat=[w, x, y, z])
        spec.attach(mujoco.MjSpec.from_file(str(self.model)), prefix="arm/", frame=frame)


class Arm:
    """The arm in a compiled model. Targets are those of its servos: of the joints (6,), and the gripper's width."""

    def __init__(self, declared: ArmDeclaration, model: Any, loose: Sequence[str]) -> None:
        self.declared = declared
        self._model = model
        self.names = [
            model.joint(index).name for index in range(model.njnt) if model.joint(index).name.startswith("arm/")
        ][:JOINTS]
        joints = [model.joint(name) for name in self.names]
        self.qpos = np.array([joint.qposadr[0] for joint in joints])
        self.dofs = np.array([joint.dofadr[0] for joint in joints])
        fingers = [model.joint(f"arm/{side}_finger") for side in ("left", "right")]
        self.finger_qpos = np.array([joint.qposadr[0] for joint in fingers])
        self.finger_dofs = np.array([joint.dofadr[0] for joint in fingers])
        servos = [model.actuator(name) for name in (*self.names, f"arm/{GRIPPER}")]
        self.servos = np.array([servo.id for servo in servos])
        # A servo's force is kp (target - position) - kv velocity: so much ahead, it does not lag behind.
        self._lead_s = np.array([-servo.biasprm[2] / servo.gainprm[0] for servo in servos[:JOINTS]])
        self.site = model.site(f"arm/{END_EFFECTOR}").id
        self.widest_m = float(model.actuator_ctrlrange[self.servos[-1], 1])
        bodies = np.array([name.startswith("arm/") for name in _names(model, "body")])
        self._is_arm = bodies[model.geom_bodyid]
        self._is_finger = np.array([name.endswith(("_finger",)) for name in _names(model, "body")])[model.geom_bodyid]
        self._loose = {model.geom(name).id: name for name in loose}
        self._is_loose = np.isin(np.arange(model.ngeom), list(self._loose))
        self.kinematics = self._measured()

    def home(self, data: Any) -> None:
        """Fold the arm, its gripper closed."""
        data.qpos[self.qpos] = self.declared.home_rad
        data.ctrl[self.servos] = [*self.declared.home_rad, 0.0]

    def joints(self, data: Any) -> Floats:
        """Return the positions of the joints (6,) in radians."""
        found: Floats = data.qpos[self.qpos].copy()
        return found

    def width_m(self, data: Any) -> float:
        """Return how far the fingers are apart."""
        return float(data.qpos[self.finger_qpos].sum())

    def states(self, data: Any) -> tuple[list[str], Floats, Floats, Floats]:
        """Return names, positions, velocities and efforts of the joints and of the gripper."""
        gripper = (data.qpos[self.finger_qpos].sum(), data.qvel[self.finger_dofs].sum())
        force_n = -data.actuator_force[self.servos[-1]]
        return (
            [*(name.removeprefix("arm/") for name in self.names), GRIPPER],
            np.append(data.qpos[self.qpos], gripper[0]),
            np.append(data.qvel[self.dofs], gripper[1]),
            np.append(data.qfrc_actuator[self.dofs], force_n),
        )

    def pose(self, data: Any) -> Pose:
        """Return the pose of the end effector in the robot's frame, as the joints have it."""
        return self.declared.mount @ Pose.from_matrix(self.kinematics.forward(self.joints(data)))

    def reaches(self, pose: Pose) -> bool:
        """Return whether joints within their limits bring the end effector to a pose in the robot's frame."""
        wanted = (self.declared.mount.inverse() @ pose).matrix()
        return self.kinematics.inverse(wanted, self.declared.home_rad) is not None

    def power_w(self, data: Any) -> float:
        """Return the mechanical power of the motors, of which braking gives none back."""
        dofs = np.append(self.dofs, self.finger_dofs)
        return float(np.abs(data.qfrc_actuator[dofs] * data.qvel[dofs]).sum())

    def pushes(self, data: Any) -> bool:
        """Return whether it pushes anything but a loose object harder than it may."""
        pairs = data.contact.geom
        if not len(pairs):
            return False
        hit = self._is_arm[pairs].any(1) & ~self._is_loose[pairs].any(1) & (data.contact.efc_address >= 0)
        force = np.empty(6)
        for index in np.flatnonzero(hit):
            mujoco.mj_contactForce(self._model, data, int(index), force)
            if abs(force[0]) > self.declared.contact_force_n:
                return True
        return False

    def touched(self, data: Any) -> tuple[str, ...]:
        """Return the loose objects that a finger touches."""
        pairs = data.contact.geom
        touching = pairs[self._is_finger[pairs].any(1) & self._is_loose[pairs].any(1)] if len(pairs) else pairs
        return tuple(sorted({self._loose[int(geom)] for geom in touching.ravel() if int(geom) in self._loose}))

    def planned(self, action: str, arguments: Mapping[str, Any], data: Any, step_s: float) -> Floats | None:
        """Return what the servos are told (T, 7) in each step of an action, None for a pose that is out of reach.

        Raises BenchbotError for another number of joints, and beyond a limit.
        """
        now = np.append(data.ctrl[self.servos[:JOINTS]], data.ctrl[self.servos[-1]])
        if action == "move_gripper":
            width_m = float(arguments["width"])
            if not 0.0 <= width_m <= self.widest_m:
                raise _refused(
                    f"The gripper does not open {width_m:g} m wide.",
                    f"Its fingers are 0 to {self.widest_m:g} m apart.",
                    f"Ask for a width within these: move_gripper(width={min(max(width_m, 0.0), self.widest_m):g})",
                )
            # From where the fingers are: those that were held do not jump when they are let go.
            path = np.array([[*now[:JOINTS], self.width_m(data)], [*now[:JOINTS], width_m]])
            pace = Limits(
                np.append(self.declared.limits.speeds, self.declared.gripper_mps), np.full(JOINTS + 1, GRIPPER_MPS2)
            )
            return timed(path, pace, step_s).positions
        goal = self._goal(action, arguments, now[:JOINTS])
        if goal is None:
            return None
        moved: Timed = timed(goal, self.declared.limits, step_s)
        ahead = moved.positions + moved.velocities * self._lead_s
        limits = self._model.actuator_ctrlrange[self.servos[:JOINTS]]
        told: Floats = np.clip(ahead, limits[:, 0], limits[:, 1])
        told[-1] = moved.positions[-1]
        return np.column_stack([told, np.full(len(told), now[-1])])

    def lags(self, told: Floats, data: Any) -> bool:
        """Return whether a joint is far behind what it is told."""
        ahead = told[:JOINTS] - data.qpos[self.qpos] - data.qvel[self.dofs] * self._lead_s
        return bool(np.abs(ahead).max() > LAG_RAD)

    def ended(self, action: str, told: Floats, data: Any) -> Outcome | None:
        """Return how an action ends whose last target is this, None while something still moves."""
        if action == "move_gripper":
            if abs(float(data.qvel[self.finger_dofs].sum())) > REST_RADPS / 10:
                return None
            return Outcome.REACHED if abs(self.width_m(data) - told[-1]) < REACHED_M else Outcome.BLOCKED
        if np.abs(data.qvel[self.dofs]).max() > REST_RADPS:
            return None
        is_there = np.abs(told[:JOINTS] - data.qpos[self.qpos]).max() < REACHED_RAD
        return Outcome.REACHED if is_there else Outcome.BLOCKED

    def _goal(self, action: str, arguments: Mapping[str, Any], now: Floats) -> Floats | None:
        """Return the path of the joints (K, 6) from where they are."""
        if action == "move_joints":
            return np.array([now, self._checked(arguments["positions"])])
        x, y, z, *quaternion = (float(value) for value in arguments["pose"])
        norm = math.hypot(*quaternion)
        if abs(norm - 1.0) > 1e-2:
            raise _refused(
                f"The pose's quaternion has the norm {norm:.3g}.",
                "It must be a unit quaternion, [qx, qy, qz, qw], behind the position [x, y, z].",
                "Divide it by its norm; straight down is [1, 0, 0, 0], straight ahead [0, 0.7071, 0, 0.7071].",
            )
        qx, qy, qz, qw = (value / norm for value in quaternion)
        end = (self.declared.mount.inverse() @ Pose((x, y, z), (qx, qy, qz, qw))).matrix()
        start = self.kinematics.forward(now)
        way_m = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
        count = max(1, math.ceil(way_m / LINE_M), math.ceil(turn_rad(start, end) / LINE_RAD))
        path = [now]
        for pose in straight(start, end, count):
            joints = self.kinematics.inverse(pose, path[-1])
            if joints is None or np.abs(joints - path[-1]).max() > LONGEST_JUMP_RAD:
                found = self.kinematics.inverse(end, now)
                return None if found is None else np.array([now, found])
            path.append(joints)
        return np.array(path)

    def _checked(self, positions: Sequence[float]) -> Floats:
        joints = np.array([float(value) for value in positions])
        if len(joints) != JOINTS:
            raise _refused(
                f"move_joints was given {len(joints)} positions.",
                f"The arm has {JOINTS} joints: {', '.join(name.removeprefix('arm/') for name in self.names)}.",
                "Give one for each, in this order, in radians.",
            )
        beyond = np.flatnonzero(
            (joints < self.kinematics.limits_rad[:, 0]) | (joints > self.kinematics.limits_rad[:, 1])
        )
        if len(beyond):
            first = int(beyond[0])
            low, high = self.kinematics.limits_rad[first]
            name = self.names[first].removeprefix("arm/")
            raise _refused(
                f"The joint '{name}' cannot be at {joints[first]:g} rad.",
                f"Its limits are {low:g} to {high:g} rad.",
                f"Ask for a position within these, such as {min(max(joints[first], low), high):g}; they are radians.",
            )
        return joints

    def _measured(self) -> Kinematics:
        """Return the kinematics of the model, by where its bodies are when all joints are zero."""
        data = mujoco.MjData(self._model)
        data.qpos[self.qpos] = 0.0
        mujoco.mj_kinematics(self._model, data)
        pedestal, shoulder, elbow, wrist = (
            data.body(f"arm/{name}").xpos for name in ("pedestal", "upper_arm", "elbow", "wrist")
        )
        ends = (pedestal, shoulder, elbow, wrist, data.site_xpos[self.site])
        shoulder_m, upper_arm_m, forearm_m, tool_m = (
            float(np.linalg.norm(two - one)) for one, two in itertools.pairwise(ends)
        )
        limits = np.array([self._model.joint(name).range for name in self.names])
        return Kinematics(shoulder_m, upper_arm_m, forearm_m, tool_m, limits)


def _names(model: Any, kind: str) -> list[str]:
    return [getattr(model, kind)(index).name for index in range(getattr(model, f"n{kind}"))]


def _refused(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, failure=FailureClass.AGENT)
