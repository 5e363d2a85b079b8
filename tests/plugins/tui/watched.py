"""Views of a run and of a batch as their screens are given them: made from data, the same at every time.

`miniroom.npz` is what `carter_lowres` saw after six steps through `miniroom:1`, every second pixel of it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.plugins.batch.status import BatchStatus, RunningEpisode, Score
from benchbot.plugins.drawing.map_model import Box, MapObject, Occupancy, SceneMap
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import (
    BatchView,
    EpisodeCell,
    FeedSnapshot,
    LogLine,
    RunView,
    Sample,
    Usage,
    WorkerRow,
)
from benchbot.wire.run_state import Connection, RunState

SEEN: Mapping[str, Any] = dict(np.load(Path(__file__).with_name("miniroom.npz")))
CLASSES = {"bottle": 1, "cup": 2, "spoon": 7, "apple": 9, "potted plant": 12, "book": 17, "clock": 18, "chair": 19}
CLASSES |= {"table": 20, "bed": 22, "sink": 29}
OBJECTS = (
    ("clock", 2.11, -0.75, 0.17, 0.17), ("potted plant", 0.8, -0.91, 0.6, 0.39), ("bed", 2.2, 0.06, 2.3, 1.85),
    ("table", 0.47, -0.54, 0.6, 0.4), ("book", -0.66, 0.82, 0.25, 0.3), ("chair", -0.57, 1.6, 0.55, 0.47),
    ("table", 2.53, 2.69, 0.95, 0.93), ("chair", 3.03, 2.35, 0.54, 0.47), ("sink", -0.59, 3.08, 0.33, 0.28),
)  # fmt: skip
BOXES = tuple((name, Box((x, y, 0.5), (width, depth, 1.0))) for name, x, y, width, depth in OBJECTS)
TRUTH = tuple(MapObject(truth_label=name, true=box) for name, box in BOXES)
ESTIMATES = tuple(MapObject(name, estimated=box) for name, box in BOXES)
STATE = RunState(
    connection=Connection("http://127.0.0.1:10000", None, "token"),
    operator_token="operator",
    pid=4000,
    task="semantic_slam:passive:ground_truth:segmentation",
    robot="carter_lowres",
    environment="miniroom:1",
    seed=0,
    folder="/home/ann/runs/20260301-120000-ab",
    platform_log="platform.log",
    supervisor_log="supervisor.log",
    result="result.json",
    started_s=0.0,
)
LOG = (
    ("supervisor", "info", "listening on http://127.0.0.1:10000"),
    ("platform", "debug", "kernels compiled in 3.1 s"),
    ("supervisor", "info", "scene 1 begins · clean · at 0.00 s"),
    ("solution", "info", "3 objects so far"),
    ("supervisor", "info", "step 5: move_next · dirty · at 9.35 s"),
    ("solution", "warning", "no depth for 12 % of the pixels of table 2"),
    ("solution", "error", "bottle: too few points, left out"),
    ("supervisor", "info", "step 6: move_next · dirty · at 10.35 s"),
)
OBSERVED = ("image_rgb", "image_depth", "image_segment", "laser", "poses")


def place() -> SceneMap:
    rows, columns = SEEN["shape"]
    occupied = np.unpackbits(SEEN["occupied"], axis=1)[:rows, :columns].astype(bool)
    low = (float(SEEN["low"][0]), float(SEEN["low"][1]))
    planned = tuple((float(x), float(y)) for x, y in SEEN["planned"])
    return SceneMap("miniroom:1", Occupancy(occupied, 0.05, low), planned=planned)


PLACE = place()


def surroundings(environment: str) -> SceneMap:
    return replace(PLACE, objects=TRUTH) if environment == "miniroom:1" else SceneMap()


def snapshot(number: int = 7) -> FeedSnapshot:
    images = {
        "image_rgb": SEEN["image_rgb"],
        "image_depth": SEEN["depth_cm"].astype(np.float32) / 100,
        "image_class": SEEN["image_class"],
    }
    return FeedSnapshot(
        number, images, {"scans": SEEN["laser"], "range_min": 0.05, "range_max": 30.0}, None, CLASSES, 2
    )


def run_view(**changes: Any) -> RunView:
    """A run in the middle of its trajectory; `progress` changes parts of its progress."""
    progress: dict[str, Any] = {
        "state": "dirty", "scene_number": 0, "steps": 6, "trajectory_index": 6, "trajectory_length": 48,
        "last_action": "move_next", "pose_xyyaw": SEEN["pose"].tolist(), "simulated_time_s": 12.35, "wall_time_s": 41.2,
        "frames": 7, "failure": None, "failure_why": None, "ends_run": False, "waiting_for": None,
    }  # fmt: skip
    progress |= changes.pop("progress", {})
    counted = ("steps", "simulated_time_s", "wall_time_s")
    progress = {"spent": {"restarts": 0, **{key: progress[key] for key in counted}}, **progress}
    session = {
        "environments": [{"name": "miniroom", "variant": 1}],
        "scene_count": 1,
        "started": True,
        "observations": dict.fromkeys(OBSERVED, ""),
        "selection": {"limits": {"steps": 100, "simulated_time_s": None, "wall_time_s": 600.0}},
    }
    view = RunView(
        state=STATE,
        alive=True,
        problem=None,
        session=session,
        progress=progress,
        last={"action": "move_next", "arguments": {}, "outcome": "reached", "result": "SUCCESS", "by_hand": False},
        path=tuple((float(x), float(y)) for x, y in SEEN["path"]),
        frames_per_s=2.4,
        real_time_factor=0.3,
        usage=Usage(143.0, 812 * 2**20),
        history=tuple(
            Sample(
                2.4 + 0.8 * math.sin(second / 4),
                90.0 + 53 * second / 40,
                (700 + 112 * second // 40) << 20,
                second / 320,
            )
            for second in range(40)
        ),
        snapshot=snapshot(),
        log=tuple(LogLine(1_772_366_400.0 + second, *said) for second, said in enumerate(LOG)),
        log_dropped=12,
    )
    return replace(view, **changes)


def batch_view(environments: int, columns: int, finished: float = 0.6, **changes: Any) -> BatchView:
    """A batch in its middle: every seventh episode or so has failed, in one way after the other."""
    ways = ("collision", "timeout", "agent", "platform", "infrastructure")
    total = environments * columns
    cells: list[EpisodeCell] = []
    failures: dict[str, int] = {}
    for index in range(total):
        row, column = divmod(index, columns)
        state, worker, since_s = "pending", None, None
        if index < finished * total:
            state, worker = "done", f"node{index % 2}-400{index % 4}"
            if index * index % 7 == 4:
                state = ways[index // 7 % len(ways)]
                failures[state] = failures.get(state, 0) + 1
        elif index < finished * total + 4:
            state, worker, since_s = "running", f"node{index % 2}-400{index % 4}", 12.0 + 7 * (index % 4)
        robot = "carter" if 2 * column < columns else "carter_lowres"
        seed = column if 2 * column < columns else column - (columns + 1) // 2
        name = f"{robot}_room-{row + 1}_seed{seed}-{index:08}"
        ended = state not in ("pending", "running")
        cells.append(
            EpisodeCell(
                name,
                state,
                robot,
                f"room:{row + 1}",
                seed,
                0,
                worker,
                since_s,
                score=round(0.3 + 0.05 * row + 0.002 * (index % 50), 3) if state == "done" else 0.0 if ended else None,
                duration_s=30.0 + index % 23 if ended else None,
                attempts=1 + (index % 11 == 0) if ended else None,
                restarts=index % 5 // 4 if ended else None,
            )
        )
    running = tuple(
        RunningEpisode(each.name, str(each.worker), each.since_s) for each in cells if each.state == "running"
    )
    done = sum(each.state not in ("pending", "running") for each in cells)
    status = BatchStatus(
        folder="/home/ann/study/lights",
        hash="0" * 64,
        episodes=total,
        finished=done,
        failures=dict(sorted(failures.items())),
        retried=3,
        running=running,
        workers=5,
        idle=("node2-4009",),
        paused=None,
        mean_s=41.0,
        rate_per_hour=351.0,
        left_s=2050.0,
        score=Score("OMQ", 0.4123, done, 0.391, 0.434),
    )
    workers = [WorkerRow(each.worker, each.episode, each.since_s) for each in running]
    view = BatchView(
        Path("/home/ann/study/lights"),
        True,
        None,
        status,
        tuple(cells),
        (*workers, WorkerRow("node2-4009", None, 31.0)),
    )
    return replace(view, **changes)


class StillFeed(RunFeed):
    """A feed of a run without a thread, whose view changes when a test changes it."""

    def __init__(self, view: RunView) -> None:
        self._view = view
        self.chosen: list[tuple[tuple[str, ...], int]] = []

    @property
    def view(self) -> RunView:
        return self._view

    @view.setter
    def view(self, view: RunView) -> None:
        self._view = view

    def choose(self, channels: Sequence[str], width: int) -> None:
        self.chosen.append((tuple(channels), width))

    def pause(self) -> None:
        self.view = replace(self.view, paused=True)

    def go_on(self) -> None:
        self.view = replace(self.view, paused=False)

    def single_step(self) -> None:
        """Nothing moves."""

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        return {"action": action, "arguments": arguments}

    def stop(self) -> None:
        self.view = replace(self.view, alive=False)

    def confirm(self) -> str:
        return ""

    def close(self) -> None:
        """There is no thread."""


class StillBatch(BatchFeed):
    """A feed of a batch without a thread, whose view changes when a test changes it."""

    def __init__(self, view: BatchView) -> None:
        self._view = view
        self.retried: list[tuple[str, ...]] = []

    @property
    def view(self) -> BatchView:
        return self._view

    @view.setter
    def view(self, view: BatchView) -> None:
        self._view = view

    def cancel(self) -> None:
        self.view = replace(self.view, alive=False)

    def retry(self, classes: Sequence[str]) -> int:
        self.retried.append(tuple(classes))
        return len(classes)

    def close(self) -> None:
        """There is no thread."""
