"""How long a picture takes in every environment: colour of the default quality, depth, class and instance, 960x540.

python -m benchmarks frames [--only NAME:VARIANT ...] [--against COMMIT|FOLDER] [--threads 2] [--device cuda]
    [--rounds 7] [--robot carter] [--cache FOLDER] [--json FILE]

From the median pose of each environment's trajectory (`views.median_places`), in the light that it declares, by the
simulator, as a run takes them: medians of wall and processor seconds of --rounds pictures, after three. `first` are the
seconds to the first picture, light and kernels included, which a --cache of before shortens. With --against the same is
asked of another commit, or of a checkout in a folder, in turn with ours in every round; ratios are its time over ours.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchbot_sim_taichi import _ti
from benchmarks import views

ROOT = Path(__file__).parents[1]
SERVER = Path(__file__).with_name("frame_server.py")
OURS, OTHER = "ours", "other"


@dataclass(frozen=True)
class Row:
    """An environment's seconds, of this checkout or another."""

    environment: str
    place: int
    of: str
    first_wall_s: float
    first_processor_s: float
    wall_s: float
    processor_s: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME:VARIANT", help="these environments; otherwise all")
    parser.add_argument("--against", metavar="COMMIT|FOLDER", help="ask another commit, too, in turn")
    parser.add_argument("--threads", type=int, help="of each (default: as many as there are cores)")
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--robot", default="carter", help="whose camera takes the pictures")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file, row by row")
    options = parser.parse_args()
    rows: list[Row] = []
    print(f"{'':14} {'place':>5} {'of':>6} {'first s':>8} {'CPU s':>7} {'ms':>8} {'CPU ms':>8} {'ratio':>6} {'CPU':>6}")
    with ExitStack() as stack:
        cache = options.cache or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        roots = {OURS: ROOT}
        if options.against:
            roots[OTHER] = stack.enter_context(checkout(options.against))
        servers = {name: stack.enter_context(server(root, cache / name, options)) for name, root in roots.items()}
        for name in options.only or views.shipped():
            environment = views.declared(name)
            (place,) = views.median_places(environment, views.scene_of(environment, cache), cache, options.device)
            taken = list(measure(name, place, servers, options.rounds))
            rows += taken
            print("\n".join(lines(taken)), flush=True)
            if options.json:
                options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    ours = [row for row in rows if row.of == OURS]
    slowest = max(ours, key=lambda row: row.wall_s)
    print(
        f"median {1e3 * statistics.median(row.wall_s for row in ours):.0f} ms, "
        f"CPU {1e3 * statistics.median(row.processor_s for row in ours):.0f} ms; "
        f"slowest {1e3 * slowest.wall_s:.0f} ms ({slowest.environment})"
    )


Server = subprocess.Popen[str]


def measure(name: str, place: int, servers: Mapping[str, Server], rounds: int) -> Iterator[Row]:
    """A row of each server, their pictures taken in turn."""
    first = {of: ask(process, [name, place]) for of, process in servers.items()}
    taken: dict[str, list[tuple[float, float]]] = {of: [] for of in servers}
    for _ in range(rounds):
        for of, process in servers.items():
            taken[of].append(ask(process, None))
    for of, seconds in taken.items():
        wall_s, processor_s = (statistics.median(column) for column in zip(*seconds, strict=True))
        yield Row(name, place, of, *first[of], wall_s, processor_s)


def lines(rows: Sequence[Row]) -> Iterator[str]:
    """An environment's lines of the table; ratios are to the first of them."""
    for row in rows:
        ratios = f"{row.wall_s / rows[0].wall_s:6.2f} {row.processor_s / rows[0].processor_s:6.2f}"
        yield (
            f"{row.environment:14} {row.place:5} {row.of:>6} {row.first_wall_s:8.1f} {row.first_processor_s:7.1f} "
            f"{1e3 * row.wall_s:8.1f} {1e3 * row.processor_s:8.1f} {ratios if row.of != OURS else ''}"
        ).rstrip()


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """The folder of a checkout: the one that is named, or one of a commit that is there for as long as it is needed."""
    if Path(commit).is_dir():
        yield Path(commit).resolve()
        return
    git = ["git", "-C", str(ROOT), "worktree"]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "checkout"
        subprocess.run([*git, "add", "--quiet", "--detach", str(root), commit], check=True)
        try:
            yield root
        finally:
            subprocess.run([*git, "remove", "--force", str(root)], check=True)


@contextmanager
def server(root: Path, cache: Path, options: argparse.Namespace) -> Iterator[Server]:
    """A process that takes pictures with the sources of a checkout; an error where it would take them with others."""
    cache.mkdir(parents=True, exist_ok=True)
    sources = [root, *sorted(root.glob("plugins/*/src"))]
    threads = {} if options.threads is None else {"TI_CPU_MAX_NUM_THREADS": str(options.threads)}
    # Ours come before what else there is, such as libraries in a folder of their own.
    paths = filter(None, [*map(str, sources), os.environ.get("PYTHONPATH")])
    with subprocess.Popen(
        [sys.executable, str(SERVER), str(cache), options.device, options.robot],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=root,
        env={**os.environ, **threads, "PYTHONPATH": os.pathsep.join(paths)},
    ) as process:
        imported = Path(answer(process))
        if not imported.is_relative_to(root):
            raise RuntimeError(f"The pictures of {root} would be taken by {imported}.")
        yield process


def ask(process: Server, question: list[Any] | None) -> tuple[float, float]:
    """Wall and processor seconds of what was asked for."""
    assert process.stdin is not None
    process.stdin.write(json.dumps(question) + "\n")
    process.stdin.flush()
    wall_s, processor_s = answer(process)
    return wall_s, processor_s


def answer(process: Server) -> Any:
    """The next line of a server."""
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise RuntimeError("A process that was to be measured died; its message is above.")
    return json.loads(line)


if __name__ == "__main__":
    main()
