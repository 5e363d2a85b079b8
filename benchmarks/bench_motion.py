"""How fast the robot moves without being looked at: control ticks and whole actions per second of wall time.

python -m benchmarks.bench_motion [--json FILE]
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.resources import files
from itertools import cycle, islice
from pathlib import Path

from benchbot.core.declarations import schema
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_sim_taichi.simulator import RayTracedSimulator

ENVIRONMENT = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
ROBOT = Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter.yaml"
REPETITIONS = 5


@dataclass(frozen=True)
class Row:
    """One measurement; the ratio is simulated time to wall time."""

    what: str
    ticks_per_s: float
    actions_per_s: float | None
    times_real_time: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    rows = measure()
    print(f"{'motion in miniroom:1':34} {'ticks/s':>10} {'actions/s':>10} {'x real time':>12}")
    for row in rows:
        actions = "" if row.actions_per_s is None else f"{row.actions_per_s:10.1f}"
        print(f"{row.what:34} {row.ticks_per_s:10.0f} {actions:>10} {row.times_real_time:12.0f}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def measure() -> list[Row]:
    robot = schema.read(ROBOT)
    config = MotionConfig.from_robot(robot, "ground_truth")
    scene = Scene(schema.read(ENVIRONMENT), ENVIRONMENT.parent)
    platform = RayTracedSimulator(PlatformSpec(robot, "ground_truth", Path("unused")))
    period_s = platform.control_period_s

    def raw_ticks() -> int:
        # Forwards and backwards on the spot where the room is free.
        for linear_mps in islice(cycle([0.3] * 10 + [-0.3] * 10), 2000):
            platform.drive(linear_mps, 0.5, period_s)
        return 0

    def foreseen_ticks() -> int:
        for linear_mps in islice(cycle([0.3] * 10 + [-0.3] * 10), 2000):
            platform.contact_ahead(linear_mps, 0.5, period_s)
            platform.drive(linear_mps, 0.5, period_s)
        return 0

    def trajectory() -> int:
        outcomes = [execute(platform, "move_next", {}, goal, config) for goal in scene.trajectory]
        assert set(outcomes) == {Outcome.REACHED}
        return len(outcomes)

    def timed(what: str, run: Callable[[], int]) -> Row:
        walls_s = []
        for _ in range(REPETITIONS):
            platform.load(scene, seed=0)
            started_s = time.perf_counter()
            actions = run()
            walls_s.append(time.perf_counter() - started_s)
        wall_s, simulated_s = statistics.median(walls_s), platform.clock()
        return Row(
            what,
            simulated_s / period_s / wall_s,
            actions / wall_s if actions else None,
            simulated_s / wall_s,
        )

    return [
        timed("drive", raw_ticks),
        timed("drive, contact foreseen", foreseen_ticks),
        timed("whole trajectory by move_next", trajectory),
    ]


if __name__ == "__main__":
    main()
