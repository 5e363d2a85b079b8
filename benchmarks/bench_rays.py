"""The ray tracer beside Embree, Mitsuba, TinyRenderer and MuJoCo, and what its pictures cost.

python -m benchmarks.bench_rays [--quick] [--only PART …] [--json FILE] [--plot FILE]

Programs are asked in turn, in one process; figures are medians, by wall clock (W) and by processor time of all threads.
A machine that does something else meanwhile spoils the first more than the second: the load is reported.
"""

import argparse
import json
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.rays import against_peers, costs, threads

QUICK_SIZES, SIZES = (20_000, 200_000), (20_000, 200_000, 1_000_000)
PIXEL_WIDTHS, CAMERAS = (160, 320, 640, 1280), (1, 4, 16, 64)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parts: dict[str, Callable[[argparse.Namespace, Path], Any]] = {
        "peers": peers,
        "threads": two_threads,
        "frames": frames,
        "starts": starts,
        "memory": memory,
        "growth": growth,
        "error": error,
    }
    parser.add_argument("--only", nargs="+", choices=parts, default=list(parts), metavar="PART", help=", ".join(parts))
    parser.add_argument("--quick", action="store_true", help="two sizes of scene and fewer rounds")
    parser.add_argument("--rounds", type=int, metavar="N", help="default 5, or 3 when quick")
    parser.add_argument("--width", type=int, default=960, help="of pictures, in pixels (16:9; default 960)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="also draw how costs grow (SVG or PNG)")
    options = parser.parse_args()
    options.rounds = options.rounds or (3 if options.quick else 5)
    options.sizes = QUICK_SIZES if options.quick else SIZES
    report: dict[str, Any] = {"cores": os.cpu_count(), "missing": against_peers.missing(), "load": {}}
    for program, reason in report["missing"].items():
        print(f"{program}: {reason}")
    with against_peers.temporary_cache() as cache:
        for name in options.only:
            before = os.getloadavg()[0]
            report[name] = parts[name](options, Path(cache))
            report["load"][name] = (before, os.getloadavg()[0])
            print(f"(load of the machine: {before:.1f} before, {os.getloadavg()[0]:.1f} after)", flush=True)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def peers(options: argparse.Namespace, cache: Path) -> Any:
    figures: list[Any] = []
    found = against_peers.compare(options.sizes, options.width, height(options), options.rounds, cache)
    show(against_peers.table(keeping(found, figures)))
    return figures


def two_threads(options: argparse.Namespace, cache: Path) -> Any:
    rows = threads.compare(QUICK_SIZES[-1], options.width, height(options), options.rounds)
    show(threads.table(rows))
    return [asdict(row) for row in rows]


def frames(options: argparse.Namespace, cache: Path) -> Any:
    return cost_table(costs.observations(cache, 4 * options.rounds))


def starts(options: argparse.Namespace, cache: Path) -> Any:
    return cost_table(costs.starts(cache / "of a fresh process", options.rounds))


def memory(options: argparse.Namespace, cache: Path) -> Any:
    peaks = costs.memory((options.sizes[0], options.sizes[-1]), cache)
    show(["", *(f"{name:48} {value:8.0f}" for name, value in peaks.items())])
    return peaks


def growth(options: argparse.Namespace, cache: Path) -> Any:
    rows = costs.growth(options.sizes, PIXEL_WIDTHS, CAMERAS, cache, options.rounds)
    if options.plot:
        from benchmarks.rays.plot import draw

        draw(rows, options.plot)
    return cost_table(rows)


def error(options: argparse.Namespace, cache: Path) -> Any:
    from benchmarks.rays import picture_error

    rows: list[Any] = []
    found = picture_error.compare(cache, samples=32 if options.quick else 128)
    show(picture_error.table(keeping(found, rows)))
    return rows


def keeping(found: Iterable[Any], rows: list[Any]) -> Iterator[Any]:
    """Pass on what is found and put it into `rows`, so that tables show while others are measured."""
    for row in found:
        rows.append(asdict(row))
        yield row


def cost_table(rows: list[costs.Cost]) -> Any:
    show(costs.table(rows))
    return [asdict(row) for row in rows]


def show(lines: Any) -> None:
    for line in lines:
        print(line, flush=True)


def height(options: argparse.Namespace) -> int:
    return int(options.width) * 9 // 16


if __name__ == "__main__":
    main()
