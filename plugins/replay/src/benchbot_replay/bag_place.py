"""The place of a robot by a bag: its base in the map frame, at any time, as the robot's declaration localises it."""

from collections import deque
from collections.abc import Mapping
from typing import Any

from benchbot.plugin import Pose
from benchbot_replay.bag import Bag

KEPT_NS = 10_000_000_000
"""How long poses are kept."""
INITIAL_POSE = "initial_pose"


class Place:
    """Follows the base in the map frame, as the robot's declaration says that it is localised."""

    def __init__(self, bag: Bag, robot: Any) -> None:
        from benchbot_robot_ros2.transforms import TransformTree

        self._bag, self._robot = bag, robot
        self._noisy = bag.task.data.get("localisation") == "noisy"
        self._start = Pose.from_wxyz_xyz(bag.environment.data["start_pose"])
        self._tree = TransformTree()
        self._told: deque[tuple[int, Pose]] = deque()
        self._origin: Pose | None = None
        self.topics: tuple[str, ...] = ()
        self._topic: str | None = None

    def choose(self, topics: Mapping[str, str]) -> None:
        """Choose what tells the pose, of what there is in the bag; raises BenchbotError when nothing does."""
        settings = self._robot.settings
        declared = getattr(settings.localisation, "ros_topic", None)
        by = None if self._noisy else declared
        odometry = settings.odometry.ros_topic
        if by is None and (self._noisy or type(settings.localisation).__name__ == "LocalisedByOdometry"):
            by, self._origin = odometry, self._start
        self._topic = by if by in topics else None
        if self._topic is None and (self._noisy or "/tf" not in topics):
            raise self._bag.refused(
                f"Nothing in it says where the robot is: it has neither {by or 'a pose'}, as the robot's declaration "
                f"has it, nor {'odometry' if self._noisy else '/tf'}.",
                "Record this topic, too.",
            )
        self.topics = tuple(topic for topic in topics if topic in (self._topic, "/tf", "/tf_static"))

    def take(self, topic: str, message: Any) -> None:
        """Take in a message of one of the topics."""
        from benchbot_robot_ros2.localisation import base_pose
        from benchbot_robot_ros2.messages import stamp_ns

        if topic == self._topic:
            pose = base_pose(message)
            if self._origin is not None:
                if not self._told:
                    self._origin = self._start @ pose.inverse()
                pose = self._origin @ pose
            self._told.append((stamp_ns(message) or 0, pose))
            while self._told[-1][0] - self._told[0][0] > KEPT_NS:
                self._told.popleft()
            return
        for one in message.transforms:
            t, q = one.transform.translation, one.transform.rotation
            stamp = None if topic == "/tf_static" else stamp_ns(one)
            self._tree.set_transform(
                one.header.frame_id, one.child_frame_id, Pose((t.x, t.y, t.z), (q.x, q.y, q.z, q.w)), stamp
            )

    def at(self, stamp_ns: int) -> Pose | None:
        """Return the base's pose in the map frame at a time, None where it is not known, or not yet."""
        from benchbot_robot_ros2.transforms import interpolate

        if self._topic is None:
            return self._looked_up(self._robot.global_frame, self._robot.base_frame, stamp_ns)
        before = next((told for told in reversed(self._told) if told[0] <= stamp_ns), None)
        after = next((told for told in self._told if told[0] >= stamp_ns), None)
        if before is None or after is None:
            return None
        span_ns = after[0] - before[0]
        return before[1] if not span_ns else interpolate(before[1], after[1], (stamp_ns - before[0]) / span_ns)

    def record(self, base: Pose) -> dict[str, Any]:
        """Return the channel `poses`, as the robot's driver makes it."""
        robot = self._robot
        frames = {name: self._start if name == INITIAL_POSE else base @ self._mount(name) for name in robot.reported}
        if robot.camera_frame is not None:
            frames["camera"] = base @ self._mount(robot.camera_frame)
        return {name: pose.record(robot.global_frame) for name, pose in frames.items()}

    def _mount(self, frame: str) -> Pose:
        if frame == self._robot.base_frame:
            return Pose()
        if frame in self._robot.mounts:
            mount: Pose = self._robot.mounts[frame]
            return mount
        found = self._looked_up(self._robot.base_frame, frame, None)
        if found is None:
            raise self._bag.refused(
                f"Nothing says where '{frame}' is on the robot: it is neither in the declaration nor in the bag.",
                "Add it to 'frames' of the robot's declaration, or record /tf_static.",
            )
        return found

    def _looked_up(self, target: str, frame: str, stamp_ns: int | None) -> Pose | None:
        try:
            return self._tree.lookup(target, frame, stamp_ns)
        except LookupError:
            return None
