"""Bodies of requests and responses: MessagePack or JSON, as the headers ask, within a cap."""

import asyncio
import json
from collections.abc import Sequence
from contextlib import AsyncExitStack
from typing import Any, NoReturn, TypeVar

import msgspec
from starlette.requests import Request
from starlette.responses import Response

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.supervisor import RefusedError
from benchbot.wire import encoding

MSGPACK = "application/msgpack"
JSON = "application/json"

BODY_DEADLINE_S = 60.0
SMALL_BYTES = 2**18
"""The cap on bodies that hold no result. A larger one may take seconds to decode, and several would fill the memory."""

T = TypeVar("T")


async def read(request: Request, kind: type[T], max_bytes: int = SMALL_BYTES) -> T:
    """Return a request's body as `kind`, an empty body as an empty mapping.

    Raises RefusedError 408 for a body that does not come to its end, 413 for one over the cap, 415 for another content
    type, 400 for one that does not fit.
    """
    async with AsyncExitStack() as alone:
        body = await _in_time(request, max_bytes, alone)
        if len(body) <= SMALL_BYTES:
            return _converted(request, _decoded(request, body), kind)
        # Not in the thread that answers everybody: an operator can always end a run.
        return await asyncio.to_thread(lambda: _converted(request, _decoded(request, body), kind))


async def _in_time(request: Request, max_bytes: int, alone: AsyncExitStack) -> bytearray:
    try:
        async with asyncio.timeout(BODY_DEADLINE_S):
            return await _limited(request, max_bytes, alone)
    except TimeoutError as error:
        raise RefusedError(
            408,
            "The request's body did not come.",
            f"{BODY_DEADLINE_S:g} s after its head, it was not there.",
            "Send it at once, or with the right Content-Length.",
        ) from error


def _decoded(request: Request, body: bytearray) -> Any:
    if not body:
        return {}
    media_type = content_type(request)
    if media_type == MSGPACK:
        return encoding.decode(body)
    if media_type == JSON:
        try:
            return json.loads(body, object_pairs_hook=_unique, parse_constant=_not_finite)
        except (ValueError, RecursionError) as error:
            raise RefusedError(
                400, "The request's body is not JSON.", f"{error}.", "Mend it, or send another Content-Type."
            ) from error
    raise RefusedError(
        415,
        f"Bodies of type '{media_type or 'unknown'}' are not understood.",
        f"The supervisor reads {MSGPACK} and {JSON}.",
        f"Send one of these, with its Content-Type header, for example: Content-Type: {JSON}",
    )


def _converted(request: Request, value: Any, kind: type[T]) -> T:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        title = f"The request to {request.url.path} is not right."
        raise RefusedError(400, title, f"{error}.", "See docs/wire.md.") from error


def content_type(request: Request) -> str:
    """Return the media type of a request's body, in lower case and without parameters; empty when none is named."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def require_msgpack(request: Request) -> None:
    """Raise RefusedError 406 when the client does not accept what carries arrays, before anything has happened."""
    if not _accepts_msgpack(request):
        raise _not_json(request)


def respond(request: Request, value: Any) -> Response:
    """Return a response as the client accepts it: MessagePack unless only JSON is acceptable."""
    if _accepts_msgpack(request):
        return Response(encoding.encode(value), media_type=MSGPACK)
    try:
        return Response(msgspec.json.encode(value), media_type=JSON)
    except TypeError as error:
        raise _not_json(request) from error


def respond_error(error: BenchbotError) -> Response:
    """Return the response that tells an error; always JSON, so that any tool can show it."""
    status = status_of(error)
    headers = {"WWW-Authenticate": "Bearer"} if status == 401 else {}
    if status == 408:
        headers["Connection"] = "close"
    return Response(msgspec.json.encode(error.as_dict()), status, headers, JSON)


def status_of(error: BenchbotError) -> int:
    """Return the HTTP status of an error: 503 for the platform, 500 for what is not the client's fault, else 400."""
    if isinstance(error, RefusedError):
        return error.status
    if error.failure is FailureClass.PLATFORM:
        return 503
    return 500 if error.exit_code is ExitCode.INTERNAL else 400


def respond_mistake() -> Response:
    """Return the response that tells of a mistake of the supervisor's own, after which it hangs up."""
    error = BenchbotError(
        "The supervisor made a mistake.",
        "It could not carry out the request; its log says why.",
        "Report it, with the log in the run's folder.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
    response = respond_error(error)
    # A client that is told so does not send its next request into the void.
    response.headers["Connection"] = "close"
    return response


def _unique(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object; raises ValueError for a key that is in it twice, of which another reader may take the other."""
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice!r} is in an object twice")
    return found


def _not_finite(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def _not_json(request: Request) -> RefusedError:
    return RefusedError(
        406,
        "The answer holds arrays, which are sent as MessagePack only.",
        f"The request's Accept header is '{request.headers['accept']}'.",
        f"Send: Accept: {MSGPACK}",
    )


def _accepts_msgpack(request: Request) -> bool:
    named = {part.partition(";")[0].strip().lower() for part in request.headers.get("accept", "*/*").split(",")}
    return not named.isdisjoint({MSGPACK, "application/*", "*/*"})


async def _limited(request: Request, max_bytes: int, alone: AsyncExitStack) -> bytearray:
    """Return the body; from a size on that is not small, `alone` is entered: no other such body is read meanwhile."""
    too_large = RefusedError(
        413,
        "The request's body is too large.",
        f"The supervisor reads at most {max_bytes} bytes here.",
        "Send less: only results, and arguments of their functions, may be large.",
    )
    declared = request.headers.get("content-length", "0")
    if declared.isdigit() and int(declared) > max_bytes:
        raise too_large
    body = bytearray()
    async for chunk in request.stream():
        was_small = len(body) <= SMALL_BYTES
        body += chunk
        if len(body) > max_bytes:
            raise too_large
        if was_small and len(body) > SMALL_BYTES:
            await alone.enter_async_context(request.app.state.large_bodies)
    return body
