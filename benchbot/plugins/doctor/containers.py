"""Container engines: is podman or docker there, and does it answer this user?

The engine is asked by its socket, in the API that both have:
https://docs.docker.com/reference/api/engine/
"""

import http.client
import json
import os
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import children

PATIENCE_S = 5.0
WITHOUT = "not installed; benchbot submit --containerised needs podman or docker: sudo apt-get install podman"


class _Unix(http.client.HTTPConnection):
    """HTTP over a unix socket."""

    def __init__(self, path: Path) -> None:
        super().__init__("localhost", timeout=PATIENCE_S)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(str(self._path))


def containers() -> Iterator[Finding]:
    """Say which engine a solution in a container would run on, or what keeps it from that."""
    clients = [name for name in ("podman", "docker") if shutil.which(name)]
    sockets = _sockets()
    if not clients and not sockets:
        yield Finding(Level.OK, "containers", WITHOUT)
        return
    refusals = []
    for path in sockets:
        try:
            yield Finding(Level.OK, "containers", f"{_asked(path)} at {path}")
        except PermissionError:
            group = f"sudo usermod -aG docker {os.environ.get('USER', '$USER')}, then log in again; or install podman"
            refusals.append((f"{path} is not for this user", group))
        except (OSError, http.client.HTTPException, ValueError) as error:
            refusals.append((f"{path} does not answer: {error}", "Start the engine: sudo systemctl restart docker"))
        else:
            return
    if "podman" in clients:
        answer = children.ask(["podman", "--version"])
        if answer.problem:
            fix = "Install it again: sudo apt-get install --reinstall podman"
            yield Finding(Level.WARNING, "containers", f"podman does not run: {answer.problem}", fix)
        else:
            yield Finding(Level.OK, "containers", f"{answer.said.strip()}, started when it is needed")
    elif refusals:
        yield Finding(Level.WARNING, "containers", *refusals[0])
    else:
        fix = "Start it: sudo systemctl start docker; or, since it needs no service: sudo apt-get install podman"
        yield Finding(Level.WARNING, "containers", "the docker client is there, and no engine is running", fix)


def _sockets() -> list[Path]:
    named = os.environ.get("DOCKER_HOST", "")
    if named.startswith("unix://"):
        return [Path(named.removeprefix("unix://"))]
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}")
    places = (
        runtime / "podman/podman.sock",
        Path("/run/podman/podman.sock"),
        runtime / "docker.sock",
        Path("/var/run/docker.sock"),
    )
    return [place for place in places if _is_there(place)]


def _is_there(place: Path) -> bool:
    try:
        return place.exists()
    except PermissionError:
        return False


def _asked(path: Path) -> str:
    connection = _Unix(path)
    try:
        connection.request("GET", "/version")
        answer = json.loads(connection.getresponse().read())
        names = [str(part.get("Name", "")).lower() for part in answer.get("Components") or ()]
        return f"{'podman' if any('podman' in name for name in names) else 'docker'} {answer['Version']}"
    except (AttributeError, KeyError) as error:
        raise ValueError("it is no container engine") from error
    finally:
        connection.close()
