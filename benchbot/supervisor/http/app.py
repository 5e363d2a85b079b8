"""The HTTP application of a run: the routes of the v1 API (docs/wire.md)."""

import asyncio
import hmac
import os
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from typing import Any

import msgspec
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

import benchbot
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.plugins.v2 import routes
from benchbot.plugins.watching.routes import Desk
from benchbot.supervisor.http import bodies, observing, record_routes
from benchbot.supervisor.http.express import Express, Reader
from benchbot.supervisor.http.waiting import while_there
from benchbot.supervisor.refused import RefusedError
from benchbot.supervisor.run import Run
from benchbot.wire import encoding

PROGRESS_PERIOD_S = 0.1
HEARTBEAT_S = 15.0
NOT_THE_SOLUTIONS = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)

Endpoint = Callable[[Request], Awaitable[Response]]


class Failure(msgspec.Struct, forbid_unknown_fields=True, rename={"failure": "class"}):
    """Why an episode failed, as told by who ran the solution."""

    failure: FailureClass
    why: str


class ResultRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a result: a document, or none when the episode failed before there was one."""

    result: dict[str, Any] | None = None
    solution: dict[str, Any] | None = None
    failure: Failure | None = None


class FunctionRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a call of a results function."""

    args: list[Any] = []
    kwargs: dict[str, Any] = {}


class OperatorRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of the operator's word that what they were asked is done."""

    done: bool


class Application(Starlette):
    """An application that also answers some requests without HTTP's detours: see `express`."""

    express: Callable[[bytes], Express | None]


def create_app(run: Run, token: str, operator_token: str, *, open_to_v2: bool = False) -> Application:
    """Return the application of one run. Every route but `/` and `/api/v1/health` needs the bearer token.

    The operator's route and those of who watches need a token of their own: a solution must not confirm what a person
    is asked to do, nor see more than it is shown. With
    `open_to_v2`, the routes of BenchBot v2 need none, since v2's client has none.
    """

    async def health(request: Request) -> Response:
        document = {"name": "benchbot", "version": benchbot.__version__, "api": 1, "pid": os.getpid()}
        return bodies.respond(request, document)

    async def session(request: Request) -> Response:
        return bodies.respond(request, run.describe())

    def observed(route: str) -> Endpoint:
        async def observe(request: Request) -> Response:
            bodies.require_msgpack(request)
            body = await bodies.read(request, observing.BODIES[route])
            opened = request.headers.get(encoding.ARENA_HEADER)
            answer = partial(observing.answer, run, route, body, opened)
            return bodies.encoded(await while_there(request, run, answer))

        return observe

    async def result(request: Request) -> Response:
        body = await bodies.read(request, ResultRequest)
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
        finished = await run_in_threadpool(run.finish, body.result, body.solution, failure)
        return bodies.respond(request, finished)

    async def results_function(request: Request) -> Response:
        body = await bodies.read(request, FunctionRequest)
        name = request.path_params["name"]
        value = await run_in_threadpool(run.results_function, name, body.args, body.kwargs)
        return bodies.respond(request, {"value": value})

    async def events(request: Request) -> Response:
        return StreamingResponse(
            _event_stream(run), media_type="text/event-stream", headers={"Cache-Control": "no-store"}
        )

    async def stop(request: Request) -> Response:
        by_solution = not _has_token(request, operator_token)
        if by_solution:
            _check_token(request, token)
        await bodies.read(request, observing.Nothing)
        # It is the emergency stop: the robot does not wait for whoever serves the run to wake up and end it in order.
        asyncio.get_running_loop().run_in_executor(None, partial(run.stop, by_solution=by_solution))
        return bodies.respond(request, {"stopping": True})

    async def operator(request: Request) -> Response:
        _check_operator(request, token, operator_token)
        body = await bodies.read(request, OperatorRequest)
        if not body.done:
            raise RefusedError(
                400, "Nothing is confirmed.", "The body says 'done': false.", 'Send {"done": true} when it is done.'
            )
        return bodies.respond(request, {"confirmed": run.confirm()})

    def private(endpoint: Endpoint) -> Endpoint:
        async def checked(request: Request) -> Response:
            _check_token(request, token)
            return await endpoint(request)

        return checked

    def local(endpoint: Endpoint) -> Endpoint:
        async def checked(request: Request) -> Response:
            routes.check_local_name(request)
            return await endpoint(request)

        return checked

    app = Application(
        routes=[
            *routes.routes(run, local if open_to_v2 else private),
            Route("/api/v1/health", health),
            Route("/api/v1/session", private(session)),
            Route("/api/v1/events", private(events)),
            *(Route(f"/api/v1/{route}", private(observed(route)), methods=["POST"]) for route in observing.BODIES),
            Route("/api/v1/result", private(result), methods=["POST"]),
            Route("/api/v1/results_functions/{name}", private(results_function), methods=["POST"]),
            Route("/api/v1/stop", stop, methods=["POST"]),
            Route("/api/v1/operator", operator, methods=["POST"]),
            *Desk(run, partial(_check_host, token=token, operator_token=operator_token)).routes(),
            *record_routes.routes(run.recordings, partial(_check_host, token=token, operator_token=operator_token)),
        ],
        middleware=[Middleware(routes.MergedSlashes)],
        exception_handlers={
            BenchbotError: _benchbot_error,
            HTTPException: _http_error,
            ClientDisconnect: _client_gone,
            Exception: _internal_error,
        },
    )
    app.express = Reader(run, token).read
    return app


def _has_token(request: Request, token: str) -> bool:
    given = request.headers.get("authorization", "")
    # Compared as bytes: compare_digest takes no text beyond ASCII.
    return hmac.compare_digest(given.encode("utf-8", "replace"), f"Bearer {token}".encode())


def _check_operator(request: Request, token: str, operator_token: str) -> None:
    if _has_token(request, operator_token):
        return
    _check_token(request, token)
    raise RefusedError(
        403,
        "Only the operator can say that this is done.",
        "The token is the solution's: a program does not know what a person beside the robot has done.",
        "Have the person type: benchbot ready",
    )


def _check_host(request: Request, *, token: str, operator_token: str) -> None:
    if _has_token(request, operator_token):
        return
    _check_token(request, token)
    raise RefusedError(
        403,
        "Only the host of the run may look on.",
        "The token is the solution's, and what is shown here is not for solutions.",
        "Take the operator's token from the run's state file, or type: benchbot tui",
    )


def _check_token(request: Request, token: str) -> None:
    if not _has_token(request, token):
        raise RefusedError(
            401,
            "The supervisor does not know you.",
            "The request has no bearer token, or not the one of this run.",
            "Send the run's token: Authorization: Bearer $BENCHBOT_TOKEN",
        )


async def _event_stream(run: Run) -> AsyncIterator[bytes]:
    """Yield server-sent events: what happens as it happens, progress when it changed, at most ten times a second."""
    shown: dict[str, Any] = {}
    spoken_s = time.monotonic()
    with run.events.subscribed() as queue:
        while True:
            progress = run.public_progress()
            # Time passes by itself: that alone is no news.
            news = {key: value for key, value in progress.items() if key != "wall_time_s"}
            if news != shown:
                shown, spoken_s = news, time.monotonic()
                yield _sse("progress", progress)
            tick_s = time.monotonic() + PROGRESS_PERIOD_S
            while (left_s := tick_s - time.monotonic()) > 0:
                try:
                    event = await asyncio.wait_for(queue.get(), left_s)
                except TimeoutError:
                    break
                spoken_s = time.monotonic()
                yield _sse(event.kind, event.data)
                if event.kind == "closed":
                    return
            if time.monotonic() - spoken_s > HEARTBEAT_S:
                spoken_s = time.monotonic()
                yield b": still here\n\n"


def _sse(kind: str, data: dict[str, Any]) -> bytes:
    # https://html.spec.whatwg.org/multipage/server-sent-events.html
    return b"event: %s\ndata: %s\n\n" % (kind.encode(), msgspec.json.encode(data))


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
