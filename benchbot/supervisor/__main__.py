"""A back end as a child process: `python -m benchbot.supervisor`, started by `backend.Backend.start`.

Its stdin is a socket: it reads an `Order` from it, answers with a `RunState` or with `Failed`, and then serves until it
is told to stop or until the socket ends, which says that the parent is gone.
"""

import os
import signal
import socket
import sys
import threading
from pathlib import Path

import msgspec

from benchbot.core import plugins
from benchbot.core.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.selection import select
from benchbot.supervisor import channel
from benchbot.supervisor.backend import Order, serve


def main() -> int:
    """Serve what the parent asks for; return the exit code."""
    parent = socket.socket(fileno=0)
    try:
        order = msgspec.msgpack.decode(channel.receive(parent), type=Order)
        threading.Thread(target=_end_with_parent, args=(parent,), daemon=True).start()
        _run(parent, order)
    except BenchbotError as error:
        channel.send(parent, channel.encode_reply(channel.Failed.of(error)))
        return error.exit_code
    except EOFError:
        return ExitCode.INTERRUPTED
    return ExitCode.OK


def _run(parent: socket.socket, order: Order) -> None:
    selection = select(
        Catalog(plugins.load()),
        task=order.task,
        robot=order.robot,
        environment=order.environment,
        method=order.method,
        seed=order.seed,
        limits=order.limits,
        episode=order.episode,
        settings=order.settings,
    )
    serve(
        selection,
        port=order.port,
        unix_socket=None if order.unix_socket is None else Path(order.unix_socket),
        options=order.options,
        timeouts=order.timeouts,
        record={name: Path(folder) for name, folder in order.record.items()},
        on_ready=lambda state: channel.send(parent, channel.encode_reply(state)),
    )


def _end_with_parent(parent: socket.socket) -> None:
    parent.recv(1)
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
