"""What reaches the platform in the middle of an action: the order to halt, and the operator's answer."""

import os
import queue
import threading
import traceback
from collections.abc import Callable

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.host import Host
from benchbot.supervisor.platform import messages


class Asides:
    """The platform's process between its two threads: one that reads, and one that may be busy with an action.

    `send` takes a message to the supervisor, from any thread.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._host: Host | None = None
        self._halted: str | None = None
        self._answers: queue.SimpleQueue[messages.Aside] = queue.SimpleQueue()

    def attach(self, host: Host) -> None:
        """Name the host that is to be halted; one that comes too late for an order to halt is halted at once."""
        with self._lock:
            self._host = host
            halted = self._halted
        if halted is not None:
            _halt(host, halted)

    def hear(self, aside: messages.Aside) -> None:
        """Act on an aside. Called by the thread that reads, while the other one may be busy."""
        if isinstance(aside, messages.Halt):
            with self._lock:
                self._halted = aside.why
                host = self._host
            if host is not None:
                _halt(host, aside.why)
        self._answers.put(aside)

    def ask(self, request: str) -> None:
        """Have the operator do something, and wait until it is done: `PlatformSpec.ask`.

        Raises the BenchbotError of a safety stop when the robot is halted instead.
        """
        if self._halted is None:
            self._send(messages.encode_question(messages.Question(request)))
            self._answers.get()
        if self._halted is not None:
            raise BenchbotError(
                "The robot was halted before it could start.",
                self._halted,
                "Start another run when the robot and the space around it are safe: benchbot run …",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.PLATFORM,
                ends_run=True,
            )
        self._send(messages.encode_question(messages.Resumed()))


def _halt(host: Host, why: str) -> None:
    try:
        host.halt(why)
    # A plug-in may fail in any way at all. A robot that it cannot halt is stopped by its guard once this process ends.
    except Exception:  # noqa: BLE001
        traceback.print_exc()
        os._exit(ExitCode.INTERNAL)
