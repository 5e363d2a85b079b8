"""How fast a robot stops, by the wall clock: whoever dies, freezes or falls silent, and whoever stops it on purpose.

python -m benchmarks stops [--trials 20] [--only WORD] [--events] [--json FILE]

The robot is a process of its own that drives at 0.4 m/s. This process records the velocities that reach it, and its
true pose. Prints the table of docs/ros2.md.
"""

import argparse
import fcntl
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import benchbot
from benchbot.core.errors import BenchbotError
from benchbot.process import tree
from benchbot_robot_ros2 import ros
from plugins.robot_ros2.tests.system.chain import PLUGIN, SELECTION, WALK, Submission, plugin_files
from plugins.robot_ros2.tests.unicycle import Unicycle, act, declaration, driver, scene, unicycle
from tests.command_line import CommandLine
from tests.plugin_factory import PluginFactory

SPEED_MPS, TRIALS, PATIENCE_S, REST_S, MOST_NOT_DRIVEN = 0.4, 20, 20.0, 0.2, 20
NEVER_S = 4.0
"""A robot that still drives so long after an event is not stopped by it."""
UDP_ONLY = Path(__file__).parents[1] / "plugins" / "robot_ros2" / "tests" / "system" / "udp_only.xml"
DEPTH = {"depth": 1.0, "depth_rows": 2}
FREE = DEPTH | {"wall_x_m": 30.0, "transforms": True, "silent": [], "untold": [], "place_off_m": 0.0}
WELL = FREE | {"held": True}
BOOL = "std_msgs/msg/Bool"
DEVICES = {
    "e_stop": {"ros_topic": "/button", "ros_type": BOOL},
    "dead_man": {"ros_topic": "/dead_man", "ros_type": BOOL},
}
STATE = "BENCHBOT_STATE_DIR"
BARS = "▁▂▃▄▅▆▇█"


def robot_declaration(*, devices: bool) -> dict[str, Any]:
    """Return a robot, with all safety devices or none, and the time-outs that a declaration has by default."""
    info = {"connection": "ros_to_api", "ros_topic": "/depth_info", "ros_type": "sensor_msgs/msg/CameraInfo"}
    robot = declaration(
        localisation={"by": "tf"},
        safety={"obstacles": ["laser", "image_depth"], **(DEVICES if devices else {})},
        timing={},
    )
    robot["limits"] |= {"linear_mps": [-SPEED_MPS, SPEED_MPS], "linear_acceleration_mps2": 2.0}
    robot["connections"] |= {
        "image_depth": {"connection": "ros_to_api", "ros_topic": "/depth", "ros_type": "sensor_msgs/msg/Image"},
        "image_depth_info": info,
    }
    return robot


def be_a_driver() -> None:
    """Drive ahead, as told by a line on stdin, until something stops it; then wait for stdin's end."""
    robot = robot_declaration(devices=True)
    with driver(robot, Path()) as platform:
        platform.load(scene(), 0)
        guard = platform._here().guard
        print(json.dumps({"guard": guard.pid, "standby": guard.standby_pid}), flush=True)
        sys.stdin.readline()
        try:
            act(platform, robot, "move_distance", distance=20.0)
        except BenchbotError as error:
            print(error.why, flush=True)
        sys.stdin.read()


class Recorder:
    """Records what the robot is told and where it is, with this machine's monotonic time."""

    def __init__(self, node: Any) -> None:
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from std_msgs.msg import Bool
        from std_srvs.srv import Trigger

        self.node, self.bool, self.trigger = node, Bool, Trigger
        self.commands: list[tuple[float, float]] = []
        self.places: list[tuple[float, float, float]] = []
        node.create_subscription(Twist, "/cmd_vel", self._on_command, 50)
        node.create_subscription(Odometry, "/truth", self._on_place, 50)
        self.button = node.create_publisher(Bool, "/button", 1)
        self.stop = node.create_publisher(Bool, "/benchbot/stop", 1)
        self.service = node.create_client(Trigger, "/benchbot/stop")
        node.create_timer(0.1, self._not_pressed)
        self.pressed = False

    def forget(self) -> None:
        self.commands.clear()
        self.places.clear()

    @property
    def speed_mps(self) -> float:
        return self.places[-1][2] if self.places else 0.0

    def _on_command(self, message: Any) -> None:
        self.commands.append((time.monotonic(), message.linear.x))

    def _on_place(self, message: Any) -> None:
        self.places.append((time.monotonic(), message.pose.pose.position.x, message.twist.twist.linear.x))

    def _not_pressed(self) -> None:
        if self.button is not None:
            self.button.publish(self.bool(data=self.pressed))


@dataclass
class Trial:
    """A robot that drives: what an event strikes, and `pids`, the processes that it may strike."""

    recorder: Recorder
    robot: Unicycle
    pids: dict[str, int]
    said: Callable[[], str]
    state_dir: Path | None = None
    commands: list["subprocess.Popen[bytes]"] = field(default_factory=list)

    def run(self, *words: str) -> None:
        """Start a command of the user, in the back."""
        variables = {**os.environ, STATE: str(self.state_dir)}
        nowhere = subprocess.DEVNULL
        self.commands.append(subprocess.Popen([sys.executable, *words], env=variables, stdout=nowhere, stderr=nowhere))

    def press(self) -> None:
        """Press the emergency stop."""
        self.recorder.pressed = True
        self.recorder._not_pressed()

    def end_button(self) -> None:
        """End what publishes the emergency stop."""
        button, self.recorder.button = self.recorder.button, None
        self.recorder.node.executor.create_task(self.recorder.node.destroy_publisher, button)

    def jump(self) -> None:
        """Put localisation off by a metre, to either side."""
        self.robot.set(place_off_m=random.choice((-1.0, 1.0)))


@dataclass(frozen=True)
class Event:
    """Something that is to stop the robot, within `goal_ms`; `whole` says that it is of a whole submission."""

    name: str
    goal_ms: int
    strike: Callable[[Trial], object]
    whole: bool = False


def killing(name: str, who: str, goal_ms: int, *, whole: bool = False) -> Iterator[Event]:
    """Yield the events of a process that is killed, and that is frozen."""
    for number, how in ((signal.SIGKILL, "is killed"), (signal.SIGSTOP, "is frozen")):
        yield Event(f"{name} {how}", goal_ms, lambda trial, number=number: os.kill(trial.pids[who], number), whole)  # type: ignore[misc]


def setting(**options: Any) -> Callable[[Trial], object]:
    """Return the strike that changes what the robot does."""
    return lambda trial: trial.robot.set(**options)


EVENTS = (
    *killing("the driver", "driver", 200),
    *killing("the guard", "guard", 100),
    *killing("the guard that stands by", "standby", 100),
    *killing("the supervisor", "supervisor", 200, whole=True),
    *killing("the solution", "solution", 200, whole=True),
    *killing("the command line", "command", 200, whole=True),
    Event("map to odom is told no more", 600, setting(untold=["odom"])),
    Event("localisation jumps by ±1 m", 600, Trial.jump),
    Event("odometry stops", 600, setting(silent=["/odom"])),
    Event("the scan stops", 600, setting(silent=["/scan"])),
    Event("depth stops", 600, setting(silent=["/depth"])),
    Event("the emergency stop is pressed", 100, Trial.press),
    Event("what publishes the emergency stop ends", 200, Trial.end_button),
    Event("the dead-man switch is released", 100, setting(held=False)),
    Event("the service benchbot/stop", 100, lambda t: t.recorder.service.call_async(t.recorder.trigger.Request())),
    Event("the topic benchbot/stop", 100, lambda t: t.recorder.stop.publish(t.recorder.bool(data=True))),
    Event("`benchbot stop`", 300, lambda trial: trial.run("-m", "benchbot", "stop"), whole=True),
    Event("`benchbot-stop`", 300, lambda trial: trial.run("-m", "benchbot.emergency_stop"), whole=True),
)


class NotDrivenError(Exception):
    """The robot did not begin to drive: a busy machine may have stopped it."""


@dataclass(frozen=True)
class Measured:
    """The times from an event to the first zero and to standstill, and the way meanwhile; NEVER_S when it drove on."""

    zero_s: float
    rest_s: float
    way_m: float


def measure(event: Event, trial: Trial) -> Measured:
    """Let a robot drive, strike at any moment, and return how it stopped."""
    recorder = trial.recorder
    until(lambda: recorder.speed_mps > 0.99 * SPEED_MPS, trial.said)
    time.sleep(random.uniform(0.05, 0.15))
    struck_s = time.monotonic()
    event.strike(trial)
    while time.monotonic() < struck_s + NEVER_S:
        time.sleep(0.02)
        if recorder.speed_mps == 0.0 and time.monotonic() - recorder.commands[-1][0] < 10 * REST_S:
            break
    time.sleep(REST_S)  # whatever comes late
    commands, places = list(recorder.commands), list(recorder.places)
    last_s = max(at_s for at_s, speed in commands if speed)
    zero_s = next((at_s for at_s, _ in commands if at_s > max(last_s, struck_s)), struck_s + NEVER_S)
    still_moving_s = max((at_s for at_s, _, speed in places if speed), default=struck_s)
    rest_s, rest_m = next(((at_s, x) for at_s, x, _ in places if at_s > still_moving_s), (struck_s + NEVER_S, 99.0))
    struck_m = min(places, key=lambda place: abs(place[0] - struck_s))[1]
    return Measured(zero_s - struck_s, rest_s - struck_s, rest_m - struck_m)


def until(condition: Callable[[], bool], said: Callable[[], str]) -> None:
    """Wait for a robot that is to drive; raises NotDrivenError with what its driver `said` when it does not."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline_s:
            raise NotDrivenError(said())
        time.sleep(0.005)


@contextmanager
def driver_alone(recorder: Recorder, robot: Unicycle) -> Iterator[Trial]:
    """Yield a trial of a driver with its guards."""
    words = [sys.executable, "-m", "benchmarks.bench_stops", "--be-a-driver"]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    pids = {"driver": process.pid}
    try:
        assert process.stdin
        assert process.stdout
        told = process.stdout.readline()
        if not told:
            raise NotDrivenError("The driver did not begin.")
        pids |= json.loads(told)
        recorder.forget()
        process.stdin.write(b"go\n")
        process.stdin.flush()
        output = process.stdout
        os.set_blocking(output.fileno(), False)
        yield Trial(recorder, robot, pids, lambda: (output.read() or b"nothing was said").decode().strip())
    finally:
        kill(*pids.values())
        process.communicate()


@contextmanager
def submitted(recorder: Recorder, robot: Unicycle) -> Iterator[Trial]:
    """Yield a trial of a whole submission: command line, supervisor, driver, guards and solution."""
    with tempfile.TemporaryDirectory() as folder:
        home, site = Path(folder), Path(folder, "site")
        site.mkdir()
        robot_files = plugin_files()
        robot_files["robots/unicycle.yaml"] = json.dumps(robot_declaration(devices=False) | {"runs_in": ["real"]})
        PluginFactory(site).make("benchbot-hall", PLUGIN, robot_files)
        variables = {
            **os.environ,
            STATE: str(home / "state"),
            "BENCHBOT_PLUGINS": "benchbot-robot-ros2,benchbot-hall",
            "PYTHONPATH": os.pathsep.join([str(site), str(Path(benchbot.__file__).parents[1])]),
        }
        cli = CommandLine(home, variables, home)
        script = cli.script("solution.py", WALK.replace("distance=4", "distance=20"))
        words = [sys.executable, "-m", "benchbot", "submit", *SELECTION, "--native", script, "-r", "result.json"]
        with (home / "output").open("wb") as output:
            process = subprocess.Popen(words, cwd=home, env=variables, stdout=output, stderr=output)
        submission = Submission(cli, process, home / "output")
        pids = {"command": process.pid}
        recorder.forget()
        try:
            until(lambda: recorder.speed_mps > 0, lambda: submission.said)
            pids |= {"supervisor": submission.supervisor, "solution": submission.solution}
            everything = [*tree(process.pid)]
            trial = Trial(recorder, robot, pids, lambda: submission.said, home / "state")
            yield trial
            for command in trial.commands:
                command.wait()
            kill(*everything)
        finally:
            kill(process.pid, *tree(process.pid))
            process.wait()


def kill(*pids: int) -> None:
    """End processes that nobody needs any more, and free the shared memory of ROS 2 that they leave."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    for lock in Path("/dev/shm").glob("fastrtps_*_el"):
        # A living process holds the lock.
        with suppress(OSError), lock.open() as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            lock.with_name(lock.name.removesuffix("_el")).unlink()
            lock.unlink()


def row(event: Event, measured: list[Measured]) -> str:
    """Return the line of the table for an event."""
    zeros, rests = ([1e3 * getattr(one, key) for one in measured] for key in ("zero_s", "rest_s"))
    way_mm = [1e3 * one.way_m for one in measured]
    cells = [f"{statistics.median(zeros):.0f}", f"{share(zeros, 0.95):.0f}", f"{max(zeros):.0f}", histogram(zeros)]
    cells += [f"{statistics.median(values):.0f}, {max(values):.0f}" for values in (rests, way_mm)]
    driven_on = sum(one.rest_s >= NEVER_S for one in measured)
    name = f"{event.name} **({driven_on} drove on)**" if driven_on else event.name
    return f"| {name} | {event.goal_ms} | {' | '.join(cells)} |"


def share(values: list[float], part: float) -> float:
    """Return the smallest value that this part of all values does not exceed."""
    return sorted(values)[max(0, -int(-part * len(values) // 1) - 1)]


def histogram(values: list[float], bins: int = 10) -> str:
    """Return bars of how many values lie in each tenth from zero to the largest."""
    counts, largest = [0] * bins, max(values)
    for value in values:
        counts[min(bins - 1, int(bins * value / largest))] += 1
    return "".join(BARS[round((len(BARS) - 1) * count / max(counts))] if count else "·" for count in counts)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks stops", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trials", type=int, default=TRIALS, metavar="N", help="of each event [default: 20]")
    parser.add_argument("--only", metavar="WORD", help="the events with this word in their name")
    parser.add_argument("--events", action="store_true", help="list the events, and end")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    parser.add_argument("--be-a-driver", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.be_a_driver:
        be_a_driver()
        return
    events = [event for event in EVENTS if options.only is None or options.only in event.name]
    if options.events:
        print(*(event.name for event in events), sep="\n")
        return
    # Loopback only, and a domain of its own. By UDP, as to a robot: shared memory suffers when processes are killed.
    os.environ |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": "97"}
    os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(UDP_ONLY)
    figures: dict[str, list[list[float]]] = {}
    not_driven: list[str] = []
    print("| event | goal | to zero: median | 95 % | max | | to rest: median, max | way in mm: median, max |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with ExitStack() as stack:
        robot = stack.enter_context(unicycle(**WELL))
        recorder = Recorder(stack.enter_context(ros.running_node("bench_recorder")))
        for event in events:
            measured: list[Measured] = []
            for number in range(options.trials):
                progress(f"{event.name}: {number + 1} of {options.trials}")
                while len(measured) <= number:
                    try:
                        with (submitted if event.whole else driver_alone)(recorder, robot) as trial:
                            measured.append(measure(event, trial))
                    except NotDrivenError as error:
                        not_driven.append(f"{event.name}: {error}")
                        if len(not_driven) > MOST_NOT_DRIVEN:
                            raise
                robot.set(**WELL)
                recorder.pressed = False
                recorder.button = recorder.button or recorder.node.create_publisher(recorder.bool, "/button", 1)
            progress("")
            print(row(event, measured), flush=True)
            figures[event.name] = [[one.zero_s, one.rest_s, one.way_m] for one in measured]
    for line in not_driven:
        print(f"Stopped before anything had happened, and tried again: {line}", file=sys.stderr)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def progress(text: str) -> None:
    """Show what is done now, where somebody watches."""
    if sys.stderr.isatty():
        print(f"\r{text:<70}\r", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
