"""How long the command line takes to start, against Python that only imports the library it is built with.

The commands are run in turns, so that whatever else the machine does hits all of them alike; the ratio is that of the
medians. Goal: at most 1.5.

python -m benchmarks.bench_startup [--repetitions N] [--json FILE]
"""

import argparse
import json
import statistics
import subprocess
import sys
import time
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
    print(f"{'command':26} {'wall ms':>8} {'ratio':>6} {'cpu ms':>8} {'ratio':>6}")
    for row in rows:
        wall, processor = (
            f"{row.wall_ms:8.1f} {row.wall_ratio:6.2f}",
            f"{row.processor_ms:8.1f} {row.processor_ratio:6.2f}",
        )
        print(f"{row.command:26} {wall} {processor}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def measure(repetitions: int) -> list[Row]:
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in COMMANDS}
    for number in range(repetitions + 1):
        for name, command in COMMANDS.items():
            taken = run(command)
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


def run(command: list[str]) -> tuple[float, float]:
    """Return the wall and processor seconds of one process, its start and end included."""
    before, started_s = getrusage(RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wall_s, after = time.perf_counter() - started_s, getrusage(RUSAGE_CHILDREN)
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall_s, processor_s


if __name__ == "__main__":
    main()
