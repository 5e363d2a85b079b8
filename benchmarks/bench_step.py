"""The overhead of one step: a colour, depth and segmentation observation of 640x480 from a simulator that does nothing.

The simulator takes no time, so each row is a round trip minus the simulation, until the solution has arrays of its own:
in this process; in the platform's process; through the supervisor, over TCP or a unix socket, the arrays as bytes or in
shared memory. The floor is the same number of bytes over a bare socket. The ways are measured in turn, so that each has
the same share of what else the machine does; after each step, the solution thinks for some milliseconds. With one step
at a time, each finds the processor's caches as the other ways have left them; a solution finds its own (`--steps 10`).

On a machine that is busy, look at the processor time: that of this process, the supervisor and the simulator's, for a
step and the thinking after it, in which the supervisor works out the digest of what was observed. Looking it up takes
most of what the row "in process" shows.
"""

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.api.client import Client
from benchbot.core.channels import Observations
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.geometry import Pose
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.records import Simulator
from benchbot.core.selection import Selection
from benchbot.core.session import Session
from benchbot.plugin import hookimpl
from benchbot.supervisor.platform.host import ChildHost
from benchbot.supervisor.serve import serve
from benchbot.wire.run_state import Connection, RunState
from tests.plugins.v2.v2_client import V2Client
from tests.supervisor.harness import children_of

WIDTH, HEIGHT = 640, 480
CHANNELS = ["image_rgb", "image_depth", "image_segment"]
FLOOR = "bare socket"
# An action that is over at once, since v2's client is shown something new after an action only.
ACTION, V2_ACTION = "an action: TCP, shared memory", "an action: v2's client, TCP"


class StillSimulator:
    """Stands still and shows the same picture, for free."""

    control_period_s = 0.05
    velocity = (0.0, 0.0)
    collided = False

    def __init__(self, spec: PlatformSpec) -> None:
        random = np.random.default_rng(0)
        shape = (HEIGHT, WIDTH)
        self._observations: Observations = {
            "image_rgb": random.integers(0, 255, (*shape, 3), dtype=np.uint8),
            "image_depth": random.random(shape, dtype=np.float32),
            "image_segment": {
                "class_segment_img": random.integers(0, 30, shape, dtype=np.uint8),
                "instance_segment_img": random.integers(0, 30_000, shape, dtype=np.uint16),
                "class_ids": {f"class {number}": number for number in range(30)},
            },
        }

    def load(self, scene: Scene, seed: int) -> None:
        """Do nothing."""

    def observe(self, channels: Iterable[str]) -> Observations:
        return self._observations

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Do nothing."""

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        return False

    def pose(self) -> Pose:
        return Pose()

    odometry = pose

    def clock(self) -> float:
        return 0.0

    def halt(self, why: str) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


@hookimpl
def benchbot_simulators() -> Iterable[Simulator]:
    yield Simulator("sim_still", StillSimulator)


def selection() -> Selection:
    def declared(kind: str, **data: Any) -> Declaration:
        return Declaration(kind, "still", Path("still.yaml"), "benchbot-still", {"name": "still", **data})

    return Selection(
        declared("tasks", actions=["move_distance"], observations=CHANNELS),
        declared("robots", type="sim_still", connections={}),
        (declared("environments", variant=1, type="sim_still", start_pose=[1, 0, 0, 0, 0, 0, 0]),),
        None,
    )


def install(folder: Path) -> None:
    """Make the simulator of this file a plug-in of every process that starts from here."""
    metadata = folder / "benchbot_still-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: benchbot-still\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[benchbot]\nstill = benchmarks.bench_step\n")
    root = str(Path(__file__).parent.parent)
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(folder), root, os.environ.get("PYTHONPATH")]))
    os.environ["BENCHBOT_STATE_DIR"] = str(folder / "state")
    sys.path.insert(0, str(folder))


def payload_bytes() -> int:
    return WIDTH * HEIGHT * (3 + 4 + 1 + 2)


def serve_for_parent(folder: Path) -> None:
    """Serve the run, and the bare socket that is the floor; tell both addresses on stdout."""
    floor = socket.create_server(("127.0.0.1", 0))

    def answer() -> None:
        connection, _ = floor.accept()
        blob = bytes(payload_bytes())
        while connection.recv(1):
            connection.sendall(blob)

    threading.Thread(target=answer, daemon=True).start()

    def tell(state: RunState) -> None:
        print(json.dumps({"state": state.as_dict(), "floor": floor.getsockname()[1]}), flush=True)

    serve(selection(), port=0, unix_socket=folder / "socket", on_ready=tell)


@dataclass(frozen=True)
class Cost:
    """What a call took, in milliseconds: of wall time, and of processor time with the pause after it."""

    wall_ms: float
    cpu_ms: float


def measure(
    calls: dict[str, Callable[[], object]], rounds: int, steps: int, thinking_s: float, pids: list[int]
) -> dict[str, list[Cost]]:
    """Return the costs of each call, some steps of each of them in turn in every round, with a pause after each."""
    costs: dict[str, list[Cost]] = {name: [] for name in calls}
    for number in range(rounds + 5):
        for name, call in calls.items():
            for _ in range(steps):
                cpu_before_ms, start_s = spent_ms(pids), time.perf_counter()
                call()
                wall_ms = (time.perf_counter() - start_s) * 1e3
                time.sleep(thinking_s)
                if number >= 5:
                    costs[name].append(Cost(wall_ms, spent_ms(pids) - cpu_before_ms))
    return costs


def spent_ms(pids: list[int]) -> float:
    """Return the processor time of this process and others so far (proc(5), schedstat; of this one only elsewhere)."""
    others_ns = 0
    for pid in pids:
        for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
            with suppress(OSError):  # a thread that has just ended
                others_ns += int(thread.read_text("utf-8").split()[0])
    return time.process_time_ns() / 1e6 + others_ns / 1e6


def in_process() -> InProcessHost:
    chosen = selection()
    platform = StillSimulator(PlatformSpec(chosen.robot.data, chosen.localisation, Path()))
    scenes = [Scene(scene.data, scene.path.parent) for scene in chosen.environments]
    return InProcessHost(platform, scenes, MotionConfig.from_robot(chosen.robot.data, chosen.localisation))


def bare_transfer(stack: ExitStack, port: int) -> Callable[[], None]:
    """Return what fetches the bytes of an observation over a bare socket."""
    bare = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
    buffer = bytearray(payload_bytes())

    def transfer() -> None:
        bare.sendall(b"x")
        view = memoryview(buffer)
        while view:
            view = view[bare.recv_into(view) :]

    return transfer


def step_through(connection: Connection, *, shares_memory: bool) -> Callable[[], object]:
    client = Client(connection, shares_memory=shares_memory)
    return lambda: client.step(None)


def act_as_v2(client: V2Client) -> None:
    """Take an action that is over at once, and observe, by the requests that v2's client makes."""
    client.step("move_distance", distance=0.0)
    client.transcript.clear()


def run(folder: Path, rounds: int, steps: int, thinking_s: float) -> dict[str, list[Cost]]:
    command = [sys.executable, "-m", "benchmarks.bench_step", "--serve", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, ExitStack() as stack:
        assert process.stdout is not None
        told = json.loads(process.stdout.readline())
        connection = Connection(**told["state"]["connection"])
        over_tcp = Connection(connection.url, None, connection.token)
        over_unix = Connection(None, connection.socket, connection.token)
        first = Client(over_tcp)
        first.reset()
        stack.callback(first.stop)
        v2 = V2Client(over_tcp.url or "", over_tcp.token)
        stack.callback(v2.close)
        v2.start()
        host = ChildHost(selection(), folder / "platform.log", zero_copy=True)
        stack.callback(host.close)
        host.load(0, 0)
        here = in_process()
        session = Session(selection(), in_process)
        session.reset()
        ways: dict[str, Callable[[], object]] = {
            FLOOR: bare_transfer(stack, told["floor"]),
            "in process": lambda: here.observe(CHANNELS),
            "in process, session, digest": lambda: session.step(None),
            "platform process": lambda: host.observe(CHANNELS),
            "TCP, bytes": step_through(over_tcp, shares_memory=False),
            "unix socket, bytes": step_through(over_unix, shares_memory=False),
            "TCP, shared memory": step_through(over_tcp, shares_memory=True),
            "unix socket, shared memory": step_through(over_unix, shares_memory=True),
            ACTION: lambda: first.step("move_distance", {"distance": 0.0}),
            V2_ACTION: lambda: act_as_v2(v2),
        }
        return measure(ways, rounds, steps, thinking_s, [process.pid, *children_of(process.pid), host.pid])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--steps", type=int, default=1, help="of one way after the other, before the next way's turn")
    parser.add_argument("--thinking-ms", type=float, default=4.0, help="after each step; 0 is a solution in a hurry")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers there")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve_for_parent(options.serve)
        return
    with tempfile.TemporaryDirectory(prefix="bb-") as folder:
        install(Path(folder))
        costs = run(Path(folder), options.rounds, options.steps, options.thinking_ms / 1e3)
    taken_ms = {name: np.array([cost.wall_ms for cost in paid]) for name, paid in costs.items()}
    rows = [
        {
            "what": name,
            "median_ms": float(np.median(taken_ms[name])),
            "p99_ms": float(np.percentile(taken_ms[name], 99)),
            "ratio_to_floor": float(np.median(taken_ms[name] / taken_ms[FLOOR])),
            "cpu_ms": float(np.median([cost.cpu_ms for cost in paid])),
        }
        for name, paid in costs.items()
    ]
    print(f"step(None), {WIDTH}x{HEIGHT} colour + depth + segmentation, {payload_bytes() / 1e6:.1f} MB")
    print(f"{'':<35}{'median ms':>10}{'p99 ms':>10}{'ratio':>10}{'CPU ms':>10}")
    for row in rows:
        print(
            f"{row['what']:<35}{row['median_ms']:>10.2f}{row['p99_ms']:>10.2f}{row['ratio_to_floor']:>9.1f}x"
            f"{row['cpu_ms']:>10.2f}"
        )
    ratios = taken_ms[V2_ACTION] / taken_ms[ACTION]
    print(f"v2's protocol takes {np.median(ratios):.1f} times as long as ours")
    if options.json:
        options.json.write_text(json.dumps({"bytes": payload_bytes(), "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
