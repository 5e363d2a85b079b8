"""A run: one session, used by one request at a time, watched by many, and its result."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from benchbot.core import plugin_manager, results
from benchbot.core.declarations import formats
from benchbot.core.digest import BackgroundDigest
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.host import Host
from benchbot.core.progress import Progress, Step
from benchbot.core.provenance import timings
from benchbot.core.selection import Selection
from benchbot.core.session import Session
from benchbot.supervisor import Caller, RefusedError, description, ended, vigil
from benchbot.supervisor.events import Events
from benchbot.supervisor.gate import Gate, busy
from benchbot.supervisor.observation_tap import ObservationTap
from benchbot.supervisor.platform import borrowed
from benchbot.supervisor.platform.host import ChildHost, Operator
from benchbot.supervisor.recording.host import Recordings
from benchbot.wire import joining

ACTION_WAIT_S = 150.0
RELEASE_WAIT_S = 30.0
DRIVE_WAIT_S = 10.0
STOPPED = "The run was stopped by its user"
STOPPED_BY_SOLUTION = "The solution stopped its run (/api/v1/stop)."
HUNG_UP = "The solution hung up while the robot was moving."

T = TypeVar("T")

log = logging.getLogger("benchbot.supervisor")


class Run:
    """A session behind a lock. Methods block: call them in worker threads. `describe` and `progress` never wait.

    Methods that may move the robot take their caller, so that a real robot stops when that one is gone: see `hang_up`.
    They return the value of `convert` for the answer, whose arrays may be borrowed: they are valid until it returns.

    An answer does not wait for the log, the events and the digest of what was shown. Call `follow_up` for them when it
    has been sent; otherwise the next request that uses the session does so first.
    """

    def __init__(
        self,
        selection: Selection,
        start_host: Callable[[], Host],
        result_path: Path,
        starter: int | None = None,
    ) -> None:
        self.selection = selection
        self._starter = starter
        """The process without which this one has no business: that which has started it and its solution."""
        self._real = selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers")
        self.events = Events()
        self.gate = Gate()
        self.observation_tap = ObservationTap()
        self.last_action: dict[str, Any] | None = None
        """The newest action: `{action, arguments, outcome, result, by_hand}`; no outcome and result before its end."""
        self.stop_asked = threading.Event()
        self.stopped_in_use = False
        self.result_path = result_path
        self.platform_failed = False
        self._host: Host | None = None
        self._digesting = ThreadPoolExecutor(1, "benchbot-digest")
        self._digest = self._new_digest()
        self.session = Session(
            selection,
            partial(self._start_host, start_host),
            digest=self._new_digest,
            before_observing=self.observation_tap.withdraw,
        )
        self.recordings = Recordings(self.session, self.events.publish, result_path.parent)
        self.due: deque[Callable[[], object]] = deque()
        """What the answers so far did not wait for, in order: see `follow_up`."""
        self._following_up = threading.Lock()
        self._lock = threading.Lock()
        self._callers = threading.Lock()
        self._clock = threading.Lock()
        self._caller: Caller | None = None
        self._solution: str | None = None
        """The token of the solution that the session is about."""
        self._closing = threading.Lock()
        self._closed = False
        self._started = False
        self.operator = Operator(self._note_question, self._note_preparing)

    @property
    def progress(self) -> Progress:
        """The progress of the session. It holds the true pose: it is not for solutions."""
        return self.session.progress

    def public_progress(self) -> dict[str, Any]:
        """Return the progress as plain data for clients: without the pose where the task hides the true one."""
        return description.progress_document(self.session.progress, with_pose=self._shows_pose)

    @property
    def _shows_pose(self) -> bool:
        return self.selection.localisation == "ground_truth"

    def prepare(self) -> None:
        """Start the platform's process while the solution is still on its way."""
        with self._exclusively(ACTION_WAIT_S):
            self._noting_failures(self.session.prepare)

    def reset(self, caller: Caller | None = None, convert: borrowed.Converter[T] = borrowed.copy_answer) -> T:
        """Start anew in the first scene. Waits for an action that a solution, maybe a dead one, has left unfinished.

        What that one has spent, or the host before it, is not for another solution to pay.
        """
        with self._moving(ACTION_WAIT_S, caller):
            self._begin_episode_of(None if caller is None else caller.solution)
            self.last_action = None
            step = self._noting_failures(self.session.reset)
            self._started = True
            self.note_pause()
            self._tell("scene")
            return self._deliver(self._step_document(step), convert)

    def admit(self, solution: str) -> None:
        """Begin the episode of a solution, by its token, that has the robot now; it may fail before it resets."""
        if solution != self._solution:
            with suppress(BenchbotError), self._exclusively():  # the one before may still use it
                self._begin_episode_of(solution)

    def step(
        self,
        action: str | None,
        arguments: Mapping[str, Any],
        caller: Caller | None = None,
        convert: borrowed.Converter[T] = borrowed.copy_answer,
    ) -> T:
        """Take one action; raises RefusedError (409) while another request uses the session."""
        with self._moving(caller=caller, moves=action is not None):
            return self._deliver(self._step(action, arguments), convert)

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Take one action by hand, for the host; return it as `last_action`. Before a solution has begun, reset first.

        Waits for what is under way; raises RefusedError (409) when that takes long, and while a solution drives.
        """
        with self.gate.driving(begun=self._started), self._exclusively(DRIVE_WAIT_S):
            if not self.progress.frames:
                self._noting_failures(self.session.reset)
                self.note_pause()
            step = self._step(action, arguments, by_hand=True)
            return self._deliver(step, lambda answer, arena: dict(self.last_action or {}))

    def note_pause(self) -> None:
        """Stop the session's clock while the gate is closed."""
        # The last of several callers sees the gate as it is, and the clock that a reset may have made meanwhile.
        with self._clock:
            (self.progress.pause if self.gate.state.paused else self.progress.go_on)()

    def next_scene(self, caller: Caller | None = None, convert: borrowed.Converter[T] = borrowed.copy_answer) -> T:
        """Advance to the next scene; raises RefusedError (409) while another request uses the session."""
        with self._moving(caller=caller):
            step = self._noting_failures(self.session.next_scene)
            if step is None:
                return self._deliver({"advanced": False, **description.state_document(self.session)}, convert)
            self._tell("scene")
            return self._deliver({"advanced": True, **self._step_document(step)}, convert)

    def finish(
        self,
        document: dict[str, Any] | None,
        solution: dict[str, Any] | None,
        failure: tuple[FailureClass, str] | None,
        token: str | None = None,
    ) -> dict[str, Any]:
        """Check and complete a result, or record a failed episode when there is no document; write it; return it.

        The answer, unlike what is written, has neither seed nor secret, and track, simulated time and what was spent
        only where the task tells true poses anyway. Waits for an action that is still under way. `token` is that of
        the solution, where it is known.
        """
        with self._exclusively(ACTION_WAIT_S):
            self._begin_episode_of(token)
            if failure is not None:
                self.session.fail(*failure)
            if document is None:
                finished = results.failed(self.session, solution=solution)
            else:
                finished = results.finish(document, self.session, solution=solution)
            results.write_json(self.result_path, finished)
            log.info("result written to %s", self.result_path)
            self.events.publish("result", {"path": str(self.result_path)})
            self.recordings.result(finished)
            # What is kept with the result alone: a solution that could read it might still be driving.
            told = description.result_document(finished, with_pose=self._shows_pose)
            measured, hidden = timings(self.session), () if self._shows_pose else ("real_time_factor",)
            told_s = {name: value for name, value in measured.items() if name not in hidden}
            return {"document": told, "path": str(self.result_path), "timings": told_s}

    def results_function(self, name: str, args: list[Any], kwargs: dict[str, Any]) -> Any:
        """Call a function of the task's results format."""
        if self.selection.results_format is None:
            raise RefusedError(
                404,
                f"There is no results function '{name}'.",
                f"The task '{self.selection.task.name}' has no results format.",
                "Put whatever JSON you like under the key 'results'.",
            )
        return formats.call(self.selection.results_format, name, args, kwargs)

    def describe(self) -> dict[str, Any]:
        """Return what is run and where it stands, without ground truth (docs/wire.md, GET /api/v1/session)."""
        return {
            **description.selection_document(self.selection),
            "scene_count": len(self.session.scenes),
            "started": self._started,
            **description.state_document(self.session),
            "progress": self.public_progress(),
        }

    def hang_up(self, caller: Caller) -> None:
        """Note that a caller has disconnected. If the request under way is theirs, a real robot stops, for good.

        A simulator finishes the action: nobody is in danger, and the next request finds it well. A request that still
        waits for its turn is dropped when that comes.
        """
        with self._callers:
            caller.gone = True
            under_way = self._caller is caller
        self.gate.look_again()
        if under_way:
            log.warning("%s", HUNG_UP)
            self.session.halt(HUNG_UP)

    def confirm(self) -> str:
        """Confirm that the operator has done what the platform asked of them; return the request.

        Raises RefusedError (409) when there was none.
        """
        request = self.operator.confirm()
        if request is None:
            raise RefusedError(
                409,
                "Nobody waits for the operator.",
                "The robot has asked for nothing, or it has been confirmed already.",
                "Wait until the run asks for something: its terminal shows it.",
            )
        return request

    def stop(self, by: str = "", *, by_solution: bool = False) -> None:
        """End the run at a client's request: the emergency stop, also in the middle of another client's action.

        The result says `by` what. A real robot is halted at once, and what drives it called off.

        A solution that stops its own run has failed: otherwise it could have an episode that goes badly tried again.
        """
        with self._callers:
            under_way = self._caller is not None or self.gate.state.held
        self.stopped_in_use |= by_solution or under_way
        if by_solution:
            self.session.fail(FailureClass.AGENT, STOPPED_BY_SOLUTION)
        elif under_way:
            why = f"{STOPPED} ({by})." if by else f"{STOPPED}."
            self.session.fail(FailureClass.PLATFORM, why)
            self.stop_asked.set()
            self.session.halt(why)
        self.close()

    def close(self) -> None:
        """Stop the robot and end the platform, even in the middle of an action. Safe to call from several threads."""
        self.stop_asked.set()
        self.gate.end()
        with self._closing:
            if not self._closed:
                self._closed = True
                self.session.close()
                self._tell("closed")
                self.follow_up()

    def release(self) -> Host | None:
        """End the run, and return its platform for the next one; None when it is dead, or busy for too long."""
        if not self._lock.acquire(timeout=RELEASE_WAIT_S):
            self.close()
            return None
        try:
            self.follow_up()
            host = self.session.release()
            # The next run's observations will lie where this one's do.
            self.observation_tap.withdraw()
            self.close()
            self._digesting.shutdown()
            return host
        finally:
            self._lock.release()

    def follow_up(self) -> None:
        """Do, in order, what the answers so far did not wait for; wait for a thread that is just doing so."""
        with self._following_up:
            while self.due:
                self.due.popleft()()

    def _step(self, action: str | None, arguments: Mapping[str, Any], *, by_hand: bool = False) -> dict[str, Any]:
        """Take one action to its end, and return the answer. The caller holds the session's lock."""
        taken = {"action": action, "arguments": arguments, "by_hand": by_hand}
        if action is not None:
            self.last_action = {**taken, "outcome": None, "result": None}
        try:
            step = self._noting_failures(lambda: self.session.step(action, arguments, by_hand=by_hand))
        except BenchbotError as error:
            self.last_action = {**taken, "arguments": {}, "outcome": "failed", "result": error.title}
            raise
        if action is not None:
            self.last_action = {**taken, "outcome": step.outcome, "result": step.result}
        self._tell("step")
        return self._step_document(step)

    def _begin_episode_of(self, solution: str | None) -> None:
        """Leave the solution before behind, if this is another one. The caller holds the session's lock."""
        if solution is not None and solution != self._solution:
            self._solution = solution
            self.last_action = None
            self.session.begin_episode()

    def _start_host(self, start: Callable[[], Host]) -> Host:
        self._host = start()
        return self._host

    def _new_digest(self) -> BackgroundDigest:
        self._digest = BackgroundDigest(self._digesting)
        return self._digest

    def _deliver(self, answer: dict[str, Any], convert: borrowed.Converter[T]) -> T:
        try:
            if "observations" in answer:
                self.observation_tap.offer(answer["observations"])
            return convert(answer, self._host.arena if isinstance(self._host, ChildHost) else None)
        finally:
            self.due.append(self._digest.begin)

    @contextmanager
    def _moving(self, wait_s: float = 0.0, caller: Caller | None = None, *, moves: bool = True) -> Iterator[None]:
        """Pass the gate and use the robot."""
        passing = self.gate.passing(lambda: caller is not None and caller.gone, moves=moves)
        watching = vigil.repeated(self._look_for_frozen) if self._real and moves else nullcontext()
        with passing, self._exclusively(wait_s, caller), watching:
            yield

    def _look_for_frozen(self) -> None:
        """Stop a real robot, for good, when somebody is frozen who would have to stop it; not while it waits."""
        if self.progress.waiting_for is not None or self.progress.failure is not None:
            return
        asks = self._caller.process if self._caller is not None else None
        found = vigil.frozen(self._starter, joining.lease_of(self.result_path.parent), asks)
        if found is not None:
            log.warning("%s", found.why)
            self.session.fail(*found)
            self.session.halt(found.why)

    @contextmanager
    def _exclusively(self, wait_s: float = 0.0, caller: Caller | None = None) -> Iterator[None]:
        if not self._lock.acquire(timeout=wait_s):
            raise busy("Another request is using the session, and there is one robot.")
        try:
            self.follow_up()
            if self.stop_asked.is_set():
                raise ended()
            with self._callers:
                self._caller = caller
                if caller is not None and caller.gone:
                    raise RefusedError(
                        409,
                        "Nobody waits for the answer.",
                        "The client hung up while another request was using the session.",
                        "Send it again, and wait for the answer.",
                    )
            yield
        finally:
            with self._callers:
                self._caller = None
            self._lock.release()

    def _noting_failures(self, call: Callable[[], Step | None]) -> Any:
        try:
            return call()
        except BenchbotError as error:
            if self.stop_asked.is_set():
                raise ended() from error
            if error.failure is FailureClass.PLATFORM:
                self.platform_failed = True
            log.warning("%s", error)
            if self.progress.failure is not None:
                self._tell("failure")
            raise

    def _note_question(self, request: str | None) -> None:
        self.progress.waiting_for = request
        self._announce("operator")  # at once: the action under way waits

    def _note_preparing(self, text: str | None) -> None:
        self.progress.preparing = text

    def _tell(self, kind: str) -> None:
        """Announce an event when the answer has been sent."""
        self.due.append(partial(self._announce, kind))

    def _announce(self, kind: str) -> None:
        """Log the progress, and publish an event with it, without what the task hides."""
        told = description.progress_document(self.progress, with_pose=True)
        shown = ("scene_number", "steps", "last_action", "state", self.progress.time_key, "failure", "waiting_for")
        log.info("%s: %s", kind, ", ".join(f"{key} {told[key]}" for key in shown))
        self.events.publish(kind, self.public_progress())

    def _step_document(self, step: Step) -> dict[str, Any]:
        state = description.state_document(self.session)
        return {"observations": step.observations, "outcome": step.outcome, **state}
