"""The driver: a real robot over ROS 2, as one platform."""

import math
import threading
from collections.abc import Iterable
from typing import cast

from benchbot.plugin import (
    OBSERVATIONS,
    REST_MPS,
    REST_RADPS,
    BenchbotError,
    FramePose,
    MotionConfig,
    Observations,
    PlatformSpec,
    Pose,
    Scene,
    did_you_mean,
    wrap_angle_rad,
)
from benchbot_robot_ros2 import battery, obstacles, signals, start_pose, take_over
from benchbot_robot_ros2.clearance import contact_ahead
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.declaration import LocalisedByOdometry, Ros2Robot
from benchbot_robot_ros2.failures import failed, safety_stop
from benchbot_robot_ros2.guard.state import FIND_OUT
from benchbot_robot_ros2.observing import STILL_FACTOR, Channel, Moment, callback_of, gather, missing
from benchbot_robot_ros2.prediction import Prediction
from benchbot_robot_ros2.ramp import REST, Velocity
from benchbot_robot_ros2.standstill import rested, still, twist

CONTROL_PERIOD_S = 0.05
# How often, in wall time, a command is repeated while its tick lasts: that of a simulated robot may last for long.
REPEAT_S = 0.03
# A tick that is nearly over is over: the rest may be rounding, which simulated time passes only with its next step.
SLACK_S = 1e-3
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

    def load(self, scene: Scene, seed: int) -> None:
        """Bring the robot to the start pose of the scene; raises BenchbotError when it does not get there."""
        if self._connected is None:
            self._connected = ConnectedRobot(self._robot, self._motion, self._callbacks, self._changed)
            self._obstacles = obstacles.Obstacles(self._connected)
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
        self._check_start()
        self._loaded_s = robot.clock.now_s()

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the requested channels, from messages that were taken after this call.

        The first observation tells what this run asks for; no more is subscribed from then on.
        """
        robot = self._here()
        self._refuse_when_stopped(robot)
        names = tuple(channels)
        wanted = [self._channel(robot, name) for name in names if name != "poses"]
        robot.subscribe(wanted)
        timing = self._robot.settings.timing
        if robot.odometry.age_s > timing.feedback_timeout_s:
            raise missing([robot.odometry])
        samples = gather(wanted, self._now(robot), timing, robot.wait(timing.wait_s))
        robot.check_feedback()
        if robot.clock.set_back_s:
            raise failed("The robot's time cannot be trusted.", *_set_back(robot.clock.set_back_s))
        decoded = {
            channel.name: channel.decode({part: sample.message for part, sample in samples[channel.name].items()})
            for channel in wanted
        }
        observed = {name: self._poses(robot) if name == "poses" else decoded[name] for name in names}
        return cast(Observations, observed)

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Hold a velocity for one tick of a schedule that does not drift.

        Raises BenchbotError(ends_run=True) when the robot was stopped for safety. After contact it only brakes.
        """
        robot = self._here()
        battery.warn(robot)
        now_s = robot.clock.now_s()
        self._due_s = (self._due_s if now_s - self._due_s < duration_s else now_s) + duration_s
        moves = abs(linear_mps) >= REST_MPS or abs(angular_radps) >= REST_RADPS
        while True:
            self._give_way(robot)
            if moves and self._hand.times > self._hand_when_believed:
                return  # this velocity is for where the robot was before a person had it
            command = Velocity(linear_mps, angular_radps) if moves and not robot.contact.is_set() else REST
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

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Return whether holding this command and then braking would touch what laser or depth camera saw last."""
        ahead, velocity = self._carry_on()
        try:
            points_xy = self._obstacles.points_xy(ahead)
        except BenchbotError as error:
            raise self._stopped(f"What is ahead of it is not known. {error.title} {error.why}", error.fix) from error
        command = (linear_mps, angular_radps)
        radius_m = self._robot.footprint_radius_m
        return contact_ahead(points_xy, radius_m, velocity, command, horizon_s, self._motion)

    def pose(self) -> Pose:
        """Return the best known pose of the base: corrected by localisation where that is declared."""
        robot = self._here()
        self._hand_when_believed = self._hand.times
        try:
            self._refuse_when_jumped(robot)
            return robot.localisation.pose() @ self._carry_on()[0]
        except (LookupError, ValueError) as error:
            raise self._lost(str(error)) from error

    def odometry(self) -> Pose:
        """Return the base's pose by dead reckoning."""
        robot = self._here()
        self._hand_when_believed = self._hand.times
        try:
            return robot.localisation.odometry() @ self._carry_on()[0]
        except ValueError as error:
            raise self._lost(str(error)) from error

    @property
    def velocity(self) -> tuple[float, float]:
        """The measured velocity; until standing still has been seen for a while, that of the last command at least."""
        measured = self._here().odometry.newest
        if measured is not None and not still(measured.message):
            return twist(measured.message)
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
            self._connected.close()
            self._connected = None

    def _begin(self, now_s: float) -> None:
        self._due_s = now_s
        self._prediction = Prediction(self._motion)
        # The last velocity that was commanded, the last that was not rest, and since when rest is commanded.
        self._command: Velocity = REST
        self._motion_command: Velocity = REST
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

    def _channel(self, robot: ConnectedRobot, name: str) -> Channel:
        if name in robot.channels:
            return robot.channels[name]
        known = [*robot.channels, "poses"]
        raise BenchbotError(
            f"The robot '{self._robot.name}' has no observation '{name}'."
            if name in OBSERVATIONS
            else f"There is no observation '{name}'.",
            f"It has: {', '.join(known)}.{did_you_mean(name, known)}",
            "Name one of these in the task, or connect it in the robot's declaration.",
        )

    def _now(self, robot: ConnectedRobot) -> Moment:
        newest = robot.odometry.newest
        return Moment(newest.stamp_ns if newest is not None else 0, robot.clock.now_s())

    def _poses(self, robot: ConnectedRobot) -> dict[str, FramePose]:
        base = self.odometry() if self._spec.localisation == "noisy" else self.pose()
        frames = {
            frame: self._start_pose if frame == INITIAL_POSE else base @ robot.mount(self._robot.names.frame(frame))
            for frame in self._robot.reported
        }
        if self._robot.camera_frame is not None:
            frames["camera"] = base @ robot.mount(self._robot.camera_frame)
        return {frame: pose.record(self._robot.map_name) for frame, pose in frames.items()}

    def _note(self, command: Velocity, now_s: float) -> None:
        if command == REST and self._command != REST:
            self._rest_commanded_s = now_s
        if command != REST:
            self._motion_command = command
        self._command = command
        self._prediction.note(command, now_s)

    def _carry_on(self) -> tuple[Pose, Velocity]:
        robot = self._here()
        return self._prediction.carry_on(robot.odometry.samples, robot.clock.now_s())

    def _check_start(self) -> None:
        settings = self._robot.settings
        if isinstance(settings.localisation, LocalisedByOdometry):
            return
        away_m, turned_deg = _apart(self._start_pose, self.pose())
        allowed = settings.start_tolerances
        if away_m > allowed.position_m or turned_deg > allowed.angle_deg:
            raise failed(
                f"The robot '{self._robot.name}' is not at the start pose.",
                f"It is {away_m:.2f} m and {turned_deg:.1f}° away from it; driver.start_tolerances allow "
                f"{allowed.position_m:g} m and {allowed.angle_deg:g}°.",
                "Bring it there, or correct its localisation (the initial pose), or allow more in the declaration.",
            )

    def _refuse_when_stopped(self, robot: ConnectedRobot) -> None:
        if self._halted is not None:
            raise self._stopped(self._halted, FIND_OUT)
        if robot.guard.tripped is not None:
            robot.guard.command(*REST)

    def _refuse_when_blind(self, robot: ConnectedRobot) -> None:
        """Stop a moving robot whose odometry, obstacles, clock or localisation are missing or too old."""
        timeout_s = self._robot.settings.timing.feedback_timeout_s
        if robot.clock.set_back_s:
            raise self._stopped(*_set_back(robot.clock.set_back_s))
        if robot.clock.still_s > STILL_FACTOR * timeout_s:
            raise self._stopped(
                f"Its simulated clock stood still for {robot.clock.still_s:.1f} s while it moved.",
                "See whether the simulator that publishes /clock is alive, and start the run again.",
            )
        for stream in robot.feedback:
            if stream.age_s > timeout_s:
                raise self._stopped(
                    f"Nothing new came on {stream.topic.ros_topic} for {stream.age_s:.1f} s while it moved "
                    f"(driver.timing.feedback_timeout_s is {timeout_s:g} s): {stream.silence()}.",
                    f"See whether what publishes {stream.topic.ros_topic} is alive and the network good, and start the "
                    "run again.",
                )
        self._refuse_when_lost(robot, timeout_s)

    def _refuse_when_lost(self, robot: ConnectedRobot, timeout_s: float) -> None:
        """Stop a moving robot whose localisation has told nothing new for too long, or too long a way."""
        link = robot.localisation.stalest()
        if link is not None and (age_s := robot.clock.now_s() - link.arrived_s) > timeout_s:
            raise self._stopped(
                f"Nothing new was said of where '{link.child}' is in '{link.parent}' for {age_s:.1f} s while it moved "
                f"(driver.timing.feedback_timeout_s is {timeout_s:g} s).",
                f"See whether what publishes the transform from '{link.parent}' to '{link.child}' on /tf is alive, and "
                "start the run again.",
            )
        bound_m, place = self._robot.settings.localisation_bounds.unseen_m, robot.place
        if place is not None and place.holds and robot.localisation.unseen_m > bound_m:
            raise self._stopped(
                f"Nothing new came on {place.topic.ros_topic} for {robot.localisation.unseen_m:.2f} m "
                f"(driver.localisation_bounds.unseen_m is {bound_m:g} m): {place.silence()}.",
                "See whether what localises the robot is alive, or allow it a longer way.",
            )

    def _refuse_when_jumped(self, robot: ConnectedRobot) -> None:
        """End the run, or before the robot moves the episode, when localisation says what odometry contradicts."""
        step = robot.localisation.step()
        if step is None:
            return
        expected, said = step
        bounds = self._robot.settings.localisation_bounds
        away_m, turned_deg = _apart(expected, said)
        if away_m <= bounds.jump_m and turned_deg <= bounds.jump_deg:
            return
        why = (
            f"Its localisation jumped by {away_m:.2f} m and {turned_deg:.0f}°, from {_place(expected)} by odometry to "
            f"{_place(said)}; driver.localisation_bounds allow {bounds.jump_m:g} m and {bounds.jump_deg:g}°."
        )
        fix = "See which of the two is right. Mend the localisation or the odometry, or allow more in the declaration."
        if self._command == REST:
            raise failed("Where the robot is, cannot be trusted.", why, fix)
        raise self._stopped(why, fix)

    def _lost(self, why: str) -> BenchbotError:
        if self._command == REST:
            return failed("Where the robot is, is not known.", f"{why}.", "Mend its localisation, and start again.")
        return self._stopped(f"Where it is, was not known while it moved: {why}.", "Mend its localisation.")

    def _stopped(self, why: str, fix: str) -> BenchbotError:
        if self._connected is None:
            return safety_stop(why, fix)
        self._connected.guard.stop(why)
        return safety_stop(self._connected.guard.tripped or why, fix)


def _apart(one: Pose, other: Pose) -> tuple[float, float]:
    """Return the distance on the floor in metres, and the turn in degrees, between two poses."""
    off = one.inverse() @ other
    return math.hypot(*off.translation_xyz[:2]), math.degrees(abs(wrap_angle_rad(off.yaw_rad)))


def _place(pose: Pose) -> str:
    x, y, _ = pose.translation_xyz
    return f"({x:.2f} m, {y:.2f} m, {math.degrees(pose.yaw_rad):.0f}°)"


def _set_back(seconds: float) -> tuple[str, str]:
    fix = (
        "Let one node only publish /clock, and do not restart the simulator during a run; on a real robot, let chrony "
        "slew the clocks instead of setting them."
    )
    return f"ROS time jumped back by {seconds:.2f} s.", fix
