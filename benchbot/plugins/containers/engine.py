"""The container engine of this machine, podman or docker, reached by its unix socket."""

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.containers import service

if TYPE_CHECKING:
    from docker import APIClient

ANSWER_TIMEOUT_S = 300.0
"""How long the engine may take to answer, on a machine that is busy with a simulator."""


@dataclass(frozen=True)
class Engine:
    """An engine that answers: where, what it is (`podman` or `docker`), what it says of itself, its API's version."""

    url: str
    name: str
    rootless: bool
    information: Mapping[str, Any]
    api_version: str

    def connect(self) -> "APIClient":
        """Return a connection of its own: one may not be shared by threads. Close it."""
        return _client(self.url, self.api_version)


@contextmanager
def reached() -> Iterator[Engine]:
    """Yield the engine that DOCKER_HOST names, else the first that listens, else a podman of our own.

    That one is started for as long as the context lasts. Raises BenchbotError when there is no engine, it cannot be
    talked to, or it is on another machine.
    """
    named = os.environ.get("DOCKER_HOST")
    if named:
        yield _asked(named)
        return
    refused = []
    for socket in usual_sockets():
        try:
            engine = _asked(f"unix://{socket}")
        except BenchbotError as error:
            refused.append(error.why)
            continue
        yield engine
        return
    program = shutil.which("podman")
    if program is None:
        raise BenchbotError(
            "There is no container engine.",
            "\n".join(["Neither podman nor docker is running, and podman is not installed.", *refused]),
            "Install podman (sudo apt-get install podman), or start docker; or name an engine: export DOCKER_HOST=…",
        )
    with service.podman(program) as socket:
        yield _asked(f"unix://{socket}")


def usual_sockets() -> list[Path]:
    """Return the sockets of engines that are there: the user's podman, the machine's podman, docker."""
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}")
    places = (runtime / "podman/podman.sock", Path("/run/podman/podman.sock"), Path("/var/run/docker.sock"))
    return [place for place in places if os.access(place, os.R_OK | os.W_OK)]


def failed(doing: str, error: Exception) -> BenchbotError:
    """Return the error of an engine that could not do something, in its own words."""
    said = getattr(error, "explanation", None) or str(error)
    return BenchbotError(
        f"The container engine cannot {doing}.",
        f"It says: {said}",
        "Try with podman or docker directly; 'podman info' or 'docker info' says how the engine is set up.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )


def check_installed() -> None:
    """Raise BenchbotError when the package is missing that engines are talked to through."""
    if find_spec("docker") is None:
        raise BenchbotError(
            "Containers need a Python package that is not installed.",
            "Engines are talked to through the package 'docker', for podman as well.",
            "Install it: pip install 'benchbot[containers]'",
        )


def _client(url: str, api_version: str | None = None) -> "APIClient":
    """Return a connection that asks for the version first when it is not told: podman takes its time to say it."""
    from docker import APIClient

    return APIClient(base_url=url, version=api_version, timeout=int(ANSWER_TIMEOUT_S))


def _asked(url: str) -> Engine:
    """Return the engine at a URL; raises BenchbotError unless it answers from this machine."""
    if not url.startswith("unix://"):
        raise BenchbotError(
            "The container engine is on another machine.",
            f"DOCKER_HOST is {url}, and a container there cannot reach the supervisor's unix socket here.",
            "Name an engine of this machine: export DOCKER_HOST=unix:///…, or unset DOCKER_HOST.",
        )
    check_installed()
    from docker.errors import DockerException
    from requests.exceptions import RequestException

    try:
        # It asks for the engine's version as soon as it is made.
        with closing(_client(url)) as client:
            information, version, api_version = client.info(), client.version(), client.api_version
    except (DockerException, RequestException) as error:
        raise BenchbotError(
            "The container engine does not answer.",
            f"{url}: {error}",
            "Start it, or name another one: export DOCKER_HOST=unix:///…",
            failure=FailureClass.INFRASTRUCTURE,
        ) from error
    podman = any("podman" in str(part.get("Name", "")).lower() for part in version.get("Components") or ())
    rootless = bool(information.get("Rootless")) or "name=rootless" in (information.get("SecurityOptions") or ())
    return Engine(url, "podman" if podman else "docker", rootless, information, api_version)
