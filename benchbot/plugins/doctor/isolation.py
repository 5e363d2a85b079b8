"""Means to isolate a solution: container engines, and bubblewrap, namespaces, Landlock and control groups.

A container engine is asked through its socket, in the API that podman and docker share:
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
from benchbot.plugins.doctor import child_process

PATIENCE_S = 5.0
NO_ENGINE = "not installed; benchbot submit --containerised needs podman or docker: sudo apt-get install podman"
APPARMOR_RESTRICTION = Path("/proc/sys/kernel/apparmor_restrict_unprivileged_userns")
NAMESPACE_PERMISSION = Path("/proc/sys/kernel/unprivileged_userns_clone")
NAMESPACE_LIMIT = Path("/proc/sys/user/max_user_namespaces")


class _UnixConnection(http.client.HTTPConnection):
    """HTTP over a unix socket."""

    def __init__(self, path: Path) -> None:
        super().__init__("localhost", timeout=PATIENCE_S)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(str(self._path))


def containers() -> Finding:
    """Say which engine a solution in a container would run on, or why it cannot."""
    clients = [name for name in ("podman", "docker") if shutil.which(name)]
    sockets = _sockets()
    if not clients and not sockets:
        return Finding(Level.OK, "containers", NO_ENGINE)
    refusals = []
    for path in sockets:
        try:
            return Finding(Level.OK, "containers", f"{_engine_version(path)} at {path}")
        except PermissionError:
            group = f"sudo usermod -aG docker {os.environ.get('USER', '$USER')}, then log in again; or install podman"
            refusals.append((f"{path} is not for this user", group))
        except (OSError, http.client.HTTPException, ValueError) as error:
            refusals.append((f"{path} does not answer: {error}", "Start the engine: sudo systemctl restart docker"))
    if "podman" in clients:
        answer = child_process.ask(["podman", "--version"])
        if not answer.problem:
            return Finding(Level.OK, "containers", f"{answer.output.strip()}, started when it is needed")
        fix = "Install it again: sudo apt-get install --reinstall podman"
        return Finding(Level.WARNING, "containers", f"podman does not run: {answer.problem}", fix)
    if refusals:
        return Finding(Level.WARNING, "containers", *refusals[0])
    fix = "Start it: sudo systemctl start docker; or, since it needs no service: sudo apt-get install podman"
    return Finding(Level.WARNING, "containers", "the docker client is there, and no engine is running", fix)


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
    return [place for place in places if _exists(place)]


def _exists(place: Path) -> bool:
    try:
        return place.exists()
    except PermissionError:
        return False


def _engine_version(path: Path) -> str:
    connection = _UnixConnection(path)
    try:
        connection.request("GET", "/version")
        answer = json.loads(connection.getresponse().read())
        names = [str(part.get("Name", "")).lower() for part in answer.get("Components") or ()]
        return f"{'podman' if any('podman' in name for name in names) else 'docker'} {answer['Version']}"
    except (AttributeError, KeyError) as error:
        raise ValueError("it is no container engine") from error
    finally:
        connection.close()


def sandbox() -> Iterator[Finding]:
    """Say whether `benchbot submit --sandbox` can isolate a solution on this machine, and with which limits."""
    from benchbot.plugins.sandbox import bubblewrap
    from benchbot.submission.init import landlock

    if bubblewrap.program() is None:
        detail = "bubblewrap is not installed; benchbot submit --sandbox needs it: sudo apt-get install bubblewrap"
        yield Finding(Level.OK, "sandbox", detail)
        return
    problem = bubblewrap.problem()
    if problem is None:
        yield Finding(Level.OK, "sandbox", f"{bubblewrap.program()} works for this user")
    else:
        yield Finding(Level.WARNING, "sandbox", problem, _namespace_fix())
    version = landlock.version()
    if version >= landlock.NEEDED_VERSION:
        yield Finding(Level.OK, "Landlock", f"version {version} of its interface")
    else:
        fix = f"Use a kernel that has version {landlock.NEEDED_VERSION} of it (Linux 6.12), with landlock in lsm=."
        found = f"version {version} of its interface" if version else "not in this kernel"
        yield Finding(Level.OK, "Landlock", f"{found}. {fix}")
    yield _control_groups()


def _namespace_fix() -> str:
    """Return how this user may create namespaces, which some distributions do not allow."""
    if _read_number(APPARMOR_RESTRICTION) == 1:
        setting = f"sudo sysctl kernel.{APPARMOR_RESTRICTION.name}=0"
        return f"Let bubblewrap make namespaces: by an AppArmor profile for it, or {setting}"
    if _read_number(NAMESPACE_PERMISSION) == 0:
        return "Allow namespaces: sudo sysctl kernel.unprivileged_userns_clone=1"
    if _read_number(NAMESPACE_LIMIT) == 0:
        return "Allow namespaces: sudo sysctl user.max_user_namespaces=15000"
    return "Allow namespaces; in a container, start it with --security-opt seccomp=unconfined, or use --containerised."


def _control_groups() -> Finding:
    from benchbot.plugins.sandbox.control_group import MOUNTED, control_group
    from benchbot.submission.modes import ProcessLimits

    version = 2 if (MOUNTED / "cgroup.controllers").exists() else 1
    with control_group(ProcessLimits(memory_bytes=2**30, processes=100)) as made:
        if made is not None:
            return Finding(Level.OK, "control groups", f"version {version}; this user can set limits")
    detail = f"version {version}; this user can have none, so --memory and --cpu-time are refused in a sandbox"
    fix = "They hold as root, and where systemd runs for the user (systemctl --user status) on version 2"
    return Finding(Level.OK, "control groups", f"{detail}. {fix}")


def _read_number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None
