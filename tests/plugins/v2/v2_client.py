"""BenchBot v2's published client on the wire, restated with the standard library and jsonpickle.

Each query is a GET with a JSON body, and a status of 300 or more is a failed connection. Its addresses have doubled
slashes where it joins a base that ends with one to a route that begins with one.
"""

import http.client
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Any
from urllib.parse import urlsplit

import httpx
import jsonpickle
import jsonpickle.ext.numpy as jsonpickle_numpy
import numpy as np

from tests.supervisor.harness import Served

SUCCESS, FINISHED, COLLISION = "SUCCESS", "FINISHED", "COLLISION"

jsonpickle_numpy.register_handlers()


def convert_to_rgb(data: Mapping[str, Any]) -> Any:
    return data["data"][..., ::-1] if data["encoding"] == "bgr8" else data["data"]


CALLBACKS: Mapping[str, Callable[[Any], Any]] = {"api_callbacks.convert_to_rgb": convert_to_rgb}


class V2Client:
    """Asks as v2's `BenchBot` asks. `transcript` holds (path, body, status, content type, content) of each query."""

    def __init__(self, supervisor_address: str, token: str | None = None) -> None:
        address = urlsplit(supervisor_address)
        self._connection = http.client.HTTPConnection(address.hostname or "", address.port or 80, timeout=60)
        self._headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        self._callbacks: dict[str, Callable[[Any], Any] | None] = {}
        self.transcript: list[tuple[str, Any, int, str, bytes]] = []

    def query(self, path: str, data: Any = None) -> Any:
        body = {} if data is None else data
        headers = {"Content-Type": "application/json", "Accept": "*/*", **self._headers}
        self._connection.request("GET", path, json.dumps(body), headers)
        response = self._connection.getresponse()
        content = response.read()
        self.transcript.append((path, body, response.status, response.headers["Content-Type"], content))
        if response.status >= 300:
            raise ConnectionError(f"{response.status} from {path}: {content.decode()}")
        return jsonpickle.decode(content.decode())

    def start(self) -> None:
        self.query("//")
        while not self.query("/robot/is_running")["is_running"]:
            pass
        connections = self.query("/config/robot")["connections"]
        self._callbacks = {
            name: CALLBACKS[connection["callback_api"]] if "callback_api" in connection else None
            for name, connection in connections.items()
        }
        if self.query("/robot/selected_environment")["number"] != 0:
            self.query("/robot/restart")
        else:
            self.reset()

    @property
    def actions(self) -> list[str]:
        over = self.query("/robot/is_collided")["is_collided"] or self.query("/robot/is_finished")["is_finished"]
        actions: list[str] = [] if over else self.query("/config/task/actions")
        return actions

    def step(self, action: str | None, **arguments: Any) -> tuple[dict[str, Any], str]:
        if action is not None:
            if action not in self.actions:
                raise ValueError(action)
            self.query(f"/connections/{action}", arguments)
        result = SUCCESS
        if self.query("/robot/is_collided")["is_collided"]:
            result = COLLISION
        elif self.query("/robot/is_finished")["is_finished"]:
            result = FINISHED
        raw = {name: self.query(f"/connections/{name}") for name in self.query("/config/task/observations")}
        raw["scene_number"] = self.query("/robot/selected_environment")["number"]
        observations = {}
        for name, value in raw.items():
            callback = self._callbacks.get(name)
            observations[name] = value if callback is None else callback(value)
        return observations, result

    def reset(self) -> tuple[dict[str, Any], str]:
        if self.query("/robot/is_dirty")["is_dirty"]:
            self.query("/robot/reset")
        return self.step(None)

    def next_scene(self) -> bool:
        if self.query("/robot/is_collided")["is_collided"]:
            raise RuntimeError("collided")
        return bool(self.query("/robot/next")["next_success"])

    def empty_results(self) -> dict[str, Any]:
        return {
            "task_details": self.query("/config/task"),
            "environment_details": self.query("/config/environments"),
            "results": self.query("/results_functions/create"),
        }

    def results_functions(self) -> dict[str, Callable[..., Any]]:
        def function(name: str) -> Callable[..., Any]:
            return lambda *args, **kwargs: self.query(
                f"/results_functions//{name}", {"args": list(args), "kwargs": kwargs}
            )

        return {name: function(name) for name in self.query("/results_functions//")}

    def close(self) -> None:
        self._connection.close()


def equal(ours: Any, theirs: Any) -> bool:
    """Say whether two nested values are the same: types, dtypes, shapes and elements, NaN included."""
    if isinstance(ours, np.ndarray):
        same_kind = isinstance(theirs, np.ndarray) and ours.dtype == theirs.dtype
        return same_kind and np.array_equal(ours, theirs, equal_nan=ours.dtype.kind == "f")
    if isinstance(ours, dict):
        return isinstance(theirs, dict) and list(ours) == list(theirs) and all(equal(ours[k], theirs[k]) for k in ours)
    if isinstance(ours, list | tuple):
        return type(ours) is type(theirs) and len(ours) == len(theirs) and all(map(equal, ours, theirs))
    return type(ours) is type(theirs) and (ours == theirs or (ours != ours and theirs != theirs))


@contextmanager
def v2(served: Served, token: str | None = None) -> Iterator[V2Client]:
    with closing(V2Client(served.url, token)) as client:
        yield client


def get(served: Served, path: str, body: Any = None) -> tuple[int, Any]:
    with httpx.Client(base_url=served.url, timeout=60) as http:
        response = http.request("GET", path, json={} if body is None else body)
    return response.status_code, response.json()


def run_agent(bench: V2Client) -> dict[str, Any]:
    """The loop of v2's `BenchBot.run` with its example `hello_passive`, which finds nothing."""

    def scene() -> None:
        _, result = bench.reset()
        while result == SUCCESS:
            _, result = bench.step(bench.actions[0])

    scene()
    while bench.next_scene():
        scene()
    return bench.empty_results()
