"""Bodies of requests and responses: MessagePack or JSON, as the headers ask, within a cap."""

from typing import Any, TypeVar

import msgspec
from starlette.requests import Request
from starlette.responses import Response

from benchbot.core.errors import BenchbotError
from benchbot.supervisor import wire
from benchbot.supervisor.refused import RefusedError, status_of

MSGPACK = "application/msgpack"
JSON = "application/json"

T = TypeVar("T")


async def read(request: Request, kind: type[T], max_bytes: int = wire.MAX_BODY_BYTES) -> T:
    """Return a request's body as `kind`, an empty body as an empty mapping.

    Raises RefusedError 413 for a body over the cap, 415 for another content type, 400 for a body that does not fit.
    """
    body = await _limited(request, max_bytes)
    kind_of_body = content_type(request)
    if not body:
        value: Any = {}
    elif kind_of_body == MSGPACK:
        value = wire.decode(body)
    elif kind_of_body == JSON:
        value = _decode_json(bytes(body))
    else:
        raise RefusedError(
            415,
            f"Bodies of type '{kind_of_body or 'unknown'}' are not understood.",
            f"The supervisor reads {MSGPACK} and {JSON}.",
            f"Send one of these, with its Content-Type header, for example: Content-Type: {JSON}",
        )
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise RefusedError(
            400, f"The request to {request.url.path} is not right.", f"{error}.", "See docs/wire.md."
        ) from error


def content_type(request: Request) -> str:
    """Return the media type of a request's body, in lower case and without parameters; empty when none is named."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def require_msgpack(request: Request) -> None:
    """Raise RefusedError 406 when the client does not accept what carries arrays, before anything has happened."""
    if not _accepts(request, MSGPACK):
        raise _not_json(request)


def respond(request: Request, value: Any) -> Response:
    """Return a response as the client accepts it: MessagePack unless only JSON is acceptable."""
    if _accepts(request, MSGPACK):
        return encoded(wire.encode(value))
    try:
        return Response(msgspec.json.encode(value), media_type=JSON)
    except TypeError as error:
        raise _not_json(request) from error


def encoded(body: bytes) -> Response:
    """Return the response with a body that is MessagePack already."""
    return Response(body, media_type=MSGPACK)


def respond_error(error: BenchbotError) -> Response:
    """Return the response that tells an error; always JSON, so that any tool can show it."""
    headers = {"WWW-Authenticate": "Bearer"} if status_of(error) == 401 else None
    return Response(msgspec.json.encode(error.as_dict()), status_of(error), headers, JSON)


def _not_json(request: Request) -> RefusedError:
    return RefusedError(
        406,
        "The answer holds arrays, which are sent as MessagePack only.",
        f"The request's Accept header is '{request.headers['accept']}'.",
        f"Send: Accept: {MSGPACK}",
    )


def _accepts(request: Request, media_type: str) -> bool:
    accept = request.headers.get("accept", "*/*")
    accepted = {part.partition(";")[0].strip().lower() for part in accept.split(",")}
    return not accepted.isdisjoint({media_type, "application/*", "*/*"})


async def _limited(request: Request, max_bytes: int) -> bytearray:
    too_large = RefusedError(
        413,
        "The request's body is too large.",
        f"The supervisor reads at most {max_bytes} bytes here.",
        "Send less: a result of this size is most likely not what the task asks for.",
    )
    declared = request.headers.get("content-length", "0")
    if declared.isdigit() and int(declared) > max_bytes:
        raise too_large
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > max_bytes:
            raise too_large
    return body


def _decode_json(body: bytes) -> Any:
    try:
        return msgspec.json.decode(body)
    except (msgspec.DecodeError, RecursionError) as error:
        raise RefusedError(
            400, "The request's body is not JSON.", f"{error}.", "Mend it, or send another Content-Type."
        ) from error
