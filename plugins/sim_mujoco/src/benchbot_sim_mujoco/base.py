"""The mobile base: two driven wheels and two casters under a cylinder that is the footprint."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from benchbot.simulation import Footprint

MASS_KG, WHEEL_MASS_KG = 25.0, 0.8
DECKED_MASS_KG = 45.0
"""Of a base that carries an arm: batteries, low down, keep it from tipping."""
WHEEL_RADIUS_M, WHEEL_WIDTH_M = 0.1, 0.03
TRACK_SHARE, CASTER_SHARE = 0.75, 0.7
"""Half the track, and the distance of the casters from the middle, as shares of the footprint's radius."""
CASTER_RADIUS_M = 0.03
CENTRE_Z_M = 0.15
SLIDING_FRICTION, WHEEL_FRICTION = 0.4, 1.2
SERVO_NMSPRAD, ROTOR_KGM2 = 20.0, 0.05
"""Torque of a wheel's servo by the error of its speed, and the inertia of its motor behind the gear."""
BUMPER_SOLREF = (0.006, 2.0)
FLOOR, FOOTPRINT, MAST = "floor", "footprint", "mast"
MAST_X_M, MAST_RADIUS_M = -0.24, 0.02
PAINT, DARK = (0.87, 0.88, 0.9, 1.0), (0.16, 0.17, 0.19, 1.0)
WHEEL_BIT, POST_BIT, LOOSE_BIT, HELD_BIT, ARM_BIT = 1, 2, 4, 8, 16
"""The kinds of shapes in contacts: wheels and casters, what stops footprints, loose objects, what stops these, arms."""


@dataclass(frozen=True)
class Wheels:
    """The geometry of the drive: wheels of a radius, with a track between them, in metres."""

    radius_m: float
    track_m: float

    def speeds_radps(self, linear_mps: float, angular_radps: float) -> tuple[float, float]:
        """Return the angular velocities of the left and the right wheel."""
        half_mps = angular_radps * self.track_m / 2
        return (linear_mps - half_mps) / self.radius_m, (linear_mps + half_mps) / self.radius_m

    def way(self, left_rad: float, right_rad: float) -> tuple[float, float]:
        """Return way (m) and turn (rad) of wheels that roll by these angles without slipping."""
        left_m, right_m = left_rad * self.radius_m, right_rad * self.radius_m
        return (left_m + right_m) / 2, (right_m - left_m) / self.track_m


def add_base(spec: Any, footprint: Footprint, floor_z_m: float, deck_m: float | None = None) -> Wheels:
    """Add floor and robot to a model; the robot's free joint is the first joint, then left and right wheel.

    `deck_m` is the height of the deck that an arm stands on; then the cylinder ends there, and a mast for the camera
    stands behind. Without it the robot is a cylinder as high as its footprint.
    """
    wheels = Wheels(WHEEL_RADIUS_M, 2 * TRACK_SHARE * footprint.radius_m)
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 1],
        pos=[0, 0, floor_z_m],
        contype=0,
        conaffinity=WHEEL_BIT | LOOSE_BIT | ARM_BIT,
        friction=[SLIDING_FRICTION, 0.005, 0.0001],
    )
    base = spec.worldbody.add_body(name="base", pos=[0, 0, floor_z_m])
    base.add_freejoint(name="base")
    half_m = ((deck_m or footprint.z_max_m) - footprint.z_min_m) / 2
    base.add_geom(
        name=FOOTPRINT,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[footprint.radius_m, half_m, 0],
        pos=[0, 0, footprint.z_min_m + half_m],
        mass=0,
        contype=0,
        conaffinity=POST_BIT | LOOSE_BIT | ARM_BIT,
        friction=[SLIDING_FRICTION, 0.005, 0.0001],
        solref=BUMPER_SOLREF,
    )
    mass_kg = MASS_KG if deck_m is None else DECKED_MASS_KG
    base.mass, base.ipos, base.explicitinertial = mass_kg, [0, 0, CENTRE_Z_M], True
    turning = mass_kg * footprint.radius_m**2 / 2
    base.inertia = [turning, turning, turning]
    if deck_m is not None:
        base.add_geom(
            name=MAST,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[MAST_RADIUS_M, 0, 0],
            fromto=[MAST_X_M, 0, deck_m, MAST_X_M, 0, footprint.z_max_m - MAST_RADIUS_M],
            mass=0,
            rgba=DARK,
            contype=HELD_BIT,
            conaffinity=0,
        )
        spec.geom(FOOTPRINT).rgba = PAINT
        _add_trim(base, footprint, deck_m)
    for end in (-1, 1):
        base.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[CASTER_RADIUS_M, 0, 0],
            pos=[end * CASTER_SHARE * footprint.radius_m, 0, CASTER_RADIUS_M],
            mass=0,
            contype=WHEEL_BIT,
            conaffinity=0,
            condim=1,
            priority=1,
        )
    for name, side in (("left", 1), ("right", -1)):
        wheel = base.add_body(name=name, pos=[0, side * wheels.track_m / 2, wheels.radius_m])
        wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0], armature=ROTOR_KGM2)
        # One point of contact, in the middle of the wheel: its track is exact.
        wheel.add_geom(
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
            size=[wheels.radius_m, WHEEL_WIDTH_M, wheels.radius_m],
            mass=WHEEL_MASS_KG,
            contype=WHEEL_BIT,
            conaffinity=0,
            friction=[WHEEL_FRICTION, 0.005, 0.0001],
            priority=1,
        )
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_velocity(kv=SERVO_NMSPRAD)
    return wheels


def _add_trim(base: Any, footprint: Footprint, deck_m: float) -> None:
    """Add what only pictures show: the plate of the deck, and the housing of the camera behind its frame."""
    top_m = footprint.z_max_m - MAST_RADIUS_M
    shown = {"mass": 0, "contype": 0, "conaffinity": 0}
    plate = [0.97 * footprint.radius_m, 0.003, 0]
    base.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=plate, pos=[0, 0, deck_m], rgba=DARK, **shown)
    housing = [0.02, 0.06, 0.025]
    at = [MAST_X_M, 0, top_m - 0.03]
    base.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=housing, pos=at, rgba=DARK, **shown)


def planar(qpos: Any) -> tuple[float, float, float]:
    """Return x, y and heading of a free joint's position and quaternion (7,)."""
    w, x, y, z = (float(value) for value in qpos[3:7])
    return float(qpos[0]), float(qpos[1]), float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def turned(quaternion_wxyz: Any, yaw_rad: float) -> Any:
    """Return a quaternion turned about the vertical by an angle."""
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, np.array([np.cos(yaw_rad / 2), 0, 0, np.sin(yaw_rad / 2)]), quaternion_wxyz)
    return result
