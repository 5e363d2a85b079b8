"""The container engine of this machine, podman or docker, reached by its unix socket."""

import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.submission.solution import Solution
from benchbot.wire.run_state import is_listening

if TYPE_CHECKING:
    from docker import APIClient

ANSWER_TIMEOUT_S = 300.0
"""The time that the engine has to answer, on a machine that is busy with a simulator."""

START_TIMEOUT_S = 60.0
POLL_S = 0.02


@dataclass(frozen=True)
class Engine:
    """An engine that answers: its URL, name (`podman` or `docker`), information and version of its API."""

    url: str
    name: str
    rootless: bool
    information: Mapping[str, Any]
    api_version: str

    def connect(self) -> "APIClient":
        """Return a new connection, to be closed by the caller: threads may not share one."""
        return _client(self.url, self.api_version)


@contextmanager
def reached() -> Iterator[Engine]:
    """Yield the engine that DOCKER_HOST names, else the first that listens, else a podman of our own.

    The latter is started for as long as the context lasts. Raises BenchbotError when there is no engine, it cannot be
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
    with podman_service(program) as socket:
        yield _asked(f"unix://{socket}")


@contextmanager
def podman_service(program: str) -> Iterator[Path]:
    """Start `podman system service` of that program, yield its socket when it answers there, and end it on leaving.

    It is a process, not a daemon: where podman is installed, nothing has to be set up. Its whole process tree ends,
    however this process ends. Raises BenchbotError when it does not start.
    """
    with tempfile.TemporaryDirectory(prefix="benchbot-podman-") as folder:
        socket = Path(folder) / "podman.sock"
        command = [program, "system", "service", "--time", "0", f"unix://{socket}"]
        # Under an init process, as a solution is: the processes of a build would outlive the service.
        with Solution(command, Path("/"), os.environ, lambda chunk: None) as service:
            deadline_s = time.monotonic() + START_TIMEOUT_S
            while not is_listening(socket):
                if service.wait(POLL_S) is not None or time.monotonic() > deadline_s:
                    raise _podman_does_not_start(service.last_words)
            yield socket


def usual_sockets() -> list[Path]:
    """Return the sockets of engines that exist: the user's podman, the machine's podman, docker."""
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


def api_errors() -> tuple[type[Exception], ...]:
    """Return the exceptions that calls of an engine raise."""
    from docker.errors import DockerException
    from requests.exceptions import RequestException

    return DockerException, RequestException


def check_installed() -> None:
    """Raise BenchbotError when the package `docker` is missing, through which engines are used."""
    if find_spec("docker") is None:
        raise BenchbotError(
            "Containers need a Python package that is not installed.",
            "Engines are talked to through the package 'docker', for podman as well.",
            "Install it: pip install 'benchbot[containers]'",
        )


def _client(url: str, api_version: str | None = None) -> "APIClient":
    """Return a connection; without a version it asks for that first, which takes long with podman."""
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
    try:
        # It asks for the engine's version as soon as it is made.
        with closing(_client(url)) as client:
            information, version, api_version = client.info(), client.version(), client.api_version
    except api_errors() as error:
        raise BenchbotError(
            "The container engine does not answer.",
            f"{url}: {error}",
            "Start it, or name another one: export DOCKER_HOST=unix:///…",
            failure=FailureClass.INFRASTRUCTURE,
        ) from error
    podman = any("podman" in str(part.get("Name", "")).lower() for part in version.get("Components") or ())
    rootless = bool(information.get("Rootless")) or "name=rootless" in (information.get("SecurityOptions") or ())
    return Engine(url, "podman" if podman else "docker", rootless, information, api_version)


def _podman_does_not_start(said: str) -> BenchbotError:
    return BenchbotError(
        "podman does not start.",
        f"'podman system service' says: {said or 'nothing'}",
        "Try 'podman info'; it says what is missing.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
