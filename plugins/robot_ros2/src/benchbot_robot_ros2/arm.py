"""The arm of a robot over ROS 2 as its declaration has it: which joints count, their limits, and ways within these."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, FailureClass, JointStates, did_you_mean

Floats = npt.NDArray[np.float64]
Positive = Annotated[float, msgspec.Meta(gt=0)]

GRIPPER = "gripper"
MOVE_GRIPPER = "move_gripper"
GRIPPER_MPS2 = 1.0
# Of the polynomial 10 t³ - 15 t⁴ + 6 t⁵, which begins and ends at rest: its greatest slope and curvature.
_STEEPEST, _MOST_BENT = 1.875, 10 / math.sqrt(3)


class Joint(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A joint's speed and acceleration, and its range in radians."""

    radps: Positive
    radps2: Positive
    range_rad: tuple[float, float] = (-math.inf, math.inf)


class Arm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The key `arm` of a robot over ROS 2: its joints from the base on, and those of its fingers, by their ROS names.

    `gripper` are joints that slide: their positions together are the distance between the fingers.
    """

    joints: Annotated[dict[str, Joint], msgspec.Meta(min_length=1)]
    gripper: Annotated[tuple[str, ...], msgspec.Meta(min_length=1)]
    gripper_width_m: tuple[float, float] = (0.0, 0.1)
    gripper_mps: Positive = 0.1

    def select(self, states: JointStates) -> JointStates:
        """Return the states of the arm out of those that a robot tells; raises ValueError where one is missing."""
        places = {name: index for index, name in enumerate(states["names"])}
        for name in (*self.joints, *self.gripper):
            if name not in places:
                known = list(places)
                raise ValueError(
                    f"it has no joint '{name}', but {', '.join(known)}.{did_you_mean(name, known)} The key 'arm' "
                    "names the joints; where several nodes publish parts of them, let joint_state_publisher "
                    "(source_list) put them together"
                )
        joints, fingers = ([places[name] for name in names] for names in (self.joints, self.gripper))

        def put_together(values: Floats, *, finger: Any) -> Floats:
            return np.append(values[joints], finger(values[fingers]))

        return {
            "names": [*self.joints, GRIPPER],
            "positions": put_together(states["positions"], finger=np.sum),
            "velocities": put_together(states["velocities"], finger=np.sum),
            "efforts": put_together(states["efforts"], finger=np.mean),
        }

    def target(self, action: str, arguments: Mapping[str, Any]) -> Floats:
        """Return where an action leads; raises BenchbotError for another number of joints, or beyond a limit."""
        if action == MOVE_GRIPPER:
            width_m, (low, high) = float(arguments["width"]), self.gripper_width_m
            if not low <= width_m <= high:
                raise _refused(
                    f"The gripper does not open {width_m:g} m wide.",
                    f"Its fingers are {low:g} to {high:g} m apart.",
                    f"Ask for a width within these: move_gripper(width={min(max(width_m, low), high):g})",
                )
            return np.array([width_m])
        positions = np.array(arguments["positions"], np.float64)
        if len(positions) != len(self.joints):
            raise _refused(
                f"move_joints was given {len(positions)} positions.",
                f"The arm has {len(self.joints)} joints: {', '.join(self.joints)}.",
                "Give one for each, in this order, in radians.",
            )
        for (name, joint), position in zip(self.joints.items(), positions, strict=True):
            low, high = joint.range_rad
            if not low <= position <= high:
                raise _refused(
                    f"The joint '{name}' cannot be at {position:g} rad.",
                    f"Its limits are {low:g} to {high:g} rad.",
                    f"Ask for a position within these, such as {min(max(position, low), high):g}; they are radians.",
                )
        return positions

    def path(self, action: str, start: Floats, goal: Floats, period_s: float, speed_factor: float) -> Floats:
        """Return the setpoints (T, N) of an action: all joints begin and end at rest, and at the same time."""
        if action == MOVE_GRIPPER:
            speeds, accelerations = np.array([self.gripper_mps]), np.array([GRIPPER_MPS2])
        else:
            speeds = np.array([joint.radps for joint in self.joints.values()])
            accelerations = np.array([joint.radps2 for joint in self.joints.values()])
        way = np.abs(goal - start)
        lasts_s = max(
            float((_STEEPEST * way / (speeds * speed_factor)).max()),
            float(np.sqrt(_MOST_BENT * way / (accelerations * speed_factor**2)).max()),
        )
        share = np.linspace(0.0, 1.0, max(1, math.ceil(lasts_s / period_s)) + 1)[1:, None]
        place = share**3 * (10 - 15 * share + 6 * share**2)
        return start + place * (goal - start)


def moved(action: str, states: JointStates) -> Floats:
    """Return the positions of what an action moves: of the joints (N,), or of the gripper (1,)."""
    positions = states["positions"]
    return positions[-1:] if action == MOVE_GRIPPER else positions[:-1]


def _refused(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, failure=FailureClass.AGENT)
