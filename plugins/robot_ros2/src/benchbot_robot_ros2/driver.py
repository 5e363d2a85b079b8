"""The driver: a real robot over ROS 2, as one platform."""

import threading
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any, cast

from benchbot.plugin import (
    REST_MPS,
    REST_RADPS,
    BenchbotError,
    FramePose,
    MotionConfig,
    Observations,
    Outcome,
    PlatformSpec,
    Pose,
    Scene,
)
from benchbot_robot_ros2 import battery, freshness, obstacles, signals, start_pose, take_over
from benchbot_robot_ros2.arm_motion import ArmMotion
from benchbot_robot_ros2.clearance import contact_ahead
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.control_tick import CONTROL_PERIOD_S, REPEAT_S, SLACK_S
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByOdometry
from benchbot_robot_ros2.failures import failed, safety_stop
from benchbot_robot_ros2.guard.state import FIND_OUT
from benchbot_robot_ros2.navigated_motion import NavigatedMotion, Watch, navigated_by
from benchbot_robot_ros2.observing import Moment, callback_of, catch_up, gather, missing, taken_ns
from benchbot_robot_ros2.prediction import Prediction
from benchbot_robot_ros2.provenance import provenance
from benchbot_robot_ros2.ramp import REST, Velocity
from benchbot_robot_ros2.standstill import measured_velocity, rested, speed_mps, still

INITIAL_POSE = "initial_pose"


class Ros2Driver:
    """Implements `benchbot.core.platform.Platform` over ROS 2, in the robot's time.

    The robot is connected at the first `load` and stays so. Whatever goes wrong while it moves stops it for good.
    """

    def __init__(self, spec: PlatformSpec) -> None:
        self._spec = spec
        self._robot = Ros2Robot.from_declaration(spec.robot)
        self._motion = MotionConfig.from_robot(spec.robot, spec.localisation)
        self._callbacks = {
            name: callback_of(self._robot.name, name, connection)
            for name, connection in self._robot.observations.items()
            if connection.parts()
        }
        obstacles.check_declared(self._robot, self._motion)
        signals.check(self._robot)
        self._changed = threading.Condition()
        self._connected: ConnectedRobot | None = None
        self._navigated: NavigatedMotion | None = None
        self._arm: ArmMotion | None = None
        self._halted: str | None = None
        self._start_pose = Pose()
        self._loaded_s = self._due_s = 0.0
        self._hand = take_over.TakenOver()
        self._hand_when_believed = 0
        self._begin(0.0)

    @property
    def control_period_s(self) -> float:
        """20 Hz, as in v2."""
        return CONTROL_PERIOD_S

    @property
    def heartbeat_timeout_s(self) -> float:
        """The declared `timing.heartbeat_timeout_s`."""
        return self._robot.settings.timing.heartbeat_timeout_s

    def load(self, scene: Scene, seed: int) -> None:
        """Bring the robot to the start pose of the scene; raises BenchbotError when it does not get there."""
        if self._connected is None:
            robot = self._connected = ConnectedRobot(self._robot, self._motion, self._callbacks, self._changed)
            self._obstacles = obstacles.Obstacles(robot)
            if self._robot.arm is not None:
                self._arm = ArmMotion(robot, self._robot.arm, CONTROL_PERIOD_S, self._motion.speed_factor)
            self._navigated = navigated_by(robot, self._watch(robot))
        robot = self._connected
        self._refuse_when_stopped(robot)
        battery.check(robot)
        start_pose.return_to_start(robot.node, self._robot, scene, seed, self._spec.ask, robot.guard)
        earlier_s = self._hand.take()
        # To drive it to its start by hand is no part of the trial.
        self._give_way(robot)
        self._hand = take_over.TakenOver(earlier_s)
        robot.await_rest(lambda: self._refuse_when_stopped(robot))
        robot.check_feedback()
        self._begin(robot.clock.now_s())
        self._start_pose = scene.start_pose
        robot.localisation.start(self._start_pose)
        start_pose.tell_localisation(robot, scene)
        if not isinstance(self._robot.settings.localisation, LocalisedByOdometry):
            start_pose.check_start(self._robot, scene, self.pose())
        self._loaded_s = robot.clock.now_s()

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the requested channels, from messages that were taken after this call.

        The first observation tells what this run asks for; no more is subscribed from then on.
        """
        robot = self._here()
        self._refuse_when_stopped(robot)
        names = tuple(channels)
        wanted = [robot.channel(name) for name in names if name != "poses"]
        robot.subscribe(wanted)
        timing = self._robot.settings.timing
        if robot.odometry.age_s > timing.feedback_timeout_s:
            raise missing([robot.odometry])
        newest = robot.odometry.newest
        now = Moment(newest.stamp_ns if newest is not None else 0, robot.clock.now_s())
        samples = gather(wanted, now, timing, robot.wait(timing.wait_s))
        robot.check_feedback()
        if robot.clock.set_back_s:
            raise failed("The robot's time cannot be trusted.", *freshness.set_back(robot.clock.set_back_s))
        decoded = {
            channel.name: channel.decode({part: sample.message for part, sample in samples[channel.name].items()})
            for channel in wanted
        }
        stamp_ns = taken_ns(wanted, samples)
        observed = {name: self._poses(robot, stamp_ns) if name == "poses" else decoded[name] for name in names}
        return cast(Observations, observed)

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Hold a velocity for one tick of a schedule that does not drift.

        Raises BenchbotError(ends_run=True) when the robot was stopped for safety. After contact it only brakes.
        """
        self._hold(Velocity(linear_mps, angular_radps), duration_s)

    def drive_sideways(
        self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float = 0.0
    ) -> None:
        """Hold a velocity of a holonomic base to its left, as `drive` does."""
        self._hold(Velocity(linear_mps, angular_radps, lateral_mps), duration_s)

    def _hold(self, wanted: Velocity, duration_s: float) -> None:
        robot = self._here()
        battery.warn(robot)
        now_s = robot.clock.now_s()
        self._due_s = (self._due_s if now_s - self._due_s < duration_s else now_s) + duration_s
        moves = (
            max(abs(wanted.linear_mps), abs(wanted.lateral_mps)) >= REST_MPS or abs(wanted.angular_radps) >= REST_RADPS
        )
        while True:
            self._give_way(robot)
            if moves and self._hand.times > self._hand_when_believed:
                return  # this velocity is for where the robot was before a person had it
            command = wanted if moves and not robot.contact.is_set() else REST
            self._note(command, robot.clock.now_s())
            self._refuse_when_stopped(robot)
            if self._command != REST:
                self._refuse_when_blind(robot)
            robot.guard.command(*self._command)
            with self._changed:
                left_s = self._due_s - robot.clock.now_s()
                if left_s < SLACK_S:
                    return
                self._changed.wait(min(left_s, REPEAT_S))

    def navigate(self, goal: Pose) -> Iterator[Outcome | None]:
        """Let Nav2 drive to a pose, where that is declared, under all that watches over a moving robot.

        Yields None after every control tick, and the outcome at rest; nothing where motion is by velocity. Raises
        BenchbotError(ends_run=True) when the robot was stopped for safety, or does not stop when it is called off.
        """
        if self._navigated is None:
            return
        self._refuse_when_stopped(self._here())
        here = self.pose()
        if self._spec.localisation == "noisy":
            # To where dead reckoning will find the goal, as far as it has drifted now.
            goal = here @ self.odometry().inverse() @ goal
        yield from self._navigated.carry_out(here, goal)

    def manipulate(self, action: str, arguments: Mapping[str, Any]) -> Iterator[Outcome | None]:
        """Move the arm, tick by tick, while the base is held and watched; yield at the end how it ended.

        Raises BenchbotError(ends_run=True) when the robot was stopped for safety: it gets no more setpoints then.
        """
        robot, arm = self._here(), self._arm
        if arm is None or action not in self._robot.arm_commands:
            raise failed(f"The robot '{self._robot.name}' cannot '{action}'.", "It is not connected.", "Declare it.")
        while True:
            handed = self._hand.times
            for ended in arm.carry_out(action, arguments):
                if ended is not None:
                    yield ended
                    return
                self.drive(0.0, 0.0, CONTROL_PERIOD_S)
                self._refuse_when_blind(robot)
                yield None
                if self.collided:
                    arm.hold(action)
                    yield Outcome.COLLIDED
                    return
                if self._hand.times != handed:
                    break  # a person had the robot: from where the arm is now

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command and then braking would touch what its sensors saw last."""
        return self._touches(Velocity(linear_mps, angular_radps), horizon_s)

    def contact_beside(self, lateral_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command sideways and then braking would touch what its sensors saw last."""
        return self._touches(Velocity(0.0, angular_radps, lateral_mps), horizon_s)

    def _touches(self, command: Velocity, horizon_s: float) -> bool:
        ahead, velocity = self._carry_on()
        try:
            points_xy = self._obstacles.points_xy(ahead)
        except BenchbotError as error:
            raise self._stopped(f"What is ahead of it is not known. {error.title} {error.why}", error.fix) from error
        return contact_ahead(points_xy, self._robot.footprint, velocity, command, horizon_s, self._motion)

    def pose(self, stamp_ns: int | None = None) -> Pose:
        """Return the best known pose of the base, now or then: corrected by localisation where that is declared."""
        robot = self._here()
        self._hand_when_believed = self._hand.times
        try:
            self._refuse_when_jumped(robot)
            return robot.localisation.pose(stamp_ns) @ self._carry_on(stamp_ns)[0]
        except (LookupError, ValueError) as error:
            raise self._lost(str(error)) from error

    def odometry(self, stamp_ns: int | None = None) -> Pose:
        """Return the base's pose by dead reckoning, now or then."""
        robot = self._here()
        self._hand_when_believed = self._hand.times
        try:
            return robot.localisation.odometry(stamp_ns) @ self._carry_on(stamp_ns)[0]
        except ValueError as error:
            raise self._lost(str(error)) from error

    @property
    def velocity(self) -> tuple[float, float]:
        """The measured velocity; until standing still has been seen for a while, that of the last command at least.

        Of a base that is not holonomic, the first is how fast it moves in any direction: it may be pushed, or slide.
        """
        return self._velocity[:2]

    @property
    def lateral_mps(self) -> float:
        """The velocity of a holonomic base to its left, known as `velocity` is; 0 of any other."""
        return self._velocity.lateral_mps

    @property
    def _velocity(self) -> Velocity:
        measured = self._here().odometry.newest
        if measured is not None and not still(measured.message):
            velocity = measured_velocity(measured.message)
            if self._motion.lateral_limit_mps:
                return velocity
            return Velocity(speed_mps(measured.message), velocity.angular_radps)
        at_rest = self._command == REST and rested(
            self._here().odometry.samples, self._rest_commanded_s + self._prediction.dead_time_s
        )
        return REST if at_rest else self._motion_command

    @property
    def collided(self) -> bool:
        """True if the robot's collision topic has reported contact since `load`."""
        return self._here().contact.is_set()

    def clock(self) -> float:
        """Return the seconds since `load`, in the robot's time."""
        return self._here().clock.now_s() - self._loaded_s - self._hand.paused_s

    def taken_over_s(self) -> tuple[float, ...]:
        """Return for how long a person had the robot, each time since this was asked last, in seconds."""
        return self._hand.take()

    def provenance(self) -> dict[str, Any]:
        """Return what a result depends on beside the declaration: middleware, network, subscriptions, clocks."""
        return provenance(self._spec.robot, self._robot.graph, self._here().streams)

    def halt(self, why: str) -> None:
        """Stop the robot at once; the action under way, and every later one, raises."""
        self._halted = self._halted or why
        if self._connected is not None:
            self._connected.guard.stop(why)
        with self._changed:
            self._changed.notify_all()

    def close(self) -> None:
        """Stop the robot and leave the graph."""
        if self._connected is not None:
            if self._navigated is not None:
                self._navigated.close()
            self._connected.close()
            self._connected = self._navigated = self._arm = None

    def _begin(self, now_s: float) -> None:
        self._due_s = now_s
        self._prediction = Prediction(self._motion)
        # The last velocity that was commanded, the last that was not rest, and since when rest is commanded.
        self._command = self._motion_command = REST
        self._rest_commanded_s = now_s

    def _here(self) -> ConnectedRobot:
        if self._connected is None:
            raise failed(f"The robot '{self._robot.name}' is not connected.", "Nothing was loaded.", "Call reset().")
        self._give_way(self._connected)
        return self._connected

    def _give_way(self, robot: ConnectedRobot) -> None:
        """Wait while a person has the robot; it goes on from where it is then."""
        if not robot.guard.hand.yielded or self._halted is not None or robot.guard.tripped is not None:
            return
        self._note(REST, robot.clock.now_s())
        self._hand.wait(robot, lambda: self._refuse_when_stopped(robot), self._spec.tell)
        self._begin(robot.clock.now_s())

    def _watch(self, robot: ConnectedRobot) -> Watch:
        """Return what a robot that Nav2 drives is watched over by."""
        refuse = partial(self._refuse_when_stopped, robot)

        def look() -> None:
            refuse()
            self._refuse_when_blind(robot)
            self.pose()  # where it must not have jumped

        def found() -> Outcome | None:
            if self.collided:
                return Outcome.COLLIDED
            sees = self._motion.stops_before_contact
            return Outcome.BLOCKED if sees and self._touches(self._command, CONTROL_PERIOD_S) else None

        return Watch(refuse, look, self._note, found, self._stopped_as)

    def _poses(self, robot: ConnectedRobot, stamp_ns: int | None) -> dict[str, FramePose]:
        moving_ns = None if self._velocity == REST else stamp_ns
        catch_up(robot.odometry, moving_ns, robot.wait(self._robot.settings.timing.feedback_timeout_s))
        base = self.odometry(moving_ns) if self._spec.localisation == "noisy" else self.pose(moving_ns)
        frames = {
            frame: self._start_pose if frame == INITIAL_POSE else base @ robot.mount(self._robot.names.frame(frame))
            for frame in self._robot.reported
        }
        if self._robot.camera_frame is not None:
            frames["camera"] = base @ robot.mount(self._robot.camera_frame)
        return {frame: pose.record(self._robot.map_name) for frame, pose in frames.items()}

    def _note(self, command: Velocity, now_s: float, *, is_seen: bool = False) -> None:
        if command == REST and self._command != REST:
            self._rest_commanded_s = now_s
        if command != REST:
            self._motion_command = command
        self._command = command
        self._prediction.note(command, now_s, is_seen=is_seen)

    def _carry_on(self, stamp_ns: int | None = None) -> tuple[Pose, Velocity]:
        robot = self._here()
        if stamp_ns is not None:
            return Pose(), REST  # odometry itself tells what has been
        return self._prediction.carry_on(robot.odometry.samples, robot.clock.now_s())

    def _refuse_when_stopped(self, robot: ConnectedRobot) -> None:
        if self._halted is not None:
            raise self._stopped(self._halted, FIND_OUT)
        if robot.guard.tripped is not None:
            robot.guard.command(*REST)

    def _refuse_when_blind(self, robot: ConnectedRobot) -> None:
        """Stop a moving robot whose odometry, obstacles, clock or localisation are missing or too old."""
        if (reason := freshness.blindness(robot)) is not None:
            raise self._stopped(*reason)

    def _refuse_when_jumped(self, robot: ConnectedRobot) -> None:
        """End the run, or before the robot moves the episode, when localisation says what odometry contradicts."""
        if (reason := freshness.jump(robot)) is not None:
            if self._moves:
                raise self._stopped(*reason)
            raise failed("Where the robot is, cannot be trusted.", *reason)

    def _lost(self, why: str) -> BenchbotError:
        if not self._moves:
            return failed("Where the robot is, is not known.", f"{why}.", "Mend its localisation, and start again.")
        return self._stopped(f"Where it is, was not known while it moved: {why}.", "Mend its localisation.")

    @property
    def _moves(self) -> bool:
        return (self._navigated is not None and self._navigated.is_under_way) or self._command != REST

    def _stopped(self, why: str, fix: str) -> BenchbotError:
        if self._connected is None:
            return safety_stop(why, fix)
        self._connected.guard.stop(why)
        return safety_stop(self._connected.guard.tripped or why, fix)

    def _stopped_as(self, why: str, fix: str) -> BenchbotError:
        """Stop the robot for good, and say this, whatever stopped it before."""
        self._here().guard.stop(why)
        return safety_stop(why, fix)
