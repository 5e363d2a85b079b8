"""What recording costs a step: with each recorder and without, in turn, in one run.

Recorders join and leave a run that is under way, block by block, so that each block of steps with a recorder has one
without beside it, and the same share of what else the machine does. A ratio is the median, over the pairs of blocks, of
how long a step takes with the recorder to how long it takes without.

On a machine that is busy, look at the processor time: that of the supervisor, which copies what was observed into the
queue, and that of the recorders' process, which yields to all others.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.api.client import Client
from benchbot.core.recording import RecordingNote
from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from tests.supervisor.harness import children_of

RECORDERS = ("mcap", "rerun", "video", "gif", "frames", "steps", "trajectory")
RAY_TRACED = {"task": "semantic_slam:active:ground_truth:segmentation", "robot": "carter", "environment": "miniroom:1"}
SAMPLE = {"task": "sample:active", "robot": "sample_robot", "environment": "arena:1"}
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Block:
    """What some steps took: each its milliseconds, and milliseconds of processor time of two processes a step."""

    wall_ms: float
    supervisor_ms: float
    recorder_ms: float
    dropped: int


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def turns() -> Iterator[float]:
    while True:
        yield from (4.0, -4.0)


def block(client: Client, supervisor: int, recorder: int | None, steps: int) -> tuple[float, float, float]:
    before = cpu_s(supervisor), 0.0 if recorder is None else cpu_s(recorder)
    taken_ms = []
    for _, angle in zip(range(steps), turns(), strict=False):
        start_s = time.perf_counter()
        client.step("move_angle", {"angle": angle})
        taken_ms.append((time.perf_counter() - start_s) * 1e3)
    after = cpu_s(supervisor), 0.0 if recorder is None else cpu_s(recorder)
    used = [(now - then) / steps * 1e3 for now, then in zip(after, before, strict=True)]
    return statistics.median(taken_ms), used[0], used[1]


def measure(place: dict[str, Any], names: tuple[str, ...], steps: int, rounds: int, folder: Path) -> dict[str, Any]:
    found: dict[str, list[tuple[Block, Block]]] = {name: [] for name in names}
    with Backend.start(RunRequest(**place)) as backend:
        client, host = Client(backend.state.connection), None
        host = Client(replace(backend.state.connection, token=backend.state.operator_token))
        client.reset()
        block(client, backend.pid, None, steps)
        for number in range(rounds):
            for name in names:
                free = Block(*block(client, backend.pid, None, steps), 0)
                target = folder / f"{place['robot']}-{name}-{number}"
                others = {*children_of(backend.pid)}
                host.record({name: target})
                (recorder,) = {*children_of(backend.pid)} - others
                held = block(client, backend.pid, recorder, steps)
                host.record(finish=[target])
                note = RecordingNote.read(target)
                found[name].append((free, Block(*held, -1 if note is None else note.dropped)))
    return {name: summary(pairs) for name, pairs in found.items()}


def summary(pairs: list[tuple[Block, Block]]) -> dict[str, float]:
    return {
        "wall_ratio": statistics.median(held.wall_ms / free.wall_ms for free, held in pairs),
        "free_ms": statistics.median(free.wall_ms for free, _ in pairs),
        "held_ms": statistics.median(held.wall_ms for _, held in pairs),
        "supervisor_extra_ms": statistics.mean(held.supervisor_ms - free.supervisor_ms for free, held in pairs),
        "recorder_ms": statistics.mean(held.recorder_ms for _, held in pairs),
        "dropped": sum(held.dropped for _, held in pairs),
        "pairs": [[asdict(free), asdict(held)] for free, held in pairs],  # type: ignore[dict-item]
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", choices=("carter", "sample_robot"), help="measure on one of the two")
    parser.add_argument("--recorders", default=",".join(RECORDERS))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    names = tuple(options.recorders.split(","))
    sample = str(Path(__file__).parent.parent / "tests" / "sample_plugin")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [sample, os.environ.get("PYTHONPATH")]))
    sys.path.insert(0, sample)
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BENCHBOT_STATE_DIR"] = str(Path(folder) / "state")
        for place, steps in ((RAY_TRACED, 4), (SAMPLE, 200)):
            if options.only in (None, place["robot"]):
                results[place["robot"]] = measure(place, names, steps, options.rounds, Path(folder))
    print("robot         recorder    ratio  free ms  held ms  supervisor CPU ms  recorder CPU ms  dropped")
    for robot, rows in results.items():
        for name, row in rows.items():
            print(
                f"{robot:<13} {name:<11} {row['wall_ratio']:.3f} {row['free_ms']:8.2f} {row['held_ms']:8.2f}"
                f" {row['supervisor_extra_ms']:+18.2f} {row['recorder_ms']:16.2f} {row['dropped']:8.0f}"
            )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
