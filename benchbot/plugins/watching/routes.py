"""The routes to watch, hold and drive a run: `/api/v1/watch…` (docs/wire.md), with the operator's token only.

A solution must not use them: they return the true pose, hold its steps, and drive.
"""

import asyncio
import math
import os
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from benchbot.plugins.watching.usage import ProcessUsage, process_tree_usage
from benchbot.supervisor import RefusedError
from benchbot.supervisor.description import progress_document
from benchbot.supervisor.http import bodies
from benchbot.supervisor.http.access import Access
from benchbot.supervisor.observation_tap import SnapshotRequest
from benchbot.supervisor.run import Run

DEFAULT_WIDTH, MOST_WIDE = 320, 4096
MOST_POINTS = 500
USAGE_PERIOD_S = 1.0
_PATH_DIGITS = 3


class GateRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a request to the gate: close or open it, or let so many steps through and hold the next."""

    paused: bool | None = None
    steps: int | None = None


class DriveRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of an action by hand."""

    action: str
    arguments: dict[str, Any] = {}


class WatchRoutes:
    """The endpoints to watch, hold and drive one run."""

    def __init__(self, run: Run) -> None:
        self._run = run
        # Not in the thread pool of the requests: all of those threads may be waiting at the gate.
        self._teleop = ThreadPoolExecutor(1, "benchbot-teleop")
        self._usage: tuple[float, ProcessUsage | None] = (-math.inf, None)

    async def watch(self, request: Request) -> Response:
        """Answer the state; `session=1` adds a description, `after=N` a snapshot, and `path=0` omits the path."""
        run = self._run
        gate = run.gate.state
        if time.monotonic() - self._usage[0] > USAGE_PERIOD_S:
            self._usage = time.monotonic(), process_tree_usage(os.getpid())
        at_s, used = self._usage
        answer: dict[str, Any] = {
            "progress": progress_document(run.progress, with_pose=True),
            "gate": {"paused": gate.paused, "steps_left": gate.steps_left, "held": gate.held},
            "driven_by_hand": run.session.driven_by_hand,
            "last": run.last_action,
            "usage": None if used is None else {"at_s": at_s, "cpu_s": used.cpu_s, "memory_bytes": used.memory_bytes},
            "result": str(run.result_path) if run.result_path.exists() else None,
        }
        if request.query_params.get("path") != "0":
            answer["path"] = _path(run)
        if request.query_params.get("session") == "1":
            answer["session"] = run.describe()
        if "after" in request.query_params:
            answer["look"] = self._look(request)
        return bodies.respond(request, answer)

    async def look(self, request: Request) -> Response:
        """Answer the newest observation, or 204 when there is none that is newer."""
        bodies.require_msgpack(request)
        seen = self._look(request)
        return Response(status_code=204) if seen is None else bodies.respond(request, seen)

    async def gate(self, request: Request) -> Response:
        """Hold the solution's next step, let it go on, or let some steps through."""
        body = await bodies.read(request, GateRequest)
        gate = self._run.gate
        if (body.paused is None) == (body.steps is None) or (body.steps is not None and body.steps < 1):
            raise RefusedError(
                400,
                "That is no order to the gate.",
                "It is either told to pause or not, or how many steps it lets through: at least one.",
                'Send {"paused": true}, {"paused": false} or {"steps": 1}.',
            )
        if body.steps is not None:
            gate.let_through(body.steps)
        else:
            (gate.close if body.paused else gate.open)()
        self._run.note_pause()
        now = gate.state
        return bodies.respond(request, {"paused": now.paused, "steps_left": now.steps_left, "held": now.held})

    async def drive(self, request: Request) -> Response:
        """Take an action by hand, to its end."""
        body = await bodies.read(request, DriveRequest)
        call = partial(self._run.drive, body.action, body.arguments)
        return bodies.respond(request, await asyncio.get_running_loop().run_in_executor(self._teleop, call))

    def _look(self, request: Request) -> dict[str, Any] | None:
        asked = request.query_params
        channels = tuple(sorted({name for name in asked.get("channels", "").split(",") if name}))
        if not channels:
            channels = self._run.selection.observations
        wanted = SnapshotRequest(channels, _number(asked.get("width"), DEFAULT_WIDTH, 1, MOST_WIDE))
        snapshot = self._run.observation_tap.snapshot(wanted, _number(asked.get("after"), 0, 0, 2**63))
        if snapshot is None:
            return None
        return {"number": snapshot.number, "stride": snapshot.stride, "observations": snapshot.observations}


def routes(run: Run, access: Access) -> list[Route]:
    """Return the routes of those who watch a run."""
    watch = WatchRoutes(run)
    endpoints = (
        ("", watch.watch, "GET"),
        ("/look", watch.look, "GET"),
        ("/gate", watch.gate, "POST"),
        ("/drive", watch.drive, "POST"),
    )
    return [
        Route(f"/api/v1/watch{path}", access.host(endpoint), methods=[method]) for path, endpoint, method in endpoints
    ]


def _path(run: Run) -> list[tuple[float, float]]:
    """Return the path of the robot in this scene: at most `MOST_POINTS` points, every n-th and the last."""
    tracks = run.session.tracks
    rows = tracks[-1].rows if tracks else []
    stride = -(-len(rows) // MOST_POINTS) or 1
    poses = [pose for _, pose in [*rows[::stride], *rows[-1:]]]
    return [(round(pose.x_m, _PATH_DIGITS), round(pose.y_m, _PATH_DIGITS)) for pose in poses]


def _number(text: str | None, default: int, least: int, most: int) -> int:
    """Return a number of a query, within bounds; raises RefusedError (400) for any other text."""
    if text is None:
        return default
    if not (text.isascii() and text.isdecimal() and len(text) < 20):
        raise RefusedError(400, f"'{text[:40]}' is not a number.", "The query asks for one.", "See docs/wire.md.")
    return min(max(int(text), least), most)
