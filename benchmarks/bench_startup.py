"""How long the command line takes to start, against Python that only imports the library it is built with.

The commands are run in turns, so that whatever else the machine does hits all of them alike; the ratio is that of the
medians. Goal: at most 1.5. Each is also run with 10 and 100 more plug-ins installed, made for this, with a task each:
`--help` and `plugins list` import none of them, `list tasks` all.

python -m benchmarks.bench_startup [--repetitions N] [--json FILE]
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

BASELINE = "python -c 'import typer'"
BENCHBOT = [str(Path(sys.executable).with_name("benchbot"))]
COMMANDS: dict[str, list[str]] = {
    BASELINE: [sys.executable, "-c", "import typer"],
    "benchbot --help": [*BENCHBOT, "--help"],
    "benchbot list tasks": [*BENCHBOT, "list", "tasks"],
    "benchbot plugins list": [*BENCHBOT, "plugins", "list"],
}
NUMBERS_OF_PLUGINS = (10, 100)
HOOKS = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_tasks():
    yield Path(__file__).parent / "tasks"
"""
WIDTH = 42


@dataclass(frozen=True)
class Row:
    """The median of one command: wall time, processor time (which other processes disturb less), and their ratios."""

    command: str
    wall_ms: float
    wall_ratio: float
    processor_ms: float
    processor_ratio: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=20, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    rows = measure(options.repetitions)
    print(f"{'command':{WIDTH}} {'wall ms':>8} {'ratio':>6} {'cpu ms':>8} {'ratio':>6}")
    for row in rows:
        wall, processor = (
            f"{row.wall_ms:8.1f} {row.wall_ratio:6.2f}",
            f"{row.processor_ms:8.1f} {row.processor_ratio:6.2f}",
        )
        print(f"{row.command:{WIDTH}} {wall} {processor}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def measure(repetitions: int) -> list[Row]:
    with tempfile.TemporaryDirectory() as temporary:
        runs = {name: (command, dict[str, str]()) for name, command in COMMANDS.items()}
        for number in NUMBERS_OF_PLUGINS:
            variables = {"PYTHONPATH": os.pathsep.join([make_plugins(Path(temporary), number), *_python_path()])}
            more = (name for name in COMMANDS if name != BASELINE)
            runs |= {f"{name}, {number} more plug-ins": (COMMANDS[name], variables) for name in more}
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
        for number in range(repetitions + 1):
            for name, (command, variables) in runs.items():
                taken = run(command, variables)
                if number:  # the first round warms the file cache and writes the byte code
                    times[name].append(taken)
    medians = {
        name: [statistics.median(column) for column in zip(*taken, strict=True)] for name, taken in times.items()
    }
    wall_base_s, processor_base_s = medians[BASELINE]
    return [
        Row(name, 1e3 * wall_s, wall_s / wall_base_s, 1e3 * processor_s, processor_s / processor_base_s)
        for name, (wall_s, processor_s) in medians.items()
    ]


def make_plugins(folder: Path, count: int) -> str:
    """Install that many plug-ins, with a task each, into a folder of their own; return it."""
    site = folder / f"site_{count}"
    for name in (f"bench_{number}" for number in range(count)):
        info, tasks = site / f"{name}-1.0.dist-info", site / name / "tasks"
        info.mkdir(parents=True)
        tasks.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
        (info / "entry_points.txt").write_text(f"[benchbot]\n{name} = {name}\n", encoding="utf-8")
        (site / name / "__init__.py").write_text(HOOKS, encoding="utf-8")
        text = f"name: {name}\nactions: [move_next]\nobservations: [poses]\nresults_format: object_map\n"
        (tasks / f"{name}.yaml").write_text(text, encoding="utf-8")
    return str(site)


def _python_path() -> list[str]:
    return list(filter(None, [os.environ.get("PYTHONPATH")]))


def run(command: list[str], variables: Mapping[str, str]) -> tuple[float, float]:
    """Return the wall and processor seconds of one process, its start and end included."""
    before, started_s = getrusage(RUSAGE_CHILDREN), time.perf_counter()
    environment = {**os.environ, **variables}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    wall_s, after = time.perf_counter() - started_s, getrusage(RUSAGE_CHILDREN)
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall_s, processor_s


if __name__ == "__main__":
    main()
