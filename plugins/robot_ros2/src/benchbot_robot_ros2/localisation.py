"""The pose of the base, from its odometry, from a topic of poses, or from the transform tree."""

import math
from typing import TYPE_CHECKING, Any

from benchbot.plugin import Pose, wrap_angle_rad
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTransforms
from benchbot_robot_ros2.messages import pose_of
from benchbot_robot_ros2.streams import Sample, Stream

if TYPE_CHECKING:
    from benchbot_robot_ros2.transforms import Link, TransformTree


class Localisation:
    """Follows the base in the map frame.

    A topic that says where the base is comes late and seldom beside odometry, so it is used to correct odometry, as
    REP-105 has it: its pose, and the way that odometry has seen since then.
    """

    def __init__(
        self, robot: Ros2Robot, odometry: Stream, place: Stream | None = None, tree: "TransformTree | None" = None
    ) -> None:
        self._robot = robot
        self._odometry = odometry
        self._place = place
        self._tree = tree
        self._origin = Pose()
        self._corrected: Sample | None = None
        self._correction = Pose()
        self._told_at = Pose()
        self._held: Pose | None = None

    def start(self, start_pose: Pose) -> None:
        """Let dead reckoning begin at `start_pose`, from where odometry is now."""
        self._origin = start_pose @ self._travelled(None).inverse()
        self._corrected = self._held = None

    def odometry(self, stamp_ns: int | None = None) -> Pose:
        """Return the base's pose by dead reckoning, in the map frame: the newest, or that at a time."""
        return self._origin @ self._travelled(stamp_ns)

    def pose(self, stamp_ns: int | None = None) -> Pose:
        """Return the best known pose of the base in the map frame: the newest, or that at a time, by odometry.

        Raises LookupError, with a sentence, when the transform tree does not know it.
        """
        if self._place is not None:
            return self._correct(self._place) @ self._travelled(stamp_ns)
        if self._by_transforms is None:
            return self.odometry(stamp_ns)
        if stamp_ns is None:
            return self._by_transforms.lookup(*self._ends)
        newest_ns = self._by_transforms.newest_ns(*self._ends)
        way = self._travelled(newest_ns).inverse() @ self._travelled(stamp_ns)
        return self._by_transforms.lookup(*self._ends, newest_ns) @ way

    def step(self) -> tuple[Pose, Pose] | None:
        """Return the base's pose as localisation said it last, carried on by odometry, and as it says it now.

        None where it has said nothing before, and where the robot is localised by odometry. Raises LookupError as
        `pose`.
        """
        if self._place is not None:
            said = self._correct(self._place)
        elif self._by_transforms is not None:
            stamp_ns = self._by_transforms.newest_ns(*self._ends)
            said = self._by_transforms.lookup(*self._ends, stamp_ns) @ self._travelled(stamp_ns).inverse()
        else:
            return None
        before, self._held = self._held, said
        travelled = self._travelled(None)
        return None if before is None else (before @ travelled, said @ travelled)

    def forgive(self) -> None:
        """Take what localisation says next as it is: the robot was moved by other means than its wheels, perhaps."""
        self._held = None

    def stalest(self) -> "Link | None":
        """Return the link of the transform tree that has told nothing new for the longest; None without the tree."""
        return None if self._by_transforms is None else self._by_transforms.stalest(*self._ends)

    @property
    def unseen_m(self) -> float:
        """The distance by odometry from where a topic has told the place last; 0 without such a topic."""
        if self._place is None or self._place.newest is None:
            return 0.0
        self._correct(self._place)
        return math.hypot(*(self._told_at.inverse() @ self._travelled(None)).translation_xyz[:2])

    @property
    def _by_transforms(self) -> "TransformTree | None":
        return self._tree if isinstance(self._robot.settings.localisation, LocalisedByTransforms) else None

    @property
    def _ends(self) -> tuple[str, str]:
        return self._robot.global_frame, self._robot.base_frame

    def way(self, stamp_ns: int) -> Pose:
        """Return the base's pose now in the frame where it was at `stamp_ns`, by odometry of the last second."""
        return self._travelled(stamp_ns).inverse() @ self._travelled(None)

    def _correct(self, place: Stream) -> Pose:
        newest = place.newest
        if newest is not None and newest is not self._corrected:
            self._corrected = newest
            self._told_at = self._travelled(newest.stamp_ns)
            self._correction = base_pose(newest.message) @ self._told_at.inverse()
        return self._correction

    def _travelled(self, stamp_ns: int | None) -> Pose:
        """Return odometry's pose at a time, or the newest; the nearest one known beyond the ends of its history."""
        samples = self._odometry.samples
        if not samples:
            return Pose()
        if stamp_ns is None or stamp_ns >= samples[-1].stamp_ns:
            return base_pose(samples[-1].message)
        after = next(number for number, sample in enumerate(samples) if sample.stamp_ns >= stamp_ns)
        if after == 0:
            return base_pose(samples[0].message)
        first, second = samples[after - 1], samples[after]
        share = (stamp_ns - first.stamp_ns) / (second.stamp_ns - first.stamp_ns)
        return between(base_pose(first.message), base_pose(second.message), share)


def base_pose(message: Any) -> Pose:
    """Return the pose in a nav_msgs Odometry, or a geometry_msgs PoseStamped or PoseWithCovarianceStamped.

    Raises ValueError when it is none.
    """
    pose = message.pose
    return pose_of(pose.pose if hasattr(pose, "pose") else pose)


def apart(one: Pose, other: Pose) -> tuple[float, float]:
    """Return the distance on the floor in metres, and the turn in degrees, between two poses."""
    off = one.inverse() @ other
    return math.hypot(*off.translation_xyz[:2]), math.degrees(abs(wrap_angle_rad(off.yaw_rad)))


def between(first: Pose, second: Pose, share: float) -> Pose:
    """Return the pose at a share of the way from one pose to a near one: linear, the quaternion normalised after."""
    a, b = first.rotation_xyzw, second.rotation_xyzw
    sign = -1.0 if sum(p * q for p, q in zip(a, b, strict=True)) < 0 else 1.0
    turned = [p + share * (sign * q - p) for p, q in zip(a, b, strict=True)]
    norm = sum(value * value for value in turned) ** 0.5
    x, y, z = (p + share * (q - p) for p, q in zip(first.translation_xyz, second.translation_xyz, strict=True))
    qx, qy, qz, qw = (value / norm for value in turned)
    return Pose((x, y, z), (qx, qy, qz, qw))
