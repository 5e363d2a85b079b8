"""Requests whose clients wait for the robot: what happens when they hang up meanwhile."""

import asyncio
from collections.abc import Callable
from typing import TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from benchbot.supervisor.run import Caller, Run

T = TypeVar("T")


async def while_there(request: Request, run: Run, call: Callable[[Caller], T]) -> T:
    """Return what a call that may move the robot returns; the run is told when its client hangs up meanwhile."""
    caller = Caller()

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        # Not among the threads of the requests: those may all be waiting for their turn.
        await asyncio.to_thread(run.hang_up, caller)

    watching = asyncio.create_task(watch())
    try:
        return await run_in_threadpool(call, caller)
    finally:
        watching.cancel()
