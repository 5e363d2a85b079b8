"""The submission mode `container` (`benchbot.submission.modes.Holder`): an image that is built from a Dockerfile.

Its options: `folder` and perhaps `file`, which `resolved` turns into `context` and `dockerfile`; `weak_limits`,
`processors`, `gpus` and `v2_client`.
"""

import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import CONTAINER
from benchbot.cli.kit.preflight import Intent
from benchbot.plugin import Catalog, Finding, Level
from benchbot.plugins.containers import outbox, settings
from benchbot.plugins.containers.container import Container
from benchbot.plugins.containers.context import Context, find
from benchbot.plugins.containers.engine import Engine, reached
from benchbot.plugins.containers.image import built, volumes_of
from benchbot.plugins.sandbox.weak_limits import DISK
from benchbot.plugins.v2 import bridge
from benchbot.submission import modes
from benchbot.submission.limits import with_defaults
from benchbot.submission.modes import SolutionSpec
from benchbot.wire.run_state import Connection


def resolved(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with the Dockerfile found; raises BenchbotError when there is none."""
    rest = {key: value for key, value in options.items() if key not in ("folder", "file")}
    folder, file = Path(options["folder"]), options.get("file")
    found = find(folder) if file is None else find(Path(file), folder)
    return {**rest, "context": str(found.folder), "dockerfile": found.dockerfile}


@contextmanager
def prepared(spec: SolutionSpec, options: Mapping[str, Any], tell: Callable[[str], object]) -> Iterator[SolutionSpec]:
    """Yield the specification with a container of its image; the words of its command go to the image's own.

    `tell` is called with the progress of the build. Raises BenchbotError when there is no engine, it would ignore the
    limits, or the image cannot be built.
    """
    source = _context(options)
    with container_mode(
        source,
        tell,
        weak_limits=options.get("weak_limits", False),
        processors=options.get("processors"),
        gpus=options.get("gpus", 0),
        v2_client=options.get("v2_client", False),
    ) as held:
        # An ordinary user's outbox is a folder of this machine.
        weak = (*held.ignored_limits(), *(() if os.geteuid() == 0 else (DISK,)))
        command = [held.image, *spec.command]
        yield replace(spec, command=command, folder=source.folder, mode=held, weak_limits=weak)


def check(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield how solutions are held in containers; raises BenchbotError without an engine that can hold them."""
    wanted = [each.options for each in intent.submissions if each.mode == CONTAINER]
    if not wanted:
        return
    with reached() as engine:
        for options in wanted:
            settings.check_limits(
                engine, allowed=options.get("weak_limits", False), processors=options.get("processors")
            )
            yield Finding(Level.OK, "held", f"in a container ({engine.name}) of {options['context']}")


def _context(options: Mapping[str, Any]) -> Context:
    return Context(Path(options["context"]), options["dockerfile"])


@dataclass(frozen=True)
class Containerised:
    """Runs a solution in a container of its image, on an engine that is there for as long as the mode is used."""

    engine: Engine
    image: str
    weak_limits: bool = False
    processors: float | None = None
    gpus: int = 0
    v2_client: bool = False
    volumes: tuple[str, ...] = ()
    """The folders that its image declares as volumes."""

    name = "container"
    needs_socket = True

    def check(self) -> None:
        """Raise BenchbotError when the engine ignores limits, unless that is allowed."""
        self.ignored_limits()

    def describe(self) -> str:
        """Return the kind of container as a part of a sentence."""
        return f"in a container ({self.engine.name})"

    def ignored_limits(self) -> list[str]:
        """Return the limits that the engine ignores; raises BenchbotError unless that is allowed."""
        return settings.check_limits(self.engine, allowed=self.weak_limits, processors=self.processors)

    @contextmanager
    def start(
        self, spec: SolutionSpec, connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> Iterator[modes.Running]:
        """Yield the solution as a container. Its image says what runs; the words after its name are in `args`."""
        limits = with_defaults(spec.limits)
        user = settings.user()
        ignored = self.ignored_limits()
        password = secrets.token_hex(16)
        variables = {
            "BENCHBOT_SOCKET": settings.SOCKET,
            "BENCHBOT_TOKEN": connection.token,
            "BENCHBOT_RESULT": f"{settings.OUTBOX}/{modes.RESULT}",
            "HOME": "/tmp",  # noqa: S108  the one folder that can be written
            "PYTHONUNBUFFERED": "1",
            "args": " ".join(spec.command[1:]),
            **(bridge.variables(password) if self.v2_client else {}),
            **spec.variables,
        }
        socket = modes.unix_socket_of(self, connection)
        owner = user if os.geteuid() == 0 else None
        with modes.owned_by(owner, socket), outbox.outbox(exchange, user) as folder:
            host_config = settings.host_config(
                self.engine,
                limits,
                socket,
                folder,
                ignored=ignored,
                seccomp=settings.write_seccomp_profile(self.engine, exchange / "seccomp.json", internet=self.v2_client),
                processors=self.processors,
                gpus=self.gpus,
                v2_result=outbox.v2_result(folder, owner) if self.v2_client else None,
                volumes=self.volumes,
            )
            config = {
                "Image": self.image,
                "User": "{}:{}".format(*user),
                "Hostname": "solution",
                "Env": [f"{name}={value}" for name, value in variables.items()],
                "HostConfig": host_config,
            }
            take_result = partial(outbox.take, folder, exchange / modes.RESULT)
            with ExitStack() as stack:
                container = stack.enter_context(Container(self.engine, config, limits, output, take_result))
                if self.v2_client and container.process:  # one that is over at once has no network any more
                    stack.enter_context(bridge.listening_in(container.process, connection, password, output))
                yield container


@contextmanager
def container_mode(
    context: Context,
    tell: Callable[[str], object],
    *,
    weak_limits: bool = False,
    processors: float | None = None,
    gpus: int = 0,
    v2_client: bool = False,
) -> Iterator[Containerised]:
    """Yield the mode for a context: its engine reached and its image built; `tell` is called with progress.

    Raises BenchbotError when there is no engine, it would ignore the limits, or the image cannot be built.
    """
    with reached() as engine:
        settings.check_limits(engine, allowed=weak_limits, processors=processors)
        image = built(engine, context, tell)
        yield Containerised(engine, image, weak_limits, processors, gpus, v2_client, volumes_of(engine, image))
