"""Kinematics of an arm whose axes are z y y z y z from its mount on, the last three meeting in the wrist.

At zero it points up. As every arm with a spherical wrist it is inverted in closed form, position and orientation apart
(D. L. Pieper, "The kinematics of manipulators under computer control", 1968).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

JOINTS = 6
SINGULAR = 1e-9
ROUNDING_RAD = 1e-9
"""By how much a joint may be beyond its limit: such positions are put onto it."""


@dataclass(frozen=True)
class Kinematics:
    """The lengths of an arm, in metres, and the limits of its joints (6, 2), in radians.

    `shoulder_m` is the height of the second axis above the mount, `tool_m` the distance from the wrist to the point
    between the fingers.
    """

    shoulder_m: float
    upper_arm_m: float
    forearm_m: float
    tool_m: float
    limits_rad: Floats

    def forward(self, joints: Floats) -> Floats:
        """Return the pose (4, 4) of the end effector in the frame of the mount; its z axis points out of the hand."""
        yaw, pitch, elbow, *wrist = (float(angle) for angle in joints)
        lower = _about_z(yaw) @ _about_y(pitch)
        fore = lower @ _about_y(elbow)
        pose = np.eye(4)
        pose[:3, :3] = fore @ _about_z(wrist[0]) @ _about_y(wrist[1]) @ _about_z(wrist[2])
        pose[:3, 3] = self.upper_arm_m * lower[:, 2] + self.forearm_m * fore[:, 2] + self.tool_m * pose[:3, 2]
        pose[2, 3] += self.shoulder_m
        return pose

    def inverse(self, pose: Floats, near: Floats) -> Floats | None:
        """Return the joints within their limits that lead to a pose (4, 4), those nearest to `near`; None for none."""
        found = [joints for joints in self._solutions(pose, near) if joints is not None]
        return min(found, key=lambda joints: float(np.abs(joints - near).max()), default=None)

    def within(self, joints: Floats) -> Floats | None:
        """Return joints, put onto limits that they exceed by rounding; None where one is beyond its limits."""
        clipped = np.clip(joints, self.limits_rad[:, 0], self.limits_rad[:, 1])
        return clipped if np.abs(clipped - joints).max() <= ROUNDING_RAD else None

    def _solutions(self, pose: Floats, near: Floats) -> Iterator[Floats | None]:
        rotation = pose[:3, :3]
        x, y, z = pose[:3, 3] - self.tool_m * rotation[:, 2] - (0.0, 0.0, self.shoulder_m)
        aside_m = math.hypot(x, y)
        distance2 = aside_m**2 + z**2
        cosine = (distance2 - self.upper_arm_m**2 - self.forearm_m**2) / (2 * self.upper_arm_m * self.forearm_m)
        if abs(cosine) > 1.0 + SINGULAR:
            return
        bend = math.acos(min(1.0, max(-1.0, cosine)))
        ahead = math.atan2(y, x) if aside_m > SINGULAR else float(near[0])
        for side, elbow in product((1.0, -1.0), (bend, -bend)):
            yaw = ahead if side > 0 else ahead + math.pi
            inner = math.atan2(self.forearm_m * math.sin(elbow), self.upper_arm_m + self.forearm_m * math.cos(elbow))
            pitch = math.atan2(side * aside_m, z) - inner
            left = (_about_z(yaw) @ _about_y(pitch + elbow)).T @ rotation
            for wrist in _wrists(left, near):
                yield self._turned(np.array([yaw, pitch, elbow, *wrist]), near)

    def _turned(self, joints: Floats, near: Floats) -> Floats | None:
        """Return the same joints, each by the whole turns that bring it nearest to `near` within its limits."""
        low, high = self.limits_rad.T
        turn = 2 * math.pi
        joints = joints + turn * np.round((near - joints) / turn)
        joints = np.where(joints > high + ROUNDING_RAD, joints - turn, joints)
        joints = np.where(joints < low - ROUNDING_RAD, joints + turn, joints)
        return self.within(joints)


def _wrists(rotation: Floats, near: Floats) -> Iterator[tuple[float, float, float]]:
    """Yield the angles about z, y, z that make a rotation; where both z axes are one, the first stays as it is."""
    sine = math.hypot(rotation[0, 2], rotation[1, 2])
    if sine < SINGULAR:
        turn = float(near[3])
        sign = 1.0 if rotation[2, 2] > 0 else -1.0
        whole = math.atan2(sign * rotation[1, 0], sign * rotation[0, 0])
        yield turn, 0.0 if sign > 0 else math.pi, whole - turn if sign > 0 else turn - whole
        return
    for sign in (1.0, -1.0):
        yield (
            math.atan2(sign * rotation[1, 2], sign * rotation[0, 2]),
            math.atan2(sign * sine, rotation[2, 2]),
            math.atan2(sign * rotation[2, 1], -sign * rotation[2, 0]),
        )


def _about_z(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_y(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def straight(start: Floats, end: Floats, count: int) -> list[Floats]:
    """Return `count` poses (4, 4) after `start` on the straight line to `end`, which turn evenly about one axis."""
    axis = _rotation_vector(start[:3, :3].T @ end[:3, :3])
    poses = []
    for share in np.arange(1, count + 1) / count:
        pose = np.eye(4)
        pose[:3, :3] = start[:3, :3] @ _rotation(axis * share)
        pose[:3, 3] = start[:3, 3] + share * (end[:3, 3] - start[:3, 3])
        poses.append(pose)
    poses[-1] = end
    return poses


def turn_rad(start: Floats, end: Floats) -> float:
    """Return the angle between the orientations of two poses (4, 4)."""
    return float(np.linalg.norm(_rotation_vector(start[:3, :3].T @ end[:3, :3])))


def _rotation_vector(rotation: Floats) -> Floats:
    """Return axis times angle, 0 … pi, of a rotation (3, 3)."""
    vector = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine, cosine = float(np.linalg.norm(vector)) / 2, (float(np.trace(rotation)) - 1) / 2
    angle = math.atan2(sine, cosine)
    if sine > 1e-6:
        return vector / (2 * sine) * angle
    if cosine > 0:
        return vector / 2
    # Half a turn: the axis is the column of R + 1 that is longest.
    columns = rotation + np.eye(3)
    longest = columns[:, int(np.linalg.norm(columns, axis=0).argmax())]
    return longest / np.linalg.norm(longest) * angle


def _rotation(vector: Floats) -> Floats:
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross: Any = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Floats = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return rotation
