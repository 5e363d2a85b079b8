"""BenchBot v2's published client as a solution sees it, restated: what it asks, when, and how it fails.

The original sends its requests by a library that honours `http_proxy`, as urllib does here.
"""

import importlib
import json
import sys
import urllib.request
from abc import ABC, abstractmethod
from enum import Enum

import jsonpickle
import jsonpickle.ext.numpy

from . import api_callbacks

jsonpickle.ext.numpy.register_handlers()
__all__ = ["api_callbacks"]

RESULT_LOCATION = "/tmp/benchbot_result"


class ActionResult(Enum):
    SUCCESS = (0,)
    FINISHED = (1,)
    COLLISION = 2


class Agent(ABC):
    @abstractmethod
    def is_done(self, action_result): ...

    @abstractmethod
    def pick_action(self, observations, action_list): ...

    @abstractmethod
    def save_result(self, filename, empty_results, results_format_fns): ...


class BenchBot:
    def __init__(self, agent=None, supervisor_address="http://benchbot_supervisor:10000/", auto_start=True):
        self.agent, self.supervisor_address = agent, supervisor_address
        if auto_start:
            self.start()

    def _ask(self, route, data=None):
        headers = {"Content-Type": "application/json"}
        body = json.dumps({} if data is None else data).encode()
        request = urllib.request.Request(self.supervisor_address + route, body, headers, method="GET")
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return jsonpickle.decode(answer.read())
        except Exception:  # noqa: BLE001 - as v2's client does
            raise ConnectionError(f"Communication to BenchBot supervisor failed using the route: {route}") from None

    def _state(self, name):
        return self._ask(f"robot/{name}")[name]

    @property
    def actions(self):
        over = self._state("is_collided") or self._state("is_finished")
        return [] if over else self._ask("config/task/actions")

    @property
    def result_filename(self):
        return RESULT_LOCATION

    def start(self):
        self._ask("/")
        print("Connected, as v2's client does.", flush=True)
        while not self._state("is_running"):
            pass
        connections = self._ask("config/robot")["connections"].items()
        self._callbacks = {
            name: self._callback(each["callback_api"]) for name, each in connections if "callback_api" in each
        }
        if self._ask("robot/selected_environment")["number"] != 0:
            self._ask("robot/restart")
        else:
            self.reset()

    def _callback(self, name):
        module, _, function = name.rpartition(".")
        return getattr(importlib.import_module(f"benchbot_api.{module}"), function)

    def reset(self):
        if self._state("is_dirty"):
            self._ask("robot/reset")
        return self.step(None)

    def step(self, action, **arguments):
        if action is not None:
            if action not in self.actions:
                raise ValueError(f"Action '{action}' is unavailable")
            self._ask(f"connections/{action}", arguments)
        collided, finished = self._state("is_collided"), self._state("is_finished")
        result = ActionResult.COLLISION if collided else ActionResult.FINISHED if finished else ActionResult.SUCCESS
        observations = {name: self._ask(f"connections/{name}") for name in self._ask("config/task/observations")}
        for name in set(observations) & set(self._callbacks):
            observations[name] = self._callbacks[name](observations[name])
        return {**observations, "scene_number": self._ask("robot/selected_environment")["number"]}, result

    def next_scene(self):
        if self._state("is_collided"):
            raise RuntimeError("Collision state detected for robot; cannot proceed to next scene")
        return self._ask("robot/next")["next_success"]

    def empty_results(self):
        created = self._ask("results_functions/create") if self._ask("config/")["results"] else {}
        details = {"task_details": "config/task", "environment_details": "config/environments"}
        return {**{key: self._ask(route) for key, route in details.items()}, "results": created}

    def results_functions(self):
        return {
            name: lambda *args, _name=name, **kwargs: self._ask(
                f"results_functions//{_name}", {"args": args, "kwargs": kwargs}
            )
            for name in self._ask("results_functions//")
        }

    def run(self):
        while True:
            observations, result = self.reset()
            while not self.agent.is_done(result):
                action, arguments = self.agent.pick_action(observations, self.actions)
                observations, result = self.step(action, **arguments)
            if not self.next_scene():
                break
        self.agent.save_result(self.result_filename, self.empty_results(), self.results_functions())
        sys.stdout.flush()
