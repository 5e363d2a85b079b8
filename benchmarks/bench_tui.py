"""What the screens of `benchbot tui` cost: from a key to the picture after it, and for news ten times a second.

Keys: processor time from a key until the screen has been painted again, for batches of 10, 1,000 and 5,000 episodes in
one app each, in turns, so that whatever else the machine does hits all of them alike; the ratio is to the smallest.
News: processor seconds a minute of watching a run or a batch that changes ten times a second, and one where nothing
changes. Cells: what one picture costs, painted by our own half cells and by those of textual-image.
The app runs as in its tests: everything is painted and encoded for a terminal, but nothing is written to one.

`--rest` measures something else: the processor time and bytes of a terminal in which nothing changes, with finished
batches, as many and as long as is said, and the time until the batch with the episodes to be opened is on the screen.

`--run` measures the bytes of watching a ray-traced run that steps once a second.

python -m benchmarks.bench_tui [--rounds N] [--run] [--rest [--batches N] [--episodes N] [--opened N]] [--json FILE]
"""

import argparse
import asyncio
import json
import statistics
import time
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from textual.app import App
from textual.geometry import Size
from textual.pilot import Pilot
from textual.screen import Screen

from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.batch_screen import BatchScreen
from benchbot.plugins.tui.camera import rgb
from benchbot.plugins.tui.run_screen import RunScreen
from benchbot.plugins.watching.views import BatchView, RunView
from benchmarks import tui_at_rest
from tests.plugins.tui.watched import SEEN, StillBatch, StillFeed, batch_view, run_view, surroundings

BATCHES = {10: (2, 5), 1000: (10, 100), 5000: (10, 500)}
KEYS = ("down", "right", "f", "m")
SIZES = ((80, 24), (120, 40), (200, 60))
NEWS_PER_MINUTE = 600
IDLE_S = 3.0


@dataclass(frozen=True)
class Row:
    """One figure, in a unit, and its ratio to the first of its kind."""

    what: str
    value: float
    unit: str
    ratio: float


class Bare(BaseApp):
    """An app with one screen."""

    def __init__(self, screen: Screen[None]) -> None:
        super().__init__()
        self._first = screen

    def on_mount(self) -> None:
        self.push_screen(self._first)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=30, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    parser.add_argument("--rest", action="store_true", help="instead, measure a terminal in which nothing changes")
    parser.add_argument("--batches", type=int, default=16, metavar="N")
    parser.add_argument("--episodes", type=int, default=12_000, metavar="N")
    parser.add_argument("--opened", type=int, default=10_000, metavar="N")
    parser.add_argument("--run", action="store_true", help="instead, measure watching a run of a frame a second")
    options = parser.parse_args()
    if options.rest or options.run:
        sizes = options.batches, options.episodes, options.opened
        figures = tui_at_rest.of_a_run() if options.run else tui_at_rest.measure(*sizes)
        print("\n".join(f"{figure.what:60} {figure.value:10.2f} {figure.unit}" for figure in figures))
        if options.json:
            options.json.write_text(json.dumps([asdict(figure) for figure in figures], indent=1))
        return
    rows = [*asyncio.run(keys(options.rounds)), *asyncio.run(news(options.rounds)), *cells(options.rounds)]
    print(f"{'':54} {'':>8} {'':6} {'ratio':>6}")
    for row in rows:
        print(f"{row.what:54} {row.value:8.2f} {row.unit:6} {row.ratio:6.2f}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


async def keys(rounds: int) -> list[Row]:
    """Measure from a key to the picture after it."""
    took: dict[tuple[str, int], list[float]] = {(key, count): [] for key in KEYS for count in BATCHES}
    for count, shape in BATCHES.items():
        app = Bare(BatchScreen(StillBatch(batch_view(*shape))))
        async with app.run_test(size=(120, 40)) as pilot:
            await settle(pilot)
            for _ in range(rounds):
                for key in KEYS:
                    began_s = time.process_time()
                    await pilot.press(key)
                    await pilot.pause()
                    took[key, count].append((time.process_time() - began_s) * 1e3)
    return [
        Row(f"key {key!r}, {count} episodes", statistics.median(took[key, count]), "ms", ratio(took, key, count))
        for key in KEYS
        for count in BATCHES
    ]


def ratio(took: dict[tuple[str, int], list[float]], key: str, count: int) -> float:
    """Return how much longer than with the fewest episodes."""
    return statistics.median(took[key, count]) / statistics.median(took[key, min(BATCHES)])


async def news(rounds: int) -> list[Row]:
    """Measure a minute of watching, from the processor time of each piece of news."""
    rows: list[Row] = []
    for count, shape in BATCHES.items():
        feed = StillBatch(batch_view(*shape))
        app = Bare(BatchScreen(feed))
        rows += await watched(app, f"batch of {count}", rounds, lambda feed=feed: next_batch(feed), (120, 40))  # type: ignore[misc]
    for size in SIZES:
        still = StillFeed(run_view())
        app = Bare(RunScreen(still, surroundings=surroundings))
        rows += await watched(app, f"run at {size[0]}x{size[1]}", rounds, lambda still=still: next_run(still), size)  # type: ignore[misc]
    return rows


async def watched(
    app: App[None], what: str, rounds: int, advance: Callable[[], None], size: tuple[int, int]
) -> list[Row]:
    """Measure one screen with news, and without."""
    async with AsyncExitStack() as stack:
        pilot = await stack.enter_async_context(app.run_test(size=size))
        await settle(pilot)
        tick = app.screen._tick  # type: ignore[attr-defined]
        began_s = time.process_time()
        for _ in range(rounds):
            advance()
            tick()
            await pilot.pause()
        busy_s = (time.process_time() - began_s) / rounds * NEWS_PER_MINUTE
        began_s = time.process_time()
        await asyncio.sleep(IDLE_S)
        idle_s = (time.process_time() - began_s) * 60 / IDLE_S
    return [
        Row(f"{what}, news at 10 Hz", busy_s, "s/min", 1.0),
        Row(f"{what}, no news", idle_s, "s/min", idle_s / busy_s),
    ]


async def settle(pilot: Pilot[None]) -> None:
    """Wait until what is fetched in threads is there, and painted."""
    for _ in range(5):
        await pilot.pause(0.1)


def next_batch(feed: StillBatch) -> None:
    """Finish one more episode."""
    view: BatchView = feed.view
    cells_ = list(view.cells)
    place = next((index for index, cell in enumerate(cells_) if cell.state in ("pending", "running")), 0)
    cells_[place] = replace(cells_[place], state="done")
    assert view.status is not None
    status = replace(view.status, finished=view.status.finished + 1, left_s=(view.status.left_s or 0.0) - 1)
    feed.view = replace(view, cells=tuple(cells_), status=status)


def next_run(feed: StillFeed) -> None:
    """Make one more step: a new picture, a new place."""
    view: RunView = feed.view
    assert view.snapshot is not None
    images = {name: np.roll(image, 7, 1) for name, image in view.snapshot.images.items()}
    x, y, yaw_rad = view.progress["pose_xyyaw"]
    progress = {
        **view.progress,
        "steps": view.progress["steps"] + 1,
        "wall_time_s": view.progress["wall_time_s"] + 0.1,
        "pose_xyyaw": (x + 0.01, y, yaw_rad + 0.1),
    }
    snapshot = replace(view.snapshot, number=view.snapshot.number + 1, images=images)
    feed.view = replace(view, snapshot=snapshot, progress=progress, path=(*view.path, (x, y)))


def cells(rounds: int) -> list[Row]:
    """Paint the same picture both ways, in turns; textual-image is asked for its lines as Rich would."""
    from textual_image.renderable.halfcell import Image as HalfcellImage

    console = Console(width=80, height=24, color_system="truecolor", file=open("/dev/null", "w"))  # noqa: PTH123, SIM115
    ours, theirs = [], []
    for number in range(rounds):
        pixels = np.roll(SEEN["image_rgb"], 7 * number, 1)
        began_s = time.process_time()
        strips = rgb(pixels).strips(Size(80, 24), colored=True, dark=True)
        for strip in strips:
            strip.render(console)
        ours.append((time.process_time() - began_s) * 1e3)
        began_s = time.process_time()
        console.render_lines(HalfcellImage(Image.fromarray(pixels), 80, 24))
        theirs.append((time.process_time() - began_s) * 1e3)
    median = statistics.median(ours)
    return [
        Row("a picture of 80x24 cells, ours, encoded", median, "ms", 1.0),
        Row(
            "a picture of 80x24 cells, textual-image",
            statistics.median(theirs),
            "ms",
            statistics.median(theirs) / median,
        ),
    ]


if __name__ == "__main__":
    main()
