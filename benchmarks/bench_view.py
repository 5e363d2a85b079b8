"""How `benchbot view` does with many episodes: a fabricated batch of 10,000, and an episode of 200 observations.

Table: from the request of the page until all rows are there, without and with a cache of what was read before, and the
processor time of server and browser for it: on a machine that does other things, too, their sum bounds what it takes
on one that does not. Filter and sort: from the key until the lines are in the document. Slider: frames a
second, and those of a page that draws nothing; without WebGL, which a processor alone draws a tenth as quickly. Rest:
the server's share of a core while the table stays open, and its memory.

python -m benchmarks.bench_view [--episodes N] [--json FILE]
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from PIL import Image

from tests.browser import launched

SOLUTIONS, ENVIRONMENTS = 8, 25
OBSERVATIONS, STEPS_PER_OBSERVATION = 200, 10
REST_S = 20.0
ROUNDS = 20
TIMED = """async ([id, texts]) => {
  const input = document.getElementById('filter');
  const times = [];
  for (const text of texts) {
    const began = performance.now();
    input.value = text;
    input.dispatchEvent(new Event('input'));
    document.getElementById('table').getBoundingClientRect();
    times.push(performance.now() - began);
  }
  return times;
}"""
SORTED = """() => [...document.querySelectorAll('#table thead button')].map((button) => {
  const began = performance.now();
  button.click();
  document.getElementById('table').getBoundingClientRect();
  return performance.now() - began;
})"""
SLIDER = """async () => {
  const slider = document.getElementById('slider');
  const last = Number(slider.max);
  const times = [];
  for (let i = 0; i < 2; i += 1) for (let at = 0; at <= last; at += 1) {
    slider.value = at;
    const began = performance.now();
    slider.dispatchEvent(new Event('input'));
    await new Promise((resolve) => { requestAnimationFrame(resolve); });
    if (i) times.push(performance.now() - began);
  }
  return times;
}"""
EMPTY = """async () => {
  const times = [];
  for (let i = 0; i < 60; i += 1) {
    const began = performance.now();
    await new Promise((resolve) => { requestAnimationFrame(resolve); });
    times.push(performance.now() - began);
  }
  return times;
}"""


def fabricate(folder: Path, count: int) -> Path:
    """Write a finished batch of several solutions, with scores; return the folder of the episode with pictures."""
    chance = random.Random(0)
    planned, rows = [], []
    track = [[None, 0.1 * i, 0.01 * i, 0.02 * i, 0.001 * i] for i in range(200)]
    for number in range(count):
        key = f"{number:08d}" + "0" * 56
        solution, environment = f"mapper_{number % SOLUTIONS}", f"house:{number // SOLUTIONS % ENVIRONMENTS + 1}"
        seed = number // (SOLUTIONS * ENVIRONMENTS)
        selected = {"robot": "carter", "environment": environment, "seed": seed}
        planned.append({"key": key, "label": f"e{number}", "solution": solution, **selected})
        failure = {"class": "timeout", "why": "It took longer than 600 s."} if chance.random() < 0.03 else None
        path = folder / "episodes" / f"e{number}-{key[:8]}" / "result.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(document(environment, {**selected, "task": "t"}, failure, track)), "utf-8")
        if failure is None:
            rows.append({"source": str(path), "scores": {"OMQ": chance.betavariate(4, 3)}})
    (folder / "plan.json").write_text(json.dumps({"task": "t", "episodes": planned}), "utf-8")
    scores = {"method": {"name": "omq", "headline": "OMQ"}, "rows": rows}
    (folder / "scores.json").write_text(json.dumps(scores), "utf-8")
    return folder / "episodes" / "e0-00000000" / "result.json"


def document(environment: str, selection: dict[str, Any], failure: Any, track: list[Any]) -> dict[str, Any]:
    """Return a result with forty objects."""
    name, _, variant = environment.partition(":")
    names = [f"class {i}" for i in range(30)]
    item = {"label_probs": [1 / 30] * 30, "centroid": [1.0, 2.0, 0.5], "extent": [0.5, 0.5, 0.5]}
    return {
        "task_details": {"name": "t", "results_format": "object_map"},
        "environment_details": [{"name": name, "variant": int(variant)}],
        "results": {"objects": [item] * 40, "class_list": names},
        "provenance": {
            "benchbot": "0.1.0",
            "plugins": {},
            "selection": selection,
            "steps": 200,
            "simulated_time_s": 20.0,
            "failure": failure,
            "observation_digest": "00",
        },
        "track": [
            {
                "scene": environment,
                "source": "simulation",
                "path_length_m": 2.0,
                "collisions": 0,
                "columns": ["observation", "time_s", "x_m", "y_m", "yaw_rad"],
                "rows": track,
            }
        ],
    }


def add_pictures(result: Path) -> None:
    """Give an episode a track with observations, and noisy pictures of them."""
    found = json.loads(result.read_text("utf-8"))
    found["track"][0]["rows"] = [
        [
            i // STEPS_PER_OBSERVATION if i % STEPS_PER_OBSERVATION == 0 else None,
            0.1 * i,
            0.002 * i,
            0.001 * i,
            0.01 * i,
        ]
        for i in range(OBSERVATIONS * STEPS_PER_OBSERVATION)
    ]
    result.write_text(json.dumps(found), "utf-8")
    frames = result.parent / "result-recordings" / "frames"
    frames.mkdir(parents=True)
    noise = np.random.default_rng(0).integers(0, 255, (54, 96, 3), np.uint8)
    for number in range(OBSERVATIONS):
        image = Image.fromarray(np.roll(noise, number, 1)).resize((960, 540), Image.Resampling.BICUBIC)
        image.save(frames / f"{number:05d}.jpg", quality=85)


@contextmanager
def viewer(folder: Path, cache: Path) -> Iterator[tuple[str, psutil.Process]]:
    """Run `benchbot view`; yield its address and its process."""
    command = [sys.executable, "-m", "benchbot", "view", str(folder), "--no-browser"]
    variables = {**os.environ, "BENCHBOT_CACHE_DIR": str(cache)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=variables, text=True)
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip(), psutil.Process(process.pid)
    finally:
        process.terminate()
        process.wait()


def cpu_s(process: psutil.Process) -> float:
    """Return the processor time of a process."""
    used = process.cpu_times()
    return float(used.user + used.system)


def browser_s(viewer: psutil.Process) -> float:
    """Return the processor time of the browser: of all children of this process but the viewer."""
    return sum(cpu_s(child) for child in psutil.Process().children(recursive=True) if child.pid != viewer.pid)


class Told(dict[str, float]):
    """Figures that are printed as soon as they are known."""

    def __setitem__(self, name: str, value: float) -> None:
        super().__setitem__(name, value)
        print(f"{name:42} {value:10.2f}", flush=True)


def measured(folder: Path, result: Path, cache: Path, count: int) -> dict[str, float]:
    """Return the figures by name."""
    from benchbot_view.rows import id_of

    figures = Told()
    wanted = f"{count:,} episodes"
    with launched(webgl=False) as browser:
        for name in ("cold", "warm"):
            with viewer(folder, cache) as (address, process), browser.new_context() as context:
                page = context.new_page()
                used_s, drawn_s, began_s = cpu_s(process), browser_s(process), time.monotonic()
                page.goto(address)
                page.get_by_text(wanted).wait_for()
                figures[f"table {name}, s"] = time.monotonic() - began_s
                figures[f"table {name}, processor s of the server"] = cpu_s(process) - used_s
                figures[f"table {name}, processor s of the browser"] = browser_s(process) - drawn_s
                if name == "cold":
                    continue
                texts = [
                    text for i in range(ROUNDS) for text in (f"score<0.{i % 9 + 1}", f"house:{i + 1}", "failed", "")
                ]
                times = page.evaluate(TIMED, ["", texts])
                figures["filter, median ms"] = float(np.median(times))
                figures["filter, longest ms"] = max(times)
                figures["sort, longest ms"] = max(page.evaluate(SORTED))
                lines = page.locator("#table tbody tr").count()
                figures["lines in the document"] = lines
                page.wait_for_timeout(5000)
                used_s, began_s = cpu_s(process), time.monotonic()
                page.wait_for_timeout(REST_S * 1000)
                figures["rest, % of a core"] = 100 * (cpu_s(process) - used_s) / (time.monotonic() - began_s)
                page.goto(f"{address.partition('?')[0]}episode/{id_of(result)}.html")
                page.locator("#slider").wait_for()
                page.get_by_text("objects seen").wait_for(timeout=300_000)
                empty = page.evaluate(EMPTY)
                figures["an empty page's frames/s"] = 1000 / float(np.mean(empty))
                frames = page.evaluate(SLIDER)
                figures["slider, frames/s"] = 1000 / float(np.mean(frames))
                figures["slider, 95th percentile ms"] = float(np.percentile(frames, 95))
                figures["memory of the server, MB"] = process.memory_info().rss / 1e6
                figures["memory of the page's scripts, MB"] = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
    return figures


def main() -> None:
    """Fabricate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=10_000)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="benchbot-view-") as scratch:
        folder = Path(scratch, "night")
        result = fabricate(folder, options.episodes)
        add_pictures(result)
        figures = measured(folder, result, Path(scratch, "cache"), options.episodes)
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1), "utf-8")


if __name__ == "__main__":
    main()
