"""Runs that are under way: a feed of each that is looked at, as plain data and pictures."""

import base64
import time
from contextlib import suppress
from io import BytesIO
from threading import Lock
from typing import Any

import numpy as np
from PIL import Image

from benchbot.plugin import BenchbotError
from benchbot.viewing import LIGHT, RunFeed, RunView, installed_map, occupancy_of, one_line, ramp
from benchbot_view.episode import catalog, object_of
from benchbot_view.index import Index
from benchbot_view.rows import id_of

CHANNELS = {"frame": "image_rgb", "depth": "image_depth"}
WIDTH_PX = 640
FORGOTTEN_AFTER_S = 15.0
"""The time after which a feed that nobody looks at is closed."""
MOST_LINES = 60


class LiveRuns:
    """The feeds of the runs that are looked at; safe to use from several threads."""

    def __init__(self, index: Index) -> None:
        self._index = index
        self._lock = Lock()
        self._feeds: dict[str, tuple[RunFeed, float]] = {}

    def describe(self, id_: str) -> dict[str, Any]:
        """Return the place of a run: its map, with what truly stands there."""
        state = self._index.runs[id_]
        known = catalog()
        name = ":".join(state.environment.split(":")[:2])
        scene: dict[str, Any] = {"name": one_line(name), "low": [-4, -4], "high": [4, 4], "walls": None}
        scene |= {"path": [], "goals": []}
        occupancy = occupancy_of(known.find("environments", name))
        objects = []
        # An environment that is not installed here has no map to show.
        with suppress(BenchbotError):
            objects = [item for item in installed_map(known, name).objects if item.true is not None]
        corners = [] if occupancy is None else [occupancy.low, occupancy.high]
        corners += [corner for item in objects for corner in (item.boxes[0].low, item.boxes[0].high)]
        if corners:
            xs, ys = [float(x) for x, *_ in corners], [float(y) for _, y, *_ in corners]
            scene |= {"low": [min(xs) - 0.4, min(ys) - 0.4], "high": [max(xs) + 0.4, max(ys) + 0.4]}
        if occupancy is not None:
            picture = base64.b64encode(occupancy.png(LIGHT.wall)).decode()
            scene["walls"] = {
                "low": list(occupancy.low),
                "high": list(occupancy.high),
                "href": f"data:image/png;base64,{picture}",
            }
        return {"scene": scene, "objects": [object_of(number, item) for number, item in enumerate(objects)]}

    def look(self, id_: str) -> dict[str, Any] | None:
        """Return where a run stands, None for one that is not known."""
        feed = self._feed(id_)
        return None if feed is None else _told(feed.view)

    def picture(self, id_: str, kind: str) -> bytes | None:
        """Return the newest picture of a channel as PNG."""
        feed = self._feed(id_)
        snapshot = None if feed is None else feed.view.snapshot
        pixels = None if snapshot is None else snapshot.images.get(CHANNELS.get(kind, ""))
        if pixels is None:
            return None
        array = np.asarray(pixels)
        if kind == "depth":
            valid = np.isfinite(array) & (array > 0)
            far_m = max(float(np.percentile(array[valid], 99)), 1.0) if valid.any() else 1.0
            levels = (np.clip(np.where(valid, array, far_m) / far_m, 0, 1) * 255).astype(np.uint8)
            array = ramp()[levels]
        buffer = BytesIO()
        Image.fromarray(array).save(buffer, "PNG", compress_level=1)
        return buffer.getvalue()

    def rest(self) -> None:
        """Close the feeds that nobody looks at."""
        with self._lock:
            now_s = time.monotonic()
            for id_, (feed, looked_s) in list(self._feeds.items()):
                if now_s - looked_s > FORGOTTEN_AFTER_S:
                    feed.close()
                    del self._feeds[id_]

    def close(self) -> None:
        """Close all feeds."""
        with self._lock:
            for feed, _ in self._feeds.values():
                feed.close()
            self._feeds.clear()

    def _feed(self, id_: str) -> RunFeed | None:
        with self._lock:
            known = self._feeds.get(id_)
            state = self._index.runs.get(id_)
            if known is None and state is None:
                return None
            feed = known[0] if known else RunFeed(state, channels=tuple(CHANNELS.values()), width=WIDTH_PX)  # type: ignore[arg-type]
            self._feeds[id_] = feed, time.monotonic()
            return feed


def _told(view: RunView) -> dict[str, Any]:
    progress = view.progress
    pose = progress.get("pose") or {}
    last = view.last or {}
    return {
        "alive": view.alive,
        "problem": one_line(view.problem or ""),
        "number": 0 if view.snapshot is None else view.snapshot.number,
        "channels": [kind for kind, name in CHANNELS.items() if view.snapshot and name in view.snapshot.images],
        "frames": progress.get("frames", 0),
        "state": one_line(str(progress.get("state", ""))),
        "activity": one_line(str(progress.get("activity") or "")),
        "steps": progress.get("steps", 0),
        "time_s": progress.get("simulated_time_s", progress.get("robot_time_s")),
        "pose": pose,
        "path": view.path,
        "frames_per_s": round(view.frames_per_s, 2),
        "paused": view.paused,
        "last": one_line(f"{last.get('action') or ''} {last.get('outcome') or ''}").strip(),
        "log": [{"source": line.source, "level": line.level, "text": line.text} for line in view.log[-MOST_LINES:]],
        "result": None if view.result is None else id_of(view.result),
    }
