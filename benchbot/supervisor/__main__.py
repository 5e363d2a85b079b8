"""The child process of a `Backend`: `python -m benchbot.supervisor`.

Its stdin is a socket: it reads a `BackendRequest` from it, answers with a `RunState` or with `Failed`, and then serves
until it is told to stop or the socket ends, which means that the parent is gone. Meanwhile it may read a
`RunRequest` for each further run.
"""

import faulthandler
import gc
import os
import signal
import socket
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path
from queue import Queue

import msgspec

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.supervisor.backend import BackendRequest
from benchbot.supervisor.platform import messages
from benchbot.supervisor.serve import RunPlan, serve
from benchbot.wire.run_state import RunState


def main() -> int:
    """Serve the runs that the parent asks for; return the exit code."""
    # Who has to end it by force wants to know where it stood.
    faulthandler.enable()
    parent = Parent(socket.socket(fileno=0))
    try:
        request = msgspec.msgpack.decode(messages.receive(parent.socket), type=BackendRequest)
        catalog = Catalog(plugin_manager.load())
        selection = select(catalog, request.run)
        threading.Thread(target=parent.listen, args=(catalog,), daemon=True).start()
        serve(
            selection,
            owner=request.owner,
            port=request.port,
            unix_socket=None if request.unix_socket is None else Path(request.unix_socket),
            options=request.options,
            timeouts=request.timeouts,
            record=_folders(request.run),
            following=parent.plans,
            on_ready=parent.answer,
        )
    except BenchbotError as error:
        parent.answer(error)
        return error.exit_code
    except EOFError:
        return ExitCode.INTERRUPTED
    return ExitCode.OK


@dataclass
class Parent:
    """The process that has started this one, at the other end of the socket; it waits for each answer.

    `plans` is no SimpleQueue: that of CPython 3.11 waits for ever when a signal comes as its timeout ends.
    """

    socket: socket.socket
    plans: "Queue[RunPlan]" = field(default_factory=Queue)

    def answer(self, reply: RunState | BenchbotError) -> None:
        """Answer that a run is ready, or why it is not possible."""
        if isinstance(reply, BenchbotError):
            data = messages.encode(messages.Failed.of(reply))
        else:
            data = messages.encode_value(reply)
        messages.send(self.socket, data)

    def listen(self, catalog: Catalog) -> None:
        """Put the runs that are asked for into the queue, until the parent is gone: then end this process."""
        while True:
            try:
                message = messages.receive(self.socket)
            except (EOFError, OSError):
                os.kill(os.getpid(), signal.SIGTERM)
                return
            following = msgspec.msgpack.decode(message, type=RunRequest)
            try:
                plan = RunPlan(select(catalog, following), _folders(following))
            except BenchbotError as error:
                self.answer(error)
            else:
                self.plans.put(plan)


def _folders(request: RunRequest) -> dict[str, Path]:
    return {name: Path(folder) for name, folder in request.record.items()}


if __name__ == "__main__":
    ended = main()
    gc.freeze()  # what a dying process holds need not be searched for garbage
    sys.exit(ended)
