"""The platform behind a process boundary: a host whose crash, hang or death is survived and told in words."""

import os
import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar

import msgspec

from benchbot.core import plugin_manager, resources
from benchbot.core.channels import Observations
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.findings import Finding
from benchbot.core.geometry import Pose
from benchbot.core.host import Status
from benchbot.core.motion import Outcome
from benchbot.core.selection import Selection
from benchbot.process import how_it_ended, is_stopped, last_words, start_module
from benchbot.supervisor import vigil
from benchbot.supervisor.platform import borrowed, messages
from benchbot.wire import arena

CLOSE_TIMEOUT_S = 3.0
CALL_OFF_S = 4.0
"""The time to call off what drives a halted robot, such as Nav2; then its driver is killed."""

T = TypeVar("T")

_ALIVE = messages.encode(messages.Alive())
_NOTHING = messages.decoder(NoneType)
_STATUS = messages.decoder(Status)
_FINDINGS = messages.decoder(list[Finding])
_OUTCOME = messages.decoder(tuple[Outcome, Status])


@dataclass(frozen=True)
class Timeouts:
    """Seconds of wall time after which a platform that has not answered counts as hung.

    Loading a scene is long, and so is the first look at it: a simulator may compile its kernels and work out the light.
    """

    load_s: float = 600.0
    call_s: float = 120.0


class Operator:
    """The person beside a real robot, who may be asked to do what it cannot do by itself. Safe to use from any thread.

    `changed` is called with the request that waits for them, or None when none does; `noted` with what a platform does
    that takes long, or None when that is over.
    """

    def __init__(
        self, changed: Callable[[str | None], None], noted: Callable[[str | None], None] = lambda text: None
    ) -> None:
        self._changed = changed
        self.noted = noted
        self._lock = threading.Lock()
        self._pending: tuple[str, Callable[[], None]] | None = None

    def ask(self, request: str, done: Callable[[], None]) -> None:
        """Show a request, and call `done` when the operator says so. Does not wait."""
        with self._lock:
            self._pending = (request, done)
        self._changed(request)

    def confirm(self) -> str | None:
        """Say that the request is done; return it, or None when there was none."""
        pending = self._take()
        if pending is None:
            return None
        request, done = pending
        done()
        return request

    def withdraw(self) -> None:
        """Forget the request: nobody waits for it any more."""
        self._take()

    def _take(self) -> tuple[str, Callable[[], None]] | None:
        with self._lock:
            pending, self._pending = self._pending, None
        if pending is not None:
            self._changed(None)
        return pending


class ChildHost:
    """A `Host` whose platform lives in a child process. One caller at a time; `halt` and `close` from any thread.

    Every method raises BenchbotError with failure `platform` when the child dies or hangs; it is then gone for good.
    With a real robot that ends the run: it was stopped in the middle of something, and is not moved again.
    While the platform asks the `operator` for something, it does not count as hung; without one it cannot ask.
    With `zero_copy`, the arrays of an observation are read-only views of the arena, valid until the next one.
    """

    def __init__(
        self,
        selection: Selection,
        log: Path,
        *,
        options: Mapping[str, Any] | None = None,
        timeouts: Timeouts | None = None,
        operator: Operator | None = None,
        zero_copy: bool = False,
    ) -> None:
        self._log = log
        self._timeouts = timeouts or Timeouts()
        self._operator = operator
        self._real = selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers")
        self._busy = threading.Lock()
        self._sending = threading.Lock()
        self._socket, theirs = socket.socketpair()
        self._arena_handle = arena.create()
        lifeline, self._lifeline = os.pipe()
        handles = (theirs.fileno(), self._arena_handle, lifeline)
        with theirs, os.fdopen(lifeline), log.open("ab") as log_file:
            self._log_start = log_file.tell()
            module = "benchbot.supervisor.platform.process"
            self._process = start_module(module, *map(str, handles), output=log_file, pass_fds=handles)
        self.arena = arena.ArenaReader(self._arena_handle)
        self._observations: messages.Decoder[Any] = (
            borrowed.BorrowingDecoder(self.arena) if zero_copy else messages.decoder(dict[str, Any], self.arena.read)
        )
        self._start_sent = False
        self._start: messages.Start | None = messages.Start(
            robot=selection.robot.data,
            scenes=_scene_messages(selection),
            localisation=selection.localisation,
            cache_dir=str(resources.cache_dir()),
            options={**(options or {}), **selection.platform_options},
            can_ask=operator is not None,
            despite=selection.despite,
        )
        self.findings: list[Finding] = []
        """Those of the diagnosis of a real robot, once it was made."""
        self._looked = self._froze = False

    @property
    def pid(self) -> int:
        """The child's process number."""
        return self._process.pid

    def renew(self, selection: Selection, operator: Operator | None) -> None:
        """Go on with the next run, of the same robot and task; what the platform has loaded stays loaded.

        Call it when nothing is under way.
        """
        if self._process.poll() is not None:
            raise self._died()
        self._operator = operator
        scenes = _scene_messages(selection)
        if self._start is not None and not self._start_sent:
            self._start = msgspec.structs.replace(self._start, scenes=scenes)
        else:
            self._create()
            # Also when they are the same: only an answer tells that the child is not just dying.
            self._call(messages.Scenes(scenes), _NOTHING, self._timeouts.call_s)

    def prepare(self) -> None:
        """Have a real robot diagnosed before anything moves it; raises BenchbotError when it is broken.

        A simulator is created meanwhile, since its imports take as long as those of a solution, and not waited for:
        should that fail, the first `load` tells.
        """
        if self._real:
            self._create()
        elif self._start is not None and not self._start_sent:
            with self._busy, suppress(OSError):
                self._send(self._start)
                self._start_sent = True

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot into the clean start state of a scene of the selection."""
        self._create()
        self._looked = False
        with self._attended():
            return self._call(messages.Load(scene_index, str(seed)), _STATUS, self._timeouts.load_s)

    def act(self, action: str, arguments: Mapping[str, float], goal: Pose | None) -> tuple[Outcome, Status]:
        """Execute one action to its end."""
        request = messages.Act(action, dict(arguments), goal)
        with self._attended():
            return self._call(request, _OUTCOME, self._timeouts.call_s)

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all of one instant."""
        timeout_s = self._timeouts.call_s if self._looked else self._timeouts.load_s
        observations: Observations = self._call(messages.Observe(list(channels)), self._observations, timeout_s)
        self._looked = True
        return observations

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good. Does nothing when the child is gone."""
        self._send_control(messages.Halt(why))

    def close(self) -> None:
        """End the child: politely when it is idle, at once when it is busy. Safe to call twice.

        With a real robot what is under way is called off first, since others may drive it: Nav2, to its start.
        """
        if self._process.returncode is None:
            if self._real:
                self.halt("The run has ended.")
            if self._busy.acquire(timeout=CALL_OFF_S if self._real else 0.0):
                try:
                    self._send(messages.Close())
                    messages.receive(self._socket, CLOSE_TIMEOUT_S)
                    self._process.wait(CLOSE_TIMEOUT_S)
                except (OSError, EOFError, subprocess.TimeoutExpired):
                    pass
                finally:
                    self._busy.release()
            self._kill()
        # A call that is still under way reads the end of the stream first, and lets go of both.
        with self._busy, self._sending:
            self._socket.close()
            if self._arena_handle >= 0:
                os.close(self._lifeline)
                os.close(self._arena_handle)
                self._arena_handle = -1

    def _create(self) -> None:
        # Not in the constructor: `close` can interrupt it only when there is a host to close.
        if self._start is not None:
            self.findings = self._call(self._start, _FINDINGS, self._timeouts.load_s, is_sent=self._start_sent)
            self._start = None

    def _attended(self) -> AbstractContextManager[None]:
        """Give a real robot's driver signs of life, and end one that is frozen: its guard then stops the robot."""
        return vigil.repeated(self._attend) if self._real else nullcontext()

    def _attend(self) -> None:
        if is_stopped(self.pid):
            self._froze = True
            self._kill()
        # It comes again in a moment: it does not wait for another message, nor for a driver that reads none.
        elif self._sending.acquire(blocking=False):
            try:
                self._socket.send(messages.framed(_ALIVE), socket.MSG_DONTWAIT)
            except OSError:
                pass
            finally:
                self._sending.release()

    def _call(
        self, request: messages.Request, decoder: messages.Decoder[T], timeout_s: float, *, is_sent: bool = False
    ) -> T:
        with self._busy:
            try:
                if not is_sent:
                    self._send(request)
                return messages.value_of(self._reply(timeout_s), decoder)
            except TimeoutError as error:
                self._kill()
                name = type(request).__name__.lower()
                why = f"It did not answer to '{name}' for {timeout_s:g} s, and was ended."
                raise self._error("hangs", why) from error
            except (EOFError, OSError) as error:
                raise self._died() from error
            except (msgspec.MsgspecError, ValueError) as error:
                self._kill()
                raise self._error("sent something unreadable", f"{error}. It was ended.") from error

    def _reply(self, timeout_s: float) -> messages.Reply:
        """Return the child's reply. What the operator is asked meanwhile takes as long as it takes."""
        patience_s: float | None = timeout_s
        try:
            while True:
                message = messages.decode_message(messages.receive(self._socket, patience_s))
                if isinstance(message, messages.Reply):
                    return message
                asks = isinstance(message, messages.Question)
                patience_s = None if asks else timeout_s
                if self._operator is not None and isinstance(message, messages.Preparing):
                    self._operator.noted(message.text)
                elif self._operator is not None and isinstance(message, messages.Question):
                    self._operator.ask(message.text, self._answer if message.wants_answer else lambda: None)
                elif self._operator is not None:
                    self._operator.withdraw()
        finally:
            if self._operator is not None:
                self._operator.withdraw()
                self._operator.noted(None)

    def _answer(self) -> None:
        self._send_control(messages.Answered())

    def _send(self, message: messages.Request | messages.ControlMessage) -> None:
        with self._sending:
            messages.send(self._socket, messages.encode(message))

    def _send_control(self, message: messages.ControlMessage) -> None:
        """Send a message in the middle of a call. A child that is gone does not need it, a deaf one is ended."""
        try:
            self._send(message)
        except TimeoutError:
            self._kill()
        except OSError:
            pass

    def _kill(self) -> None:
        """End the child and its process group, and reap it."""
        if self._process.poll() is None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _died(self) -> BenchbotError:
        try:
            code = self._process.wait(CLOSE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._kill()
            code = self._process.returncode
        return self._error("died", f"Its process {vigil.FROZEN if self._froze else how_it_ended(code)}.")

    def _error(self, what: str, why: str) -> BenchbotError:
        # Lines of an earlier child in the same log are not this one's last words.
        with self._log.open("rb") as log:
            said = last_words(log, self._log_start)
        who = "The robot's driver" if self._real else "The simulator"
        again = "Run it again (reset() starts it anew); if it fails again, report it."
        if self._real:
            again = "The next run starts it anew, when the robot is safe."
        return BenchbotError(
            f"{who} {what}.",
            f"{why} {said}",
            f"{again} Its log: {self._log}",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.PLATFORM,
            ends_run=self._real,
        )


def _scene_messages(selection: Selection) -> list[messages.SceneMessage]:
    return [messages.SceneMessage(scene.data, str(scene.path.parent.absolute())) for scene in selection.environments]
