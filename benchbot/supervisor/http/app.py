"""The HTTP application of a run: the routes of the v1 API (docs/wire.md)."""

import asyncio
import os
import pkgutil
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Receive, Scope, Send

import benchbot
from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.supervisor import Caller, RefusedError
from benchbot.supervisor.events import stream
from benchbot.supervisor.http import bodies
from benchbot.supervisor.http.access import OPERATOR, Access, Endpoint, check_head, check_share
from benchbot.supervisor.http.server import in_thread, while_connected
from benchbot.supervisor.platform import borrowed
from benchbot.supervisor.recording.host import Recordings
from benchbot.supervisor.run import Run
from benchbot.wire import encoding

NOT_THE_SOLUTIONS = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)

T = TypeVar("T")


class StepRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a step: no action only observes."""

    action: str | None = None
    arguments: dict[str, Any] = {}


class EmptyRequest(msgspec.Struct, forbid_unknown_fields=True):
    """An empty body."""


class Failure(msgspec.Struct, forbid_unknown_fields=True, rename={"failure": "class"}):
    """The failure of an episode, as reported by the program that ran the solution."""

    failure: FailureClass
    why: str


class ResultRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a result: a document, or none when the episode failed before there was one."""

    result: dict[str, Any] | None = None
    solution: dict[str, Any] | None = None
    failure: Failure | None = None


class StopRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a stop: who asks for it, in words, where that is the run's user."""

    by: Annotated[str, msgspec.Meta(max_length=80)] = ""


class FunctionRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a call of a results function."""

    args: list[Any] = []
    kwargs: dict[str, Any] = {}


class RecordRequest(msgspec.Struct, forbid_unknown_fields=True):
    """Recordings to begin, the folder by the recorder's name, and the folders of those to finish."""

    begin: dict[str, str] = {}
    finish: list[str] = []


class OperatorRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of the operator's confirmation that the request is done."""

    done: bool


def create_app(
    run: Run, token: str, operator_token: str, *, open_to_v2: bool = False, folder: Path | None = None
) -> Starlette:
    """Return the application of one run. Every route but `/` and `/api/v1/health` needs the bearer token.

    The routes of the operator and the host need a token of their own: a solution must not confirm what a person is
    asked to do, nor see more than it is shown. With `open_to_v2`, the routes of BenchBot v2 need none: v2's client has
    none. `folder` is that of a run which solutions may join (benchbot.wire.joining).
    """

    access = Access(token, operator_token, without_token=open_to_v2, folder=folder)

    async def health(request: Request) -> Response:
        document = {"name": "benchbot", "version": benchbot.__version__, "api": 1, "pid": os.getpid()}
        return bodies.respond(request, document)

    async def session(request: Request) -> Response:
        if (token := access.leased_to()) is not None:
            await in_thread(run.admit, token)
        return bodies.respond(request, run.describe())

    def observing(kind: type[T], call: Callable[[T, Caller, borrowed.Converter[bytes]], bytes]) -> Endpoint:
        async def observe(request: Request) -> Response:
            bodies.require_msgpack(request)
            body = await bodies.read(request, kind)
            # The answer is encoded while the request still has the session, and with it the arrays, to itself.
            encode = partial(borrowed.encode_answer, opened=request.headers.get(encoding.ARENA_HEADER))
            content = await while_connected(request, run, lambda caller: call(body, caller, encode))
            return Response(content, media_type=bodies.MSGPACK)

        return access.acting(observe)

    def reset(body: EmptyRequest, caller: Caller, encode: borrowed.Converter[bytes]) -> bytes:
        return run.reset(caller, encode)

    def step(body: StepRequest, caller: Caller, encode: borrowed.Converter[bytes]) -> bytes:
        return run.step(body.action, body.arguments, caller, encode)

    def next_scene(body: EmptyRequest, caller: Caller, encode: borrowed.Converter[bytes]) -> bytes:
        return run.next_scene(caller, encode)

    async def result(request: Request) -> Response:
        body = await bodies.read(request, ResultRequest, encoding.MAX_BODY_BYTES)
        if body.result is None and body.failure is None:
            raise RefusedError(
                400,
                "There is neither a result nor a failure to record.",
                "The body has neither 'result' nor 'failure'.",
                'Send {"result": {…}}, or {"failure": {"class": "agent", "why": "…"}}.',
            )
        failure = None if body.failure is None else (body.failure.failure, body.failure.why)
        if failure is not None and failure[0] in NOT_THE_SOLUTIONS and run.progress.failure is None:
            raise RefusedError(
                403,
                f"That it is a failure of class '{failure[0]}' is not for a solution to say.",
                "The run itself knows of none, and an episode that failed like that may be tried again.",
                "Say that the solution failed, with class 'agent'.",
            )
        finished = await in_thread(run.finish, body.result, body.solution, failure, access.leased_to())
        return bodies.respond(request, finished)

    async def results_function(request: Request) -> Response:
        body = await bodies.read(request, FunctionRequest, encoding.MAX_BODY_BYTES)
        name = request.path_params["name"]
        value = await in_thread(run.results_function, name, body.args, body.kwargs)
        return bodies.respond(request, {"value": value})

    async def events(request: Request) -> Response:
        content = stream(run.events, run.public_progress)
        return StreamingResponse(content, media_type="text/event-stream", headers={"Cache-Control": "no-store"})

    async def stop(request: Request) -> Response:
        by_solution = not access.is_operator(request)
        if by_solution:
            access.check_acting(request)
        body = await bodies.read(request, StopRequest)
        # It is the emergency stop: the robot does not wait until the thread that serves the run ends it in order.
        asyncio.get_running_loop().run_in_executor(None, partial(run.stop, body.by, by_solution=by_solution))
        return bodies.respond(request, {"stopping": True})

    async def operator(request: Request) -> Response:
        body = await bodies.read(request, OperatorRequest)
        if not body.done:
            raise RefusedError(
                400, "Nothing is confirmed.", "The body says 'done': false.", 'Send {"done": true} when it is done.'
            )
        return bodies.respond(request, {"confirmed": run.confirm()})

    async def recordings(request: Request) -> Response:
        return bodies.respond(request, {"recordings": run.recordings.as_list()})

    async def record(request: Request) -> Response:
        body = await bodies.read(request, RecordRequest)
        await in_thread(_record, run.recordings, body)
        return await recordings(request)

    app = Starlette(
        routes=[
            # First, since routes are matched in order and this one is in a solution's loop.
            Route("/api/v1/step", observing(StepRequest, step), methods=["POST"]),
            Route("/api/v1/health", health),
            Route("/api/v1/session", access.watched(session)),
            Route("/api/v1/events", access.solution(events)),
            Route("/api/v1/reset", observing(EmptyRequest, reset), methods=["POST"]),
            Route("/api/v1/next_scene", observing(EmptyRequest, next_scene), methods=["POST"]),
            Route("/api/v1/result", access.ending(result), methods=["POST"]),
            Route("/api/v1/results_functions/{name}", access.solution(results_function), methods=["POST"]),
            Route("/api/v1/stop", stop, methods=["POST"]),
            Route("/api/v1/operator", access.operator(operator), methods=["POST"]),
            Route("/api/v1/watch/record", access.host(recordings), methods=["GET"]),
            Route("/api/v1/watch/record", access.host(record), methods=["POST"]),
            *_routes_of_plugins(run, access),
        ],
        middleware=[
            Middleware(_admitting, access=access),
            Middleware(_following_up, run=run),
            Middleware(_merging_slashes),
        ],
        exception_handlers={
            BenchbotError: _benchbot_error,
            HTTPException: _http_error,
            ClientDisconnect: _client_gone,
            Exception: _internal_error,
        },
    )
    app.state.large_bodies = asyncio.Semaphore(1)
    return app


def _routes_of_plugins(run: Run, access: Access) -> Iterator[BaseRoute]:
    for provided in plugin_manager.load().pool("routes").values():
        yield from pkgutil.resolve_name(provided.value.target)(run, access)


def _admitting(app: ASGIApp, access: Access) -> ASGIApp:
    """Return an application that refuses what a proxy, or a browser, may have been made to take for something else.

    It keeps a share of all connections for the operator: whoever has the solution's token can fill the rest only.
    """
    under_way = 0

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        nonlocal under_way
        by_operator = access.is_operator(request := Request(scope))
        setattr(request.state, OPERATOR, by_operator)
        try:
            check_head(request.headers)
            if not by_operator:
                check_share(under_way)
        except RefusedError as error:
            response = bodies.respond_error(error)
            response.headers["Connection"] = "close"
            await response(scope, receive, send)
            return
        under_way += not by_operator
        try:
            await app(scope, receive, send)
        finally:
            under_way -= not by_operator

    return answer


def _merging_slashes(app: ASGIApp) -> ASGIApp:
    """Return an application that takes doubled slashes in a path for one, as v2's server did: its client sends them."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        if "//" in scope["path"]:
            scope = {**scope, "path": re.sub("//+", "/", scope["path"])}
        await app(scope, receive, send)

    return answer


def _following_up(app: ASGIApp, run: Run) -> ASGIApp:
    """Return an application that does what an answer does not wait for as soon as that has been sent."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        await app(scope, receive, send)
        if run.due:
            await in_thread(run.follow_up)

    return answer


def _record(recordings: Recordings, body: RecordRequest) -> None:
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


async def _benchbot_error(request: Request, error: Any) -> Response:
    return bodies.respond_error(error)


async def _http_error(request: Request, error: Any) -> Response:
    path = request.url.path
    if error.status_code == 405:
        refused = RefusedError(
            405,
            f"{request.method} is not possible on {path}.",
            "The route exists, with another method.",
            f"Use: {(error.headers or {}).get('Allow', 'another method')}",
        )
    else:
        refused = RefusedError(
            error.status_code,
            f"There is nothing at {path}.",
            f"{error.detail}.",
            "The routes are listed in docs/wire.md.",
        )
    return bodies.respond_error(refused)


async def _client_gone(request: Request, error: Exception) -> Response:
    return Response(status_code=400)


async def _internal_error(request: Request, error: Exception) -> Response:
    return bodies.respond_mistake()
