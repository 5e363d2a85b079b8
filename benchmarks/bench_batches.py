"""What a batch costs beside the simulation: per episode on a warm simulator, and against `submit` in a shell's loop.

The same episodes are computed in turns as a loop of `benchbot submit` and as batches of few and of many episodes; what
an episode costs in a batch is the difference of these two batches, so that starting workers does not count. The floor
is the simulation alone, in one process. Processor seconds are those of all processes together; the machine may be busy.
`--long N` computes a batch of N episodes and looks at its driver's memory and file handles meanwhile.
`--many N` fabricates the folder of a batch of N instead, and measures what the batch itself does with so many.

python -m benchmarks.bench_batches [--rounds N] [--long N] [--many N] [--ray-traced [--robot NAME]] [--json FILE]
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any

SAMPLE_PLUGIN = Path(__file__).parent.parent / "tests" / "sample_plugin"
COMMAND = [sys.executable, "-m", "benchbot"]
FEW, MANY = 2, 8
SAMPLE = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1")
SAMPLE_AXES = ("--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1")
RAY_TRACED = "--task", "semantic_slam:passive:ground_truth", "--env", "miniroom:1", "--robot"


@dataclass(frozen=True)
class Cost:
    """Seconds for one episode: of wall time, and of all processors together."""

    wall_s: float
    processor_s: float


def measured(act: Callable[[], object], who: int = RUSAGE_CHILDREN) -> Cost:
    """Return what it costs; `who` says whether that of this process or that of its children is counted."""
    before, start_s = getrusage(who), time.perf_counter()
    act()
    after = getrusage(who)
    used_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(time.perf_counter() - start_s, used_s)


def submit(folder: Path, what: tuple[str, ...], seed: int) -> None:
    words = ("submit", *what, "--seed", str(seed), "--example", "hello_passive", "--results-location", "result.json")
    subprocess.run([*COMMAND, *words], cwd=folder, check=True, capture_output=True)


def batch(folder: Path, what: tuple[str, ...], episodes: int, jobs: int) -> None:
    name = f"batch-{time.monotonic_ns()}"
    words = ("batch", *what, "--seeds", f"0..{episodes - 1}", "--example", "hello_passive", "-j", str(jobs), "-o", name)
    subprocess.run([*COMMAND, *words], cwd=folder, check=True, capture_output=True)


def simulate(what: tuple[str, ...]) -> Callable[[], None]:
    """Return what runs an episode of a passive task in this process, on a simulator that is loaded: nothing else."""
    from benchbot.core import plugin_manager
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.host import InProcessHost
    from benchbot.core.motion import MotionConfig
    from benchbot.core.platform import PlatformSpec, Scene
    from benchbot.core.request import RunRequest
    from benchbot.core.selection import select
    from benchbot.core.session import Session

    named = dict(zip(what[::2], what[1::2], strict=True))
    task, robot, environment = named["--task"], named["--robot"], named["--env"]
    chosen = select(Catalog(plugin_manager.load()), RunRequest(task=task, robot=robot, environment=environment))
    record = plugin_manager.load().record("simulators", chosen.robot.data["type"])
    from benchbot.core import resources

    platform = record.create(PlatformSpec(chosen.robot.data, chosen.localisation, resources.cache_dir()))
    scenes = [Scene(scene.data, scene.path.parent) for scene in chosen.environments]
    host = InProcessHost(platform, scenes, MotionConfig.from_robot(chosen.robot.data, chosen.localisation))
    session = Session(chosen, lambda: host)

    def episode() -> None:
        session.reset()
        while session.actions:
            session.step("move_next")

    episode()
    return episode


def per_episode(few: Cost, many: Cost) -> Cost:
    return Cost((many.wall_s - few.wall_s) / (MANY - FEW), (many.processor_s - few.processor_s) / (MANY - FEW))


def median(costs: list[Cost]) -> Cost:
    return Cost(statistics.median(cost.wall_s for cost in costs), statistics.median(cost.processor_s for cost in costs))


def compare(folder: Path, what: tuple[str, ...], rounds: int) -> dict[str, Cost]:
    """Return what an episode costs, all ways in turn in each round."""
    bare = simulate(what)
    submit(folder, what, 0)  # caches
    found: dict[str, list[Cost]] = {}
    for number in range(rounds):
        few, many = (measured(lambda: batch(folder, what, count, 1)) for count in (FEW, MANY))  # noqa: B023
        few_2, many_2 = (measured(lambda: batch(folder, what, 2 * count, 2)) for count in (FEW, MANY))  # noqa: B023
        pair = per_episode(few_2, many_2)
        row = {
            "the simulation alone": measured(bare, RUSAGE_SELF),
            "batch, 1 worker": per_episode(few, many),
            "batch, 2 workers": Cost(pair.wall_s / 2, pair.processor_s / 2),
            "submit in a loop": measured(lambda: submit(folder, what, number)),  # noqa: B023
        }
        for name, cost in row.items():
            found.setdefault(name, []).append(cost)
    return {name: median(costs) for name, costs in found.items()}


def show(title: str, costs: dict[str, Cost]) -> None:
    floor, loop = costs["the simulation alone"], costs["submit in a loop"]
    print(f"\n{title}: one episode")
    print(f"{'':24}{'wall s':>8}{'cpu s':>8}{'beside the simulation':>24}{'of submit':>11}")
    for name, cost in costs.items():
        beside = f"{cost.wall_s - floor.wall_s:.2f} s, {cost.processor_s - floor.processor_s:.2f} cpu s"
        ratio = cost.processor_s / loop.processor_s
        print(f"{name:24}{cost.wall_s:8.2f}{cost.processor_s:8.2f}{beside:>24}{ratio:10.2f}x")
    one, two = costs["batch, 1 worker"], costs["batch, 2 workers"]
    print(f"a batch adds {one.processor_s / floor.processor_s - 1:.1%} to the processor time of the simulation alone")
    faster, dearer = one.wall_s / two.wall_s, two.processor_s / one.processor_s
    print(f"1 → 2 workers: {faster:.2f} times as many episodes an hour, each at {dearer:.2f} times the processor time")
    print(f"(the load is {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores: on a busy machine wall time says little)")


def watch_driver(folder: Path, episodes: int) -> list[dict[str, Any]]:
    """Compute a long batch; return its driver's memory and open files as it gets on."""
    words = ("batch", *SAMPLE, "--seeds", f"0..{episodes - 1}", "--example", "hello_passive", "-j", "2", "-o", "long")
    process = subprocess.Popen([*COMMAND, *words], cwd=folder, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    rows: list[dict[str, Any]] = []
    while process.poll() is None:
        time.sleep(1)
        finished = len(list((folder / "long" / "episodes").glob("*/result.json")))
        if not rows or finished - rows[-1]["finished"] >= episodes / 10:
            try:
                status = Path(f"/proc/{process.pid}/status").read_text("utf-8")
                handles = len(list(Path(f"/proc/{process.pid}/fd").iterdir()))
            except OSError:
                break
            memory = next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS"))
            rows.append({"finished": finished, "memory_mib": int(memory) / 1024, "file_handles": handles})
            print(f"{finished:6} finished: {rows[-1]['memory_mib']:6.1f} MiB, {handles} file handles", flush=True)
    process.wait()
    return rows


def measure_many(folder: Path, episodes: int) -> list[dict[str, Any]]:
    """Return what the commands of a batch cost with so many episodes, and a worker's choices of the next one.

    Of its folder the results are fabricated: each has the bytes of one that was computed.
    """
    submit(folder, SAMPLE, 0)
    words = [*SAMPLE_AXES, "--seeds", f"0..{episodes - 1}", "--example", "hello_passive", "-j", "1"]
    rows = [command_cost("plan", folder, "batch", *words, "--dry-run", "-o", "none")]
    result = (folder / "result.json").read_bytes()
    pending = fabricate(folder / "pending", episodes, None)
    rows.append(choice_cost(pending))
    done = fabricate(folder / "done", episodes, result)
    rows.append(command_cost("status", folder, "batch", "status", str(done)))
    rows.append(command_cost("resume, finished", folder, "batch", *words, "-o", str(done)))
    rows.append(command_cost("again", folder, "batch", *words, "-o", str(done)))
    print(f"\n{episodes} episodes{'':14}{'wall s':>8}{'cpu s':>8}{'peak MiB':>10}")
    for row in rows:
        print(f"{row['what']:24}{row['wall_s']:8.2f}{row['processor_s']:8.2f}{row['peak_mib']:10.1f}")
    return rows


def command_cost(what: str, folder: Path, *words: str) -> dict[str, Any]:
    """Return what a command costs, with all that it starts, and the most memory that it needed itself."""
    start_s = time.perf_counter()
    with (folder / "said.txt").open("wb") as said:
        process = subprocess.Popen([*COMMAND, *words], cwd=folder, stdout=said, stderr=said)
        _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit((folder / "said.txt").read_text("utf-8"))
    wall_s = time.perf_counter() - start_s
    return {
        "what": what,
        "wall_s": wall_s,
        "processor_s": used.ru_utime + used.ru_stime,
        "peak_mib": used.ru_maxrss / 1024,
    }


def fabricate(path: Path, episodes: int, result: bytes | None) -> Path:
    """Make the folder of a batch, as a worker would have left it when every episode has this result; None: pending."""
    from hashlib import sha256

    from benchbot.core import plugin_manager
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.records import Resources
    from benchbot.plugins.batch import matrix, request
    from benchbot.plugins.batch.attempts import JOURNAL, RESULT
    from benchbot.plugins.batch.driver import begin
    from benchbot.plugins.batch.folder import Folder, prepare
    from benchbot.plugins.batch.worker_pool import WorkerPool

    _, task, _, robot, _, environment = SAMPLE
    wanted = {"task": task, "robots": robot, "environments": environment, "seeds": f"0..{episodes - 1}"}
    plan, _ = matrix.make(
        request.request_of({**wanted, "example": "hello_passive"}), Catalog(plugin_manager.load()), path.parent
    )
    folder = Folder(path)
    prepare(folder, plan)
    begin(folder, WorkerPool("local", 1, Resources(1, 0, None, None), {}))
    if result is not None:
        hashed = sha256(result).hexdigest()
        done = {"attempt": 1, "worker": "w", "ended": "done", "failure": None, "sha256": hashed, "duration_s": 1.0}
        for number, episode in enumerate(plan.episodes):
            place = folder.episode(episode.name)
            place.mkdir(parents=True)
            (place / RESULT).write_bytes(result)
            lines = ({"attempt": 1, "worker": "w", "began": True, "time_s": number}, {**done, "time_s": number + 1.0})
            (place / JOURNAL).write_text("".join(f"{json.dumps(line)}\n" for line in lines), "utf-8")
    return path


def choice_cost(path: Path) -> dict[str, Any]:
    """Return what it costs a worker to choose all of the episodes, one after the other."""
    from contextlib import ExitStack

    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.worker import Worker

    with ExitStack() as stack:
        worker = Worker(Folder(path), "chooses", stack)

        def choose() -> None:
            while (taken := worker._next()) is not None:
                claim, episode = taken
                worker._backend.scene = episode.scene
                worker._left.drop(episode)
                claim.release()

        cost = measured(choose, RUSAGE_SELF)
    return {"what": "a worker's choices", **asdict(cost), "peak_mib": 0.0}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3, metavar="N")
    parser.add_argument(
        "--long", type=int, metavar="N", help="instead, compute a batch of N episodes and watch its driver"
    )
    parser.add_argument(
        "--many", type=int, metavar="N", help="instead, fabricate a batch of N episodes and plan, choose, resume"
    )
    parser.add_argument("--ray-traced", action="store_true", help="on a ray-traced robot, too")
    parser.add_argument("--robot", default="carter_lowres", metavar="NAME", help="the ray-traced robot")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the numbers to this file")
    options = parser.parse_args()
    sys.path.insert(0, str(SAMPLE_PLUGIN))
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(SAMPLE_PLUGIN), os.environ.get("PYTHONPATH")]))
    document: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="bb-") as name:
        os.environ["BENCHBOT_STATE_DIR"] = f"{name}/state"
        if options.long:
            document["long"] = watch_driver(Path(name), options.long)
        elif options.many:
            document["many"] = measure_many(Path(name), options.many)
        else:
            ways = {"sample": SAMPLE, **({"ray traced": (*RAY_TRACED, options.robot)} if options.ray_traced else {})}
            for title, what in ways.items():
                costs = compare(Path(name), what, options.rounds)
                show(title, costs)
                document[title] = {way: asdict(cost) for way, cost in costs.items()}
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
