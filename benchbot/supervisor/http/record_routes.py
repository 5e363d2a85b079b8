"""The route by which the host of a run has it recorded while it is under way (docs/wire.md)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from benchbot.supervisor.http import bodies
from benchbot.supervisor.recording.recordings import Recordings
from benchbot.supervisor.refused import RefusedError

PATH = "/api/v1/watch/record"


class RecordRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body: recordings to begin, the folder by the recorder's name, and the folders of those to finish."""

    begin: dict[str, str] = {}
    finish: list[str] = []


def routes(recordings: Recordings, check_host: Callable[[Request], None]) -> list[Route]:
    """Return the route; `check_host` raises RefusedError for whoever is not the host."""

    async def show(request: Request) -> Response:
        check_host(request)
        return bodies.respond(request, {"recordings": recordings.as_list()})

    async def record(request: Request) -> Response:
        check_host(request)
        body = await bodies.read(request, RecordRequest)
        return bodies.respond(request, await run_in_threadpool(_record, recordings, body))

    return [Route(PATH, show, methods=["GET"]), Route(PATH, record, methods=["POST"])]


def _record(recordings: Recordings, body: RecordRequest) -> dict[str, Any]:
    relative = [folder for folder in (*body.begin.values(), *body.finish) if not Path(folder).is_absolute()]
    if relative:
        raise RefusedError(
            400,
            f"'{relative[0]}' is no absolute path.",
            "The supervisor has another working folder than you.",
            "Send the whole path of the folder, from / on.",
        )
    recordings.finish([Path(folder) for folder in body.finish])
    recordings.begin({name: Path(folder) for name, folder in body.begin.items()})
    return {"recordings": recordings.as_list()}
