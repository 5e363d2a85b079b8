"""The robot controller of BenchBot v2 on top of a run: commands and states instead of one answer a step."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot.core.progress import Progress, State
from benchbot.supervisor import Caller, RefusedError, ended
from benchbot.supervisor.run import Run

Mover = Callable[[Callable[[Caller], dict[str, Any]]], Awaitable[dict[str, Any]]]
"""Runs a blocking call that may move the robot in another thread, while its caller is connected."""


@dataclass(frozen=True)
class LastObservation:
    """Observations of one instant with the progress at it; `given` are those that a client has received."""

    observations: dict[str, Any]
    progress: Progress
    frames: int
    given: set[str] = field(default_factory=set)


class V2Robot:
    """The robot of a run, for clients that ask for each observation and each state on its own.

    All observations between two actions are of one instant. Commands take turns, as v2's controller took them; states
    never wait. The run begins with whatever needs it first, in the first scene.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._turn = asyncio.Lock()
        self._snapshot: LastObservation | None = None
        self._stopped: Progress | None = None
        self._real = run.selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers")

    @property
    def turn(self) -> asyncio.Lock:
        """Held by the one request that may use the robot."""
        return self._turn

    async def observe(self, name: str, move: Mover) -> Any:
        """Return an observation of the instant after the last action.

        The world around a real robot changes without actions: a second request for a name observes again.
        """
        self._require_running()
        if not self._begun:
            await self._take(move, self._run.reset)
        snapshot = self._latest()
        if snapshot is None or (self._real and name in snapshot.given):
            await self._take(move, lambda caller: self._run.step(None, {}, caller))
            snapshot = self._latest()
        if snapshot is None:
            raise _moved_on()
        snapshot.given.add(name)
        return snapshot.observations[name]

    async def act(self, action: str, arguments: dict[str, Any], move: Mover) -> None:
        """Take an action to its end."""
        self._require_running()
        if not self._begun:
            await self._take(move, self._run.reset)
        await self._take(move, lambda caller: self._run.step(action, arguments, caller))

    async def reset(self, move: Mover) -> dict[str, Any]:
        """Start anew in the first scene."""
        await self._take(move, self._run.reset)
        return {"reset_success": True}

    async def restart(self, move: Mover) -> dict[str, Any]:
        """Start anew in the first scene: a scene is never repeated on its own."""
        await self._take(move, self._run.reset)
        return {"restart_success": True}

    async def start(self, move: Mover) -> dict[str, Any]:
        """Start in the first scene, unless the robot is running."""
        if self._begun and self._is_running:
            return {"start_success": False}
        await self._take(move, self._run.reset)
        return {"start_success": True}

    async def next(self, move: Mover) -> dict[str, Any]:
        """Advance to the next scene, if the robot is running and there is one."""
        if not self._begun or not self._is_running:
            return {"next_success": False}
        return {"next_success": (await self._take(move, self._run.next_scene))["advanced"]}

    async def prepare(self, move: Mover) -> dict[str, Any]:
        """Start the platform, if it is not there."""

        def prepare(caller: Caller) -> dict[str, Any]:
            self._run.prepare()
            return {"prepare_success": True}

        return await move(prepare)

    async def stop(self, move: Mover) -> dict[str, Any]:
        """Take no more actions until the next start. It waits for its turn: the robot stands still when it comes."""
        self._stopped = self._run.progress
        return {"stop_success": True}

    def is_running(self) -> dict[str, Any]:
        """Return whether the robot takes actions; one that has failed is started by a reset."""
        if self._run.stop_asked.is_set():
            raise ended()
        return {"is_running": self._is_running}

    def is_collided(self) -> dict[str, Any]:
        """Return whether the robot has hit something in this scene."""
        return {"is_collided": self._is_running and self._run.progress.state is State.COLLIDED}

    def is_dirty(self) -> dict[str, Any]:
        """Return whether the robot has left the start of this scene, or failed."""
        return {"is_dirty": self._is_running and self._run.progress.state is not State.CLEAN}

    def is_finished(self) -> dict[str, Any]:
        """Return whether the trajectory of this scene is at its end."""
        return {"is_finished": self._is_running and self._run.progress.state is State.FINISHED}

    def selected_environment(self) -> dict[str, Any]:
        """Return the scene that the robot is in; the first is number 0."""
        number = self._run.progress.scene_number
        scene = self._run.selection.environments[number].data
        return {"name": scene["name"], "variant": scene["variant"], "number": number}

    @property
    def _begun(self) -> bool:
        return self._run.progress.frames > 0

    @property
    def _is_running(self) -> bool:
        # A reset makes a new progress, whoever asked for it.
        return self._run.progress is not self._stopped

    async def _take(self, move: Mover, call: Callable[[Caller], dict[str, Any]]) -> dict[str, Any]:
        def call_and_keep(caller: Caller) -> dict[str, Any]:
            answer = call(caller)
            if "observations" in answer:
                progress = self._run.progress
                self._snapshot = LastObservation(answer["observations"], progress, progress.frames)
            return answer

        return await move(call_and_keep)

    def _latest(self) -> LastObservation | None:
        """Return the last snapshot, unless another client has moved the robot or observed since."""
        snapshot, progress = self._snapshot, self._run.progress
        current = snapshot is not None and snapshot.progress is progress and snapshot.frames == progress.frames
        return snapshot if current else None

    def _require_running(self) -> None:
        if not self._is_running:
            raise BenchbotError(
                "The robot is stopped.",
                "It was stopped with /robot/stop, and has not been started since.",
                "Start it again: GET /robot/start",
            )


def _moved_on() -> RefusedError:
    return RefusedError(
        409, "Another client uses the robot.", "It did so while this one observed.", "Use one client at a time."
    )
