"""The routes of BenchBot v2's supervisor (docs/wire.md): v2's published client runs against them as it is.

Everything is a GET with a JSON body, the actions too; a slash may be doubled.
"""

from collections.abc import Awaitable, Callable
from functools import partial
from http import HTTPStatus
from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from benchbot.cli.kit import console
from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.errors import did_you_mean
from benchbot.core.results import public_environment
from benchbot.core.selection import Selection
from benchbot.plugins.v2 import encoding
from benchbot.plugins.v2.robot import Mover, V2Robot
from benchbot.supervisor import RefusedError
from benchbot.supervisor.http import bodies
from benchbot.supervisor.http.access import Access, Endpoint
from benchbot.supervisor.http.server import while_connected
from benchbot.supervisor.run import Run
from benchbot.wire.encoding import MAX_BODY_BYTES

HELLO = "Hello, I am the BenchBot supervisor"
HELLO_ROBOT = "Hello, I am the BenchBot robot controller"
MAX_ARGUMENTS_BYTES = 2**16
NO_TOKEN = (
    "A client of BenchBot v2 was refused: it knows no token.",
    "Submit its solution with: benchbot submit --v2-client …   Or let every such client in: benchbot run --no-token …",
)
"""What the run's terminal says: v2's client itself says only that communication failed."""


class Call(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a call of a results function."""

    args: list[Any] = []
    kwargs: dict[str, Any] = {}


def routes(run: Run, access: Access) -> list[Route]:
    """Return v2's routes. All but the greeting ask for a token, unless the run lets clients in that know none."""
    robot = V2Robot(run)
    configuration = config(run.selection)
    functions: list[str] = sorted(configuration["results"].get("functions", {}))
    states = {
        "config": lambda: configuration,
        "is_collided": robot.is_collided,
        "is_dirty": robot.is_dirty,
        "is_finished": robot.is_finished,
        "is_running": robot.is_running,
        "selected_environment": robot.selected_environment,
    }
    commands = {
        "next": robot.next,
        "prepare": robot.prepare,
        "reset": robot.reset,
        "restart": robot.restart,
        "start": robot.start,
        "stop": robot.stop,
    }

    told: list[str] = []

    def entered(endpoint: Endpoint) -> Endpoint:
        by_token, by_anybody = access.acting(endpoint), access.tokenless(endpoint)

        async def answer(request: Request) -> Response:
            # Whoever has a token, as the proxy of a submission, is that solution also where none is needed.
            checked = by_token if "authorization" in request.headers else by_anybody
            try:
                return await checked(request)
            except RefusedError as error:
                if error.status == HTTPStatus.UNAUTHORIZED and not told:
                    told.extend(NO_TOKEN)
                    console.note(*NO_TOKEN)
                raise

        return answer

    async def hello(request: Request) -> Response:
        return _json(HELLO)

    async def hello_robot(request: Request) -> Response:
        return _json(HELLO_ROBOT)

    async def config_at(request: Request) -> Response:
        await _arguments(request)
        return _json(_look_up(configuration, request.path_params.get("path", "")))

    async def function_names(request: Request) -> Response:
        await _arguments(request)
        return _json(functions)

    async def function(request: Request) -> Response:
        body = await bodies.read(request, Call, MAX_BODY_BYTES)
        name = request.path_params["name"]
        if name not in functions:
            raise _unknown("results function", name, functions)
        value = await run_in_threadpool(run.results_function, name, body.args, body.kwargs)
        return await run_in_threadpool(_json, value)

    async def robot_command(request: Request) -> Response:
        await _arguments(request)
        name = request.path_params["name"]
        if name in states:
            return _json(states[name]())
        if name not in commands:
            raise _unknown("command of the robot", name, [*states, *commands])
        _require_json(request)
        return _json(await _in_turn(request, run, robot, commands[name]))

    async def connection(request: Request) -> Response:
        _require_json(request)
        arguments = await _arguments(request)
        name = request.path_params["name"]
        selection = run.selection
        if name in selection.actions:
            await _in_turn(request, run, robot, partial(robot.act, name, arguments))
            return HTMLResponse(b"null")
        if name not in selection.observations:
            raise _not_connected(name, selection)
        if arguments:
            raise RefusedError(
                400,
                f"The observation '{name}' takes no arguments.",
                f"The body has: {', '.join(arguments)}.",
                "Send {}.",
            )
        value = await _in_turn(request, run, robot, partial(robot.observe, name))
        return HTMLResponse(await run_in_threadpool(encoding.observation, name, value))

    return [
        Route("/", hello),
        *(
            Route(path, entered(endpoint))
            for path, endpoint in (
                ("/config", config_at),
                ("/config/{path:path}", config_at),
                ("/connections/{name}", connection),
                ("/results_functions", function_names),
                ("/results_functions/", function_names),
                ("/results_functions/{name}", function),
                ("/robot", hello_robot),
                ("/robot/", hello_robot),
                ("/robot/{name}", robot_command),
            )
        ),
    ]


def config(selection: Selection) -> dict[str, Any]:
    """Return the configuration as v2 showed it: `environments`, `results`, `robot` and `task`, no ground truth.

    The connections name the callbacks of v2's client that fit what is sent to it, whatever the robot declares.
    """
    connections = {
        name: {key: value for key, value in connection.items() if key != "callback_api"}
        for name, connection in selection.robot.data["connections"].items()
    }
    connections |= {name: {"connection": "ros_to_api"} for name in selection.observations if name in GIVEN_BY_EPISODES}
    if "image_rgb" in connections:
        connections["image_rgb"]["callback_api"] = encoding.IMAGE_RGB_CALLBACK
    results_format = selection.results_format
    return {
        "environments": [public_environment(scene) for scene in selection.environments],
        "results": {} if results_format is None else results_format.data,
        "robot": {**selection.robot.data, "connections": connections},
        "task": {"localisation": "ground_truth", "scene_count": 1, **selection.task.data},
    }


async def _in_turn(request: Request, run: Run, robot: V2Robot, command: Callable[[Mover], Awaitable[Any]]) -> Any:
    """Return what a command returns when it is its turn; nothing is done for a client that has disconnected by then."""
    async with robot.turn:
        if await request.is_disconnected():
            raise ClientDisconnect
        return await command(lambda call: while_connected(request, run, call))


async def _arguments(request: Request) -> dict[str, Any]:
    return await bodies.read(request, dict[str, Any], MAX_ARGUMENTS_BYTES)


def _json(value: Any) -> Response:
    return Response(encoding.document(value), media_type=bodies.JSON)


def _require_json(request: Request) -> None:
    """Raise RefusedError (415) for a body that is not declared as JSON.

    A web page cannot make the user's browser send such a request to another site: what moves the robot asks for it.
    """
    if bodies.content_type(request) != bodies.JSON:
        raise RefusedError(
            415,
            "What uses the robot asks for a JSON body.",
            "The request has no body, or one of another type.",
            f"Send {{}} with the header: Content-Type: {bodies.JSON}",
        )


def _look_up(configuration: dict[str, Any], path: str) -> Any:
    value: Any = configuration
    for key in path.split("/") if path else ():
        if not isinstance(value, dict) or key not in value:
            known = list(value) if isinstance(value, dict) else []
            raise _unknown("entry of the configuration", path, [str(key) for key in known])
        value = value[key]
    return value


def _not_connected(name: str, selection: Selection) -> RefusedError:
    offered = [*selection.observations, *selection.actions]
    if name in (OBSERVATIONS.keys() | ACTIONS.keys()):
        return RefusedError(
            404,
            f"The task '{selection.task.name}' has no connection '{name}'.",
            f"It has: {', '.join(offered)}.",
            "Use one of these, or run another task.",
        )
    return _unknown("connection", name, offered)


def _unknown(what: str, name: str, known: list[str]) -> RefusedError:
    return RefusedError(
        404,
        f"There is no {what} '{name}'.",
        f"There is: {', '.join(known) or 'none'}.{did_you_mean(name, known)}",
        "Use one of these.",
    )
