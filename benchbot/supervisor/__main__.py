"""A back end as a child process: `python -m benchbot.supervisor`, started by `backend.Backend.start`.

Its stdin is a socket: it reads an `Order` from it, answers with a `RunState` or with `Failed`, and then serves until it
is told to stop or until the socket ends, which says that the parent is gone. Meanwhile it may be told `Following` runs.
"""

import os
import signal
import socket
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue

import msgspec

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.selection import Selection, select
from benchbot.supervisor.backend import Following, Order, serve
from benchbot.supervisor.platform import messages
from benchbot.supervisor.succession import RunOrder
from benchbot.wire.run_state import RunState


def main() -> int:
    """Serve what the parent asks for; return the exit code."""
    parent = Parent(socket.socket(fileno=0))
    try:
        order = msgspec.msgpack.decode(messages.receive(parent.socket), type=Order)
        catalog = Catalog(plugin_manager.load())
        selection = _selection(catalog, order)
        threading.Thread(target=parent.listen, args=(catalog, order), daemon=True).start()
        serve(
            selection,
            port=order.port,
            unix_socket=None if order.unix_socket is None else Path(order.unix_socket),
            options=order.options,
            timeouts=order.timeouts,
            record=_folders(order.record),
            following=parent.orders,
            on_ready=parent.tell,
        )
    except BenchbotError as error:
        parent.refuse(error)
        return error.exit_code
    except EOFError:
        return ExitCode.INTERRUPTED
    return ExitCode.OK


@dataclass
class Parent:
    """Whoever has started this process, at the other end of the socket; it waits for each answer."""

    socket: socket.socket
    orders: "SimpleQueue[RunOrder]" = field(default_factory=SimpleQueue)

    def tell(self, state: RunState) -> None:
        """Answer that a run is ready."""
        messages.send(self.socket, messages.encode_reply(state))

    def refuse(self, error: BenchbotError) -> None:
        """Answer that a run is not possible."""
        messages.send(self.socket, messages.encode_reply(messages.Failed.of(error)))

    def listen(self, catalog: Catalog, order: Order) -> None:
        """Put the runs that are asked for into the queue, until the parent is gone: then end this process."""
        while True:
            try:
                message = messages.receive(self.socket)
            except (EOFError, OSError):
                os.kill(os.getpid(), signal.SIGTERM)
                return
            following = msgspec.msgpack.decode(message, type=Following)
            changes = {"seed": following.seed, "limits": following.limits, "episode": following.episode}
            try:
                selection = _selection(catalog, msgspec.structs.replace(order, **changes))
            except BenchbotError as error:
                self.refuse(error)
            else:
                self.orders.put(RunOrder(selection, _folders(following.record)))


def _selection(catalog: Catalog, order: Order) -> Selection:
    return select(
        catalog,
        task=order.task,
        robot=order.robot,
        environment=order.environment,
        method=order.method,
        seed=order.seed,
        limits=order.limits,
        episode=order.episode,
        settings=order.settings,
    )


def _folders(record: dict[str, str]) -> dict[str, Path]:
    return {name: Path(folder) for name, folder in record.items()}


if __name__ == "__main__":
    sys.exit(main())
