"""The mode `container`: what `benchbot submit --containerised` runs a solution with."""

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugins.containers import engine as engines
from benchbot.plugins.containers import image as images
from benchbot.plugins.containers import outbox, seccomp, settings, strength
from benchbot.plugins.containers.container import Container
from benchbot.plugins.containers.context import Context
from benchbot.plugins.containers.engine import Engine
from benchbot.submission import modes
from benchbot.submission.limits import with_defaults
from benchbot.wire.run_state import Connection

if TYPE_CHECKING:
    from benchbot.submission.modes import SolutionSpec


@dataclass(frozen=True)
class Containerised:
    """Runs a solution in a container of its image, on an engine that is there for as long as the mode is used."""

    engine: Engine
    image: str
    weak_limits: bool = False
    processors: float | None = None
    gpus: int = 0

    name = "container"
    needs_socket = True

    def check(self) -> None:
        """Raise BenchbotError when the engine would ignore the limits, and nobody has allowed that."""
        strength.check(self.engine, weak_limits=self.weak_limits)

    def describe(self) -> str:
        """Return what holds the solution, in words, for who submits it."""
        ignored = strength.ignored_limits(self.engine)
        weaker = f", without a limit on {' and '.join(ignored)}" if ignored else ""
        return f"in a container ({self.engine.name}){weaker}"

    def start(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> AbstractContextManager[modes.Running]:
        """Return the solution as a container. Its image says what runs; the words after its name are in `args`."""
        return self._started(spec, connection, exchange, output)

    @contextmanager
    def _started(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> Iterator[modes.Running]:
        limits = with_defaults(spec.limits)
        user = settings.user()
        ignored = strength.check(self.engine, weak_limits=self.weak_limits)
        variables = {
            "BENCHBOT_SOCKET": settings.SOCKET,
            "BENCHBOT_TOKEN": connection.token,
            "BENCHBOT_RESULT": f"{settings.OUTBOX}/{modes.RESULT}",
            "HOME": "/tmp",  # noqa: S108  the one folder that can be written
            "PYTHONUNBUFFERED": "1",
            "args": " ".join(spec.command[1:]),
            **spec.variables,
        }
        with (
            _lent(modes.unix_socket_of(self, connection), user) as socket,
            outbox.outbox(exchange, user) as folder,
        ):
            host_config = settings.host_config(
                self.engine,
                limits,
                socket,
                folder,
                ignored=ignored,
                seccomp=seccomp.write(self.engine, exchange / "seccomp.json"),
                processors=self.processors,
                gpus=self.gpus,
            )
            taking = partial(outbox.take, folder, exchange / modes.RESULT)
            container = Container(self.engine, self.image, user, variables, host_config, limits, output, taking)
            with container:
                yield container


@contextmanager
def prepared(
    context: Context,
    tell: Callable[[str], object],
    *,
    weak_limits: bool = False,
    processors: float | None = None,
    gpus: int = 0,
) -> Iterator[Containerised]:
    """Yield the mode for a context: its engine reached and its image built; `tell` hears of the progress.

    Raises BenchbotError when there is no engine, it would ignore the limits, or the image cannot be built.
    """
    with engines.reached() as engine:
        strength.check(engine, weak_limits=weak_limits)
        yield Containerised(engine, images.built(engine, context, tell), weak_limits, processors, gpus)


@contextmanager
def _lent(socket: Path, user: tuple[int, int]) -> Iterator[Path]:
    """Let another user connect to a socket (0600) meanwhile, where we are root."""
    if os.geteuid() != 0:
        yield socket
        return
    before = socket.stat()
    os.chown(socket, *user)
    try:
        yield socket
    finally:
        if socket.exists():
            os.chown(socket, before.st_uid, before.st_gid)
