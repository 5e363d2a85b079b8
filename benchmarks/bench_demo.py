"""Where the seconds of `make demo` go: for each of its processes, the wall and processor seconds of what it does.

Every Python process of the demo times the functions that SPANS names, and its imports (`spans/sitecustomize.py`). What
passes inside another span counts there alone. "Everything else" has the threads that are not Python's, too: the ray
tracer takes its pictures there. Waits are rows of their own: what is waited for is a row of another process. Figures
are the medians of the repetitions.

With `--against FOLDER` another checkout runs it, too, in turns, with the same interpreter and a cache of its own. A
cache that is empty (`--cold`) is emptied before each run. The score is printed, since no saving may change it.

python -m benchmarks.bench_demo [--repetitions N] [--cold] [--against FOLDER] [--json FILE]
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import Any

ROOT = Path(__file__).parents[1]
BENCHBOT = str(Path(sys.executable).with_name("benchbot"))
TASK = "semantic_slam:passive:ground_truth:segmentation"
SUBMIT = ["submit", "--task", TASK, "--robot", "carter", "--env", "miniroom:1", "--example", "segmentation_mapper"]
SUBMIT += ["--record", "frames=frames", "--results-location", "result.json", "--evaluate-with", "omq"]
PICTURE = ["picture", "result.json", "--frames", "frames", "--output-location", "picture.png"]
PROCESSES = {
    "benchbot.supervisor.platform.process": "simulator",
    "benchbot_sim_taichi.light_process": "light",
    "benchbot.supervisor.recording.process": "recorder",
    "benchbot.supervisor": "supervisor",
    "segmentation_mapper.py": "solution",
    "submit": "benchbot submit",
    "picture": "benchbot picture",
}
SPANS = {
    "benchbot.core.plugin_manager": {"load": "discovery of plug-ins"},
    "benchbot.core.declarations.catalog": {"Catalog._read_pool": "reading declarations"},
    "benchbot.core.declarations.problems": {"of": "schema checks"},
    "benchbot.core.provenance": {"software": "hashes of software", "solution_details": "hashes of the solution"},
    "benchbot.cli.kit.preflight": {"Preflight.prove": "preflight"},
    "benchbot.core.selection": {"select": "selection"},
    "benchbot.submission.solution": {"Solution.wait": "waits for the solution", "Solution.end": "end of the solution"},
    "benchbot.supervisor.backend": {"_ask": "waits for the supervisor", "_end": "waits for the supervisor's end"},
    "benchbot.evaluation.score": {"evaluate_files": "evaluation"},
    "benchbot.supervisor.run": {"Run.prepare": "preparing", "Run.finish": "result"},
    "benchbot.supervisor.platform.host": {
        "ChildHost._reply": "waits for the simulator",
        "ChildHost.close": "end of the simulator",
    },
    "benchbot.supervisor.recording.host": {
        "RecorderHost._start": "start of the recorder",
        "RecorderHost.step": "recording",
        "RecorderHost.close": "end of the recorder",
    },
    "benchbot.core.digest": {"ObservationDigest._add": "digest"},
    "benchbot.supervisor.serve": {"_wait": "waits for requests"},
    "benchbot.wire.encoding": {"encode": "transport", "decode": "transport"},
    "benchbot.wire.arena": {"ArenaWriter.write": "transport"},
    "benchbot.supervisor.platform.messages": {"receive": "waits for requests"},
    "benchbot.core.host": {"InProcessHost.act": "motion"},
    "benchbot_scenes.gltf": {"load_scene": "scene"},
    "benchbot_scenes.obstacle_map": {"ObstacleMap.__init__": "obstacles"},
    "benchbot_sim_taichi._ti": {"start": "start of Taichi"},
    "benchbot_sim_taichi.device_scene": {"upload": "tree"},
    "benchbot_sim_taichi.irradiance": {"load_or_solve": "light"},
    "benchbot_sim_taichi.lightmap": {"load_or_bake": "light"},
    "benchbot_sim_taichi.renderer": {"Renderer.render_on_device": "pictures"},
    "benchbot.plugins.simulation.sensors": {
        "Camera.rgb": "sensors",
        "Camera.depth": "sensors",
        "Camera.expose": "sensors",
        "Sightings.segment": "sensors",
    },
    "taichi.lang.kernel_impl": {"Kernel.ensure_compiled": "kernels"},
    "benchbot.api.transport": {"Transport.request": "waits for the supervisor"},
    "benchbot.plugins.mapping.objects": {"ObjectMap.add": "mapping"},
    "benchbot.plugins.recorders.frames": {"_write": "writing frames"},
    "benchbot.plugins.drawing.picture_command": {"picture": "drawing"},
}
START, REST, END = "start of Python", "everything else", "ends of processes"


@dataclass(frozen=True)
class Row:
    """The medians of a span of a process: how often it is entered, and the seconds that are its own."""

    process: str
    span: str
    count: int
    wall_s: float
    processor_s: float


@dataclass(frozen=True)
class Demo:
    """One run of the demo: its wall and processor seconds, its rows and its score."""

    wall_s: float
    processor_s: float
    rows: tuple[Row, ...]
    score: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=3, metavar="N")
    parser.add_argument("--cold", action="store_true", help="empty the caches of scenes, light and kernels each time")
    parser.add_argument("--against", type=Path, metavar="FOLDER", help="another checkout, in turns")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the tables to this file")
    options = parser.parse_args()
    checkouts = [ROOT, *([options.against.resolve()] if options.against else [])]
    runs = measure(checkouts, options.repetitions, cold=options.cold)
    for checkout, demos in runs.items():
        print(f"\n{checkout}: {'; '.join(sorted({demo.score for demo in demos}))}")
        print(table(demos))
    if options.json:
        told = {str(checkout): [asdict(demo) for demo in demos] for checkout, demos in runs.items()}
        options.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def measure(checkouts: list[Path], repetitions: int, *, cold: bool) -> dict[Path, list[Demo]]:
    """Run the demo of each checkout in turns; the first round of warm runs fills the caches and does not count."""
    runs: dict[Path, list[Demo]] = {checkout: [] for checkout in checkouts}
    with tempfile.TemporaryDirectory() as temporary:
        for number in range(repetitions + (not cold)):
            for place, checkout in enumerate(checkouts):
                cache = Path(temporary, f"cache_{place}")
                if cold:
                    shutil.rmtree(cache, ignore_errors=True)
                with tempfile.TemporaryDirectory() as folder:
                    demo = run(checkout, Path(folder), cache)
                if cold or number:
                    runs[checkout].append(demo)
    return runs


def run(checkout: Path, folder: Path, cache: Path) -> Demo:
    """Run the demo of a checkout in a folder, with a cache."""
    spans = folder / "spans"
    spans.mkdir()
    paths = [ROOT / "benchmarks" / "spans", checkout, *sorted(checkout.glob("plugins/*/src"))]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(map(str, paths)),
        "XDG_CACHE_HOME": str(cache),
        "BENCHMARK_SPANS": json.dumps(SPANS),
        "BENCHMARK_SPANS_FOLDER": str(spans),
    }
    before, started_s = getrusage(RUSAGE_CHILDREN), time.perf_counter()
    for words in (SUBMIT, PICTURE):
        done = subprocess.run(
            [BENCHBOT, *words], cwd=folder, env=environment, check=False, capture_output=True, text=True
        )
        if done.returncode:
            raise SystemExit(done.stderr)
    wall_s, after = time.perf_counter() - started_s, getrusage(RUSAGE_CHILDREN)
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    rows = [row for path in spans.iterdir() for row in rows_of(json.loads(path.read_text("utf-8")))]
    rows.append(Row("all", END, 1, 0.0, processor_s - sum(row.processor_s for row in rows)))
    result = json.loads((folder / "result.json").read_text("utf-8"))
    scores = json.loads((folder / "scores.json").read_text("utf-8"))
    digest = result["provenance"]["observation_digest"]
    return Demo(wall_s, processor_s, tuple(rows), f"OMQ {scores['scores']['OMQ']:.4f}, observations {digest[:12]}")


def rows_of(document: dict[str, Any]) -> list[Row]:
    """Return the rows of what a process wrote; together they have all of its processor seconds."""
    command = " ".join(document["command"])
    process = next((name for mark, name in PROCESSES.items() if mark in command), "others")
    rows = [Row(process, span, *taken) for span, taken in {START: document["start"], **document["spans"]}.items()]
    left_s = document["processor_s"] - sum(row.processor_s for row in rows)
    return [*rows, Row(process, REST, 1, max(0.0, document["wall_s"] - sum(row.wall_s for row in rows)), left_s)]


def table(demos: list[Demo]) -> str:
    """Return the medians of runs as a table, the rows of each process in the order of their seconds."""
    found: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for demo in demos:
        of_this: dict[tuple[str, str], list[Row]] = defaultdict(list)
        for row in demo.rows:
            of_this[row.process, row.span].append(row)
        for key, rows in of_this.items():
            found[key].append(
                Row(*key, sum(r.count for r in rows), sum(r.wall_s for r in rows), sum(r.processor_s for r in rows))
            )
    medians = [
        Row(
            *key,
            rows[0].count,
            statistics.median([row.wall_s for row in rows]),
            statistics.median([row.processor_s for row in rows]),
        )
        for key, rows in found.items()
    ]
    lines = [f"{'process':18} {'span':26} {'times':>6} {'wall s':>8} {'processor s':>12}"]
    for process in [*dict.fromkeys(PROCESSES.values()), "others", "all"]:
        own = sorted((row for row in medians if row.process == process), key=lambda row: -row.processor_s)
        lines += [
            f"{process:18} {row.span:26} {row.count:6} {row.wall_s:8.2f} {row.processor_s:12.2f}"
            for row in own
            if max(row.wall_s, row.processor_s) >= 0.01
        ]
    wall_s = statistics.median([demo.wall_s for demo in demos])
    processor_s = statistics.median([demo.processor_s for demo in demos])
    return "\n".join([*lines, f"{'the demo':18} {'':26} {'':6} {wall_s:8.2f} {processor_s:12.2f}"])


if __name__ == "__main__":
    main()
