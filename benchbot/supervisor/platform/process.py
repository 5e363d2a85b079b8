"""The platform's process: creates a simulator or a robot driver and serves a supervisor, until that one is gone.

Started as `python -m benchbot.supervisor.platform.process SOCKET_FD ARENA_FD LIFELINE_FD` by `ChildHost`.

It never outlives the supervisor. When that is gone, an idle platform is closed in order; one that is busy ends at once:
the kernel sends SIGIO when the lifeline (a pipe whose other end only the supervisor holds) breaks. No thread of this
process could do that: a simulator may hold Python's lock for as long as it compiles or renders.
"""

import faulthandler
import fcntl
import os
import queue
import select
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchbot.core import diagnosis, plugin_manager
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.findings import Finding
from benchbot.core.host import Host, InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.supervisor.platform import messages
from benchbot.wire.arena import ArenaWriter

GRACE_S = 0.5
SILENT = "The supervisor gave no sign of life"
MOVING = (messages.Load, messages.Act)

Requests = queue.SimpleQueue[messages.Request | None]


def main() -> None:
    """Serve requests until `Close` or the end of the supervisor."""
    faulthandler.enable()
    # Ctrl-C reaches this process through the supervisor only.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = socket.socket(fileno=int(sys.argv[1]))
    arena = ArenaWriter(int(sys.argv[2]))
    _watch(int(sys.argv[3]))
    sending = threading.Lock()

    def send(data: bytes) -> None:
        with sending:
            messages.send(connection, data)

    control = ControlChannel(send)
    requests: Requests = queue.SimpleQueue()
    threading.Thread(target=_read, args=(connection, requests, control), daemon=True).start()
    _serve(send, requests, control, arena)


class ControlChannel:
    """Handles what reaches this process in the middle of an action: the order to halt, and the operator's answer.

    While a request is `moving` a robot that must be attended to, the supervisor's silence halts it, too. `handle` is
    called in the thread that reads, `attach` and `ask` in the one that serves requests. `send` sends a message to the
    supervisor, from any thread.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._host: InProcessHost | None = None
        self.moving = False
        self._halted: str | None = None
        self._answers: queue.SimpleQueue[messages.ControlMessage] = queue.SimpleQueue()

    @property
    def patience_s(self) -> float | None:
        """The longest time in which the supervisor has to say something, None while it has not."""
        with self._lock:
            attended = self.moving and self._host is not None and self._halted is None
            return self._host.heartbeat_timeout_s if attended and self._host is not None else None

    def attach(self, host: InProcessHost) -> None:
        """Set the host that is to be halted: at once, if the order to halt came before."""
        with self._lock:
            self._host = host
            halted = self._halted
        if halted is not None:
            _halt(host, halted)

    def handle(self, message: messages.ControlMessage) -> None:
        """Act on a control message, also while an action is under way."""
        if isinstance(message, messages.Halt):
            with self._lock:
                self._halted = message.why
                host = self._host
            if host is not None:
                _halt(host, message.why)
        if not isinstance(message, messages.Alive):
            self._answers.put(message)

    def ask(self, request: str) -> None:
        """Ask the operator for something, and wait until it is done: `PlatformSpec.ask`.

        Raises the BenchbotError of a safety stop when the robot is halted instead.
        """
        if self._halted is None:
            moving, self.moving = self.moving, False
            self._send(messages.encode(messages.Question(request)))
            self._answers.get()
            self.moving = moving
        if self._halted is not None:
            raise BenchbotError(
                "The robot was halted before it could start.",
                self._halted,
                "Start another run when the robot and the space around it are safe: benchbot run …",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.PLATFORM,
                ends_run=True,
            )
        self._send(messages.encode(messages.Resumed()))

    def tell(self, waits_for: str | None) -> None:
        """Say what is waited for, None when the wait is over: `PlatformSpec.tell`."""
        said = messages.Resumed() if waits_for is None else messages.Question(waits_for, wants_answer=False)
        self._send(messages.encode(said))

    def note(self, text: str) -> None:
        """Say what is done meanwhile, in the log as well: `PlatformSpec.note`."""
        print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)
        self._send(messages.encode(messages.Preparing(text)))


def _halt(host: Host, why: str) -> None:
    try:
        host.halt(why)
    # A plug-in may fail in any way at all. A robot that it cannot halt is stopped by its guard once this process ends.
    except Exception:  # noqa: BLE001
        traceback.print_exc()
        os._exit(ExitCode.INTERNAL)


def _watch(lifeline: int) -> None:
    signal.signal(signal.SIGIO, signal.SIG_IGN)
    fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(lifeline, fcntl.F_SETFL, fcntl.fcntl(lifeline, fcntl.F_GETFL) | os.O_ASYNC)


def _read(connection: socket.socket, requests: Requests, control: ControlChannel) -> None:
    try:
        while True:
            patience_s = control.patience_s
            if not _readable(connection, patience_s):
                if control.patience_s is not None:
                    control.handle(messages.Halt(f"{SILENT} for {patience_s:g} s while the robot moved."))
                continue
            message = messages.decode_request(messages.receive(connection))
            if isinstance(message, MOVING):
                control.moving = True
            if isinstance(message, messages.ControlMessage):
                control.handle(message)
            else:
                requests.put(message)
    except EOFError:
        requests.put(None)
    # The supervisor is gone: closing is given its time, no more.
    time.sleep(GRACE_S)
    os._exit(ExitCode.INTERRUPTED)


def _readable(connection: socket.socket, timeout_s: float | None) -> bool:
    """Wait until there is something to read; say whether there is. It is looked for once more at the end.

    This thread may have had to wait for Python's lock, while what it waited for had long come.
    """
    return any(select.select([connection], [], [], seconds)[0] for seconds in (timeout_s, 0.0))


def _serve(
    send: Callable[[bytes], None],
    requests: Requests,
    control: ControlChannel,
    arena: ArenaWriter,
) -> None:
    host: InProcessHost | None = None
    reply: Any
    real = False
    while (request := requests.get()) is not None:
        signal.signal(signal.SIGIO, signal.SIG_DFL)
        try:
            if isinstance(request, messages.Start):
                real = request.robot["type"] in plugin_manager.load().pool("robot_drivers")
                host, reply = _create(request, control)
                control.attach(host)
            else:
                reply = _answer(host, request)
            data = messages.encode_value(reply, arena)
        except BenchbotError as error:
            data = messages.encode(messages.Failed.of(error))
        # A plug-in may fail in any way at all: the supervisor must hear of it, in words.
        except Exception as error:  # noqa: BLE001
            traceback.print_exc()
            data = messages.encode(messages.Failed.of(_failure(error, real=real)))
        signal.signal(signal.SIGIO, signal.SIG_IGN)
        control.moving = False
        send(data)
        if isinstance(request, messages.Close):
            return
    if host is not None:
        host.close()


def _create(request: messages.Start, control: ControlChannel) -> tuple[InProcessHost, list[Finding]]:
    """Return the host of a new platform, and the findings of a real robot; raises BenchbotError when it is broken."""
    loaded = plugin_manager.load()
    kind = request.robot["type"]
    simulated = kind in loaded.pool("simulators")
    record = loaded.record("simulators" if simulated else "robot_drivers", kind)
    place, ask = Path(request.cache_dir), control.ask if request.can_ask else None
    spec = PlatformSpec(request.robot, request.localisation, place, request.options, ask, control.tell, control.note)
    platform = record.create(spec)
    motion = MotionConfig.from_robot(request.robot, request.localisation)
    if simulated:
        return InProcessHost(platform, _scenes(request.scenes), motion), []
    findings = list(diagnosis.diagnose(record, loaded.pool("robot_drivers")[kind].distribution, spec))
    diagnosis.admit(str(request.robot["name"]), findings, request.despite)
    told = {"findings": [finding.as_dict() for finding in findings], "despite": list(request.despite)}
    return InProcessHost(platform, _scenes(request.scenes), motion, told), findings


def _scenes(told: list[messages.SceneMessage]) -> list[Scene]:
    return [Scene(scene.environment, Path(scene.folder)) for scene in told]


def _answer(host: InProcessHost | None, request: messages.Request) -> Any:
    if host is None:
        return None  # closed before it was started
    if isinstance(request, messages.Load):
        return host.load(request.scene_index, int(request.seed))
    if isinstance(request, messages.Act):
        return host.act(request.action, request.arguments, request.goal)
    if isinstance(request, messages.Observe):
        return host.observe(request.channels)
    if isinstance(request, messages.Scenes):
        return host.change_scenes(_scenes(request.scenes))
    return host.close()


def _failure(error: Exception, *, real: bool) -> BenchbotError:
    last = traceback.extract_tb(error.__traceback__)[-1]
    fix = "reset() starts it anew. If it happens again, report it to the author of the simulator with the run's log."
    return BenchbotError(
        "The robot's driver failed." if real else "The simulator failed.",
        f"{type(error).__name__}: {error} (in {last.name}, {Path(last.filename).name}:{last.lineno})",
        "Report it to the author of the driver with the run's log. The next run starts it anew." if real else fix,
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.PLATFORM,
        # A driver that does not know what happened does not move a robot again.
        ends_run=real,
    )


if __name__ == "__main__":
    main()
