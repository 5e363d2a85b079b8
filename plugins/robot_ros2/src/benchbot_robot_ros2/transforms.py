"""The transform tree of a robot: /tf and /tf_static, looked up through any chain of frames at any time."""

import math
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from benchbot.plugin import Pose, Quaternion, did_you_mean
from benchbot_robot_ros2.ros import HERE

if TYPE_CHECKING:
    from rclpy.node import Node

HISTORY_NS = 10_000_000_000
# How far the square of a quaternion's length may be from 1: what tf2 accepts.
_UNIT_TOLERANCE = 0.01


class TwoTreesError(LookupError):
    """Two frames are known, and nothing connects them."""


class Link(NamedTuple):
    """A transform that is not static: its frames, and when its newest stamp arrived, in seconds of the run."""

    child: str
    parent: str
    arrived_s: float


@dataclass
class _Edge:
    """A frame's poses in its parent frame, by rising stamp; a static one has one pose and no stamp.

    `arrived_s` is when the newest stamp arrived: one that is sent again and again is nothing new.
    """

    parent: str
    arrived_s: float = -math.inf
    stamps_ns: list[int] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)

    def add(self, stamp_ns: int, pose: Pose, arrived_s: float) -> None:
        """Put a pose into its place in time, and forget those that are too old."""
        if not self.stamps_ns or stamp_ns > self.stamps_ns[-1]:
            self.arrived_s = arrived_s
        if self.stamps_ns and stamp_ns < self.stamps_ns[-1] - HISTORY_NS:
            # So late is nothing but a clock that was set back.
            self.stamps_ns.clear()
            self.poses.clear()
        place = bisect_left(self.stamps_ns, stamp_ns)
        if place < len(self.stamps_ns) and self.stamps_ns[place] == stamp_ns:
            self.poses[place] = pose
            return
        self.stamps_ns.insert(place, stamp_ns)
        self.poses.insert(place, pose)
        old = bisect_left(self.stamps_ns, self.stamps_ns[-1] - HISTORY_NS)
        del self.stamps_ns[:old], self.poses[:old]

    def at(self, child: str, stamp_ns: int | None) -> Pose:
        """Return the pose at a time, or the one of a static frame; raises LookupError outside of what is known."""
        if not self.stamps_ns or stamp_ns is None:
            return self.poses[-1]
        first, last = self.stamps_ns[0], self.stamps_ns[-1]
        if not first <= stamp_ns <= last:
            off, side = (first - stamp_ns, "before") if stamp_ns < first else (stamp_ns - last, "after")
            raise LookupError(
                f"The pose of '{child}' in '{self.parent}' is known from {first / 1e9:.3f} s to {last / 1e9:.3f} s; "
                f"{stamp_ns / 1e9:.3f} s is {off / 1e9:.3f} s {side} that."
            )
        place = bisect_left(self.stamps_ns, stamp_ns)
        if self.stamps_ns[place] == stamp_ns:
            return self.poses[place]
        start = self.stamps_ns[place - 1]
        fraction = (stamp_ns - start) / (self.stamps_ns[place] - start)
        return interpolate(self.poses[place - 1], self.poses[place], fraction)


class TransformTree:
    """Poses of frames in their parent frames, of the last ten seconds. May be used from several threads."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}
        self._lock = threading.Lock()

    def set_transform(self, parent: str, child: str, pose: Pose, stamp_ns: int | None, arrived_s: float = 0.0) -> None:
        """Take in the pose of `child` in `parent` at a time, or at all times: a static one, without stamp.

        A child that comes with another parent than before leaves that one, and its history. Raises ValueError when
        the two are one frame, a name is empty, or the numbers are no pose.
        """
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        if not parent or not child or parent == child:
            raise ValueError(f"a transform from '{child}' to '{parent}' leads nowhere")
        pose = _checked(pose, child, parent)
        with self._lock:
            edge = self._edges.get(child)
            if edge is None or edge.parent != parent or (stamp_ns is None) != (not edge.stamps_ns):
                edge = self._edges[child] = _Edge(parent)
            if stamp_ns is None:
                edge.poses = [pose]
            else:
                edge.add(stamp_ns, pose, arrived_s)

    def lookup(self, target_frame: str, source_frame: str, stamp_ns: int | None = None) -> Pose:
        """Return the pose of `source_frame` in `target_frame`, interpolated to a time.

        Without a time it is the newest that the whole chain between the two is known at. Raises LookupError saying
        which frame is unknown, where the chain is broken, or how far a time is outside of what is known.
        """
        with self._lock:
            to_target, to_source = self._chain_between(target_frame, source_frame)
            if stamp_ns is None:
                stamp_ns = self._newest_ns((*to_target, *to_source))
            target = self._compose(to_target, stamp_ns)
            source = self._compose(to_source, stamp_ns)
        return target.inverse() @ source

    def newest_ns(self, target_frame: str, source_frame: str) -> int | None:
        """Return the newest time at which `lookup` has the two frames; None if all transforms between them are static.

        Raises LookupError as `lookup` does.
        """
        with self._lock:
            to_target, to_source = self._chain_between(target_frame, source_frame)
            return self._newest_ns((*to_target, *to_source))

    def stalest(self, target_frame: str, source_frame: str) -> Link | None:
        """Return the link between two frames whose newest stamp is the longest ago; None if all are static.

        Raises LookupError as `lookup` does.
        """
        with self._lock:
            to_target, to_source = self._chain_between(target_frame, source_frame)
            edges = {child: self._edges[child] for child in (*to_target, *to_source)}
            links = [Link(child, edge.parent, edge.arrived_s) for child, edge in edges.items() if edge.stamps_ns]
        return min(links, key=lambda link: link.arrived_s, default=None)

    def clear(self) -> None:
        """Drop all but the static transforms, after a clock was set back or the robot was moved by hand."""
        with self._lock:
            self._edges = {child: edge for child, edge in self._edges.items() if not edge.stamps_ns}

    def _chain_between(self, target_frame: str, source_frame: str) -> tuple[list[str], list[str]]:
        """Return the frames to climb from each of the two to the nearest frame above both."""
        above_target = self._upwards(target_frame)
        above_source = self._upwards(source_frame)
        common = next((frame for frame in above_target if frame in above_source), None)
        if common is None:
            raise TwoTreesError(
                f"Nothing says where '{source_frame}' is in '{target_frame}': they are in two trees, under "
                f"'{above_source[-1]}' and '{above_target[-1]}'."
            )
        return above_target[: above_target.index(common)], above_source[: above_source.index(common)]

    def _upwards(self, frame: str) -> list[str]:
        """Return a frame and those above it, up to its root."""
        frame = frame.removeprefix("/")
        chain = [frame]
        while (edge := self._edges.get(chain[-1])) is not None:
            if edge.parent in chain:
                circle = " in ".join(f"'{name}'" for name in [*chain[chain.index(edge.parent) :], edge.parent])
                raise LookupError(f"The transforms go round in a circle: {circle}.")
            chain.append(edge.parent)
        if len(chain) == 1 and not any(edge.parent == frame for edge in self._edges.values()):
            known = sorted({name for child, edge in self._edges.items() for name in (child, edge.parent)})
            names = f"Known: {', '.join(known)}." if known else "None is known at all: nothing has been received."
            raise LookupError(f"No transform names the frame '{frame}'.{did_you_mean(frame, known)} {names}")
        return chain

    def _newest_ns(self, chain: Iterable[str]) -> int | None:
        return min((edge.stamps_ns[-1] for edge in map(self._edges.__getitem__, chain) if edge.stamps_ns), default=None)

    def _compose(self, chain: Iterable[str], stamp_ns: int | None) -> Pose:
        """Return the pose of a chain's first frame in the parent of its last."""
        pose = Pose()
        for frame in chain:
            pose = self._edges[frame].at(frame, stamp_ns) @ pose
        return pose


def listen(
    node: "Node", now_s: Callable[[], float] = time.monotonic, topics: tuple[str, str] = HERE.transforms
) -> TransformTree | None:
    """Return a tree that takes in what is published on /tf and /tf_static; None when tf2_msgs is not installed.

    `topics` are the names of these two for a robot that has its own.

    The subscriptions live as long as the node, with the quality of service of tf2_ros's listener. `now_s` tells the
    time at which a transform arrives. A transform that is none is left out, with a warning.
    """
    try:
        from tf2_msgs.msg import TFMessage
    except ModuleNotFoundError:
        return None
    from rclpy.qos import DurabilityPolicy, QoSProfile

    tree = TransformTree()

    def take(message: Any, *, static: bool) -> None:
        for transform in message.transforms:
            stamp = transform.header.stamp
            stamp_ns = None if static else stamp.sec * 1_000_000_000 + stamp.nanosec
            try:
                frames = (transform.header.frame_id, transform.child_frame_id)
                tree.set_transform(*frames, _pose(transform.transform), stamp_ns, now_s())
            except ValueError as error:
                node.get_logger().warning(f"A transform was left out: {error}.", throttle_duration_sec=10.0)

    node.create_subscription(TFMessage, topics[0], lambda message: take(message, static=False), QoSProfile(depth=100))
    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(TFMessage, topics[1], lambda message: take(message, static=True), latched)
    return tree


def interpolate(start: Pose, end: Pose, fraction: float) -> Pose:
    """Return the pose a fraction of the way from `start` to `end`: straight on, turning evenly the shorter way round.

    Spherical linear interpolation: K. Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.
    """
    a, b = start.rotation_xyzw, end.rotation_xyzw
    cosine = sum(p * q for p, q in zip(a, b, strict=True))
    sign = math.copysign(1.0, cosine)
    angle = math.acos(min(1.0, abs(cosine)))
    # So near each other a straight line is exact to rounding, and sin(angle) divides by nothing.
    near, far = 1 - fraction, fraction
    if angle > 1e-6:
        near, far = math.sin(near * angle) / math.sin(angle), math.sin(far * angle) / math.sin(angle)
    x, y, z = (p + (q - p) * fraction for p, q in zip(start.translation_xyz, end.translation_xyz, strict=True))
    qx, qy, qz, qw = (near * p + sign * far * q for p, q in zip(a, b, strict=True))
    return Pose((x, y, z), _normalised((qx, qy, qz, qw)))


def _pose(transform: Any) -> Pose:
    """Return a geometry_msgs/msg/Transform as a pose."""
    t, q = transform.translation, transform.rotation
    return Pose((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))


def _checked(pose: Pose, child: str, parent: str) -> Pose:
    if not all(map(math.isfinite, (*pose.translation_xyz, *pose.rotation_xyzw))):
        raise ValueError(f"the transform from '{child}' to '{parent}' has a number that is none")
    if abs(sum(value * value for value in pose.rotation_xyzw) - 1) > _UNIT_TOLERANCE:
        raise ValueError(f"the transform from '{child}' to '{parent}' has no unit quaternion: {pose.rotation_xyzw}")
    return Pose(pose.translation_xyz, _normalised(pose.rotation_xyzw))


def _normalised(quaternion: Quaternion) -> Quaternion:
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / norm, y / norm, z / norm, w / norm)
