"""The actors of one launch: how many are left, and how to end them."""

import json
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, Self

import ray
from ray.exceptions import RayActorError

from benchbot.plugin import BenchbotError
from benchbot_executor_ray import cluster
from benchbot_executor_ray.worker_actor import PATIENCE_S

ANSWER_S = 5.0
"""The time limit of an actor's answer; one that exceeds it waits for free resources, or its node is gone."""
MARGIN_S = 10.0


class Actors:
    """Workers that live in a namespace of their own."""

    def __init__(self, address: str, namespace: str, asked: dict[str, float]) -> None:
        self._address = address
        self._namespace = namespace
        self._asked = asked
        self._found: dict[str, Any] = {}
        self._problems: dict[str, Any] = {}

    @classmethod
    def attach(cls, reference: str) -> Self:
        """Return the workers of a reference."""
        document = json.loads(reference)
        return cls(document["address"], document["namespace"], document["asked"])

    @property
    def reference(self) -> str:
        """The cluster's address, the namespace, and what each worker needs."""
        return json.dumps({"address": self._address, "namespace": self._namespace, "asked": self._asked})

    def alive(self) -> int | None:
        """Return how many workers run or wait for room; None when no cluster can be reached, which is then gone.

        Raises BenchbotError, and ends them, when one cannot work on its node, or no node that is left could run them.
        """
        if not self._connected():
            return None
        handles = self._handles()
        if handles:
            try:
                cluster.check_offered(self._asked)
                self._check_problems(handles)
            except BenchbotError:
                self.stop()
                raise
        return len(handles)

    def stop(self) -> None:
        """End the workers: in order those that run, at once those that wait."""
        if not self._connected():
            return
        handles = self._handles()
        ends = [handles[name].stop.remote() for name in self._answering(handles, ANSWER_S)]
        _ready(ends, PATIENCE_S + MARGIN_S)
        for handle in handles.values():
            ray.kill(handle, no_restart=True)

    def _connected(self) -> bool:
        try:
            cluster.connect(self._address)
        except BenchbotError:
            return False
        return True

    def _handles(self) -> dict[str, Any]:
        """Return the actors that run or wait, by name."""
        listed = ray.util.list_named_actors(all_namespaces=True)
        names = [actor["name"] for actor in listed if actor["namespace"] == self._namespace]
        for name in names:
            if name not in self._found:
                with suppress(ValueError):  # it has ended just now
                    self._found[name] = ray.get_actor(name, self._namespace)
        return {name: self._found[name] for name in names if name in self._found}

    def _answering(self, handles: dict[str, Any], patience_s: float) -> list[str]:
        """Return the names of those that have said whether they can work."""
        for name, handle in handles.items():
            if name not in self._problems:
                self._problems[name] = handle.problem.remote()
        ready = _ready([self._problems[name] for name in handles], patience_s)
        return [name for name in handles if self._problems[name] in ready]

    def _check_problems(self, handles: dict[str, Any]) -> None:
        for name in self._answering(handles, 0.0):
            problem = _told(self._problems[name])
            if problem is not None:
                raise BenchbotError(
                    "A worker cannot run on its node.",
                    problem,
                    "Put the batch's folder (--output-location) and BenchBot's environment where all nodes see them "
                    "under the same path, such as NFS.",
                )


def _ready(answers: list[Any], patience_s: float) -> Iterable[Any]:
    if not answers:
        return []
    ready, _ = ray.wait(answers, num_returns=len(answers), timeout=patience_s)
    return set(ready)


def _told(answer: Any) -> str | None:
    try:
        problem: str | None = ray.get(answer)
    except RayActorError:  # it has ended, as its log says
        return None
    return problem
