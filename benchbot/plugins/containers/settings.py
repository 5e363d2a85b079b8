"""What a solution's container is given, and all that it is not: in the words of the engines' API."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.engine import Engine
from benchbot.submission.limits import OPEN_FILES, TEMPORARY_BYTES
from benchbot.submission.modes import ProcessLimits

SOCKET = "/benchbot/supervisor.sock"
OUTBOX = "/benchbot/outbox"
"""Where a solution finds the supervisor, and the folder that it writes its result into."""

NOBODY = 65534
"""Whom a solution runs as where root submits it."""

USER_PROCESSES = 16384


def user() -> tuple[int, int]:
    """Return the user and group that a solution runs as: never root, and of this machine, since it writes a file."""
    return (NOBODY, NOBODY) if os.geteuid() == 0 else (os.geteuid(), os.getegid())


def host_config(
    engine: Engine,
    limits: ProcessLimits,
    socket: Path,
    folder: Path,
    *,
    ignored: Sequence[str] = (),
    seccomp: Path | None = None,
    processors: float | None = None,
    gpus: int = 0,
) -> dict[str, Any]:
    """Return the part of a container's settings that confines it (Docker Engine API, `HostConfig`).

    No network, no capability, no way to gain one, nothing to write to but `folder` and a temporary one in memory;
    the limits in `ignored` are left away. `seccomp` is the file of a filter for podman. Raises BenchbotError for GPUs
    on an engine that cannot be asked for them.
    """
    from docker.types import DeviceRequest, HostConfig, LogConfig, Mount

    options: dict[str, Any] = {}
    if "memory" not in ignored:
        options |= {"mem_limit": limits.memory_bytes, "memswap_limit": limits.memory_bytes}
    if "processes" not in ignored:
        options |= {"pids_limit": limits.processes}
    if processors is not None and "processors" not in ignored:
        options |= {"nano_cpus": int(processors * 1e9)}
    if gpus:
        if engine.name != "docker":
            raise BenchbotError(
                "podman cannot be asked for GPUs.",
                "The programming interface that it shares with docker leaves them away without a word.",
                "Use docker, with NVIDIA's container toolkit: export DOCKER_HOST=unix:///var/run/docker.sock",
            )
        options |= {"device_requests": [DeviceRequest(count=gpus, capabilities=[["gpu"]])]}
    security = ["no-new-privileges"]
    if seccomp is not None:
        security.append(f"seccomp={seccomp}")
    if "name=selinux" in (engine.information.get("SecurityOptions") or ()):
        security.append("label=disable")  # else the socket cannot be connected to
    config = HostConfig(
        version="1.41",
        **{
            "network_mode": "none",
            "ipc_mode": "private",
            "read_only": True,
            "cap_drop": ["ALL"],
            "security_opt": security,
            "init": True,
            "tmpfs": {"/tmp": f"size={TEMPORARY_BYTES},mode=1777"},  # noqa: S108
            "ulimits": _ulimits(limits),
            # What it prints goes to us, chunk by chunk; a log of the engine's would fill the disk.
            "log_config": LogConfig(type="none"),
            "mounts": [
                Mount(SOCKET, str(socket), type="bind", read_only=True),
                Mount(OUTBOX, str(folder), type="bind", read_only=False),
            ],
            **options,
        },
    )
    if engine.name == "podman" and engine.rootless:
        config["UsernsMode"] = "keep-id"  # the user inside is the one outside, so that the result is theirs
    return dict(config)


def _ulimits(limits: ProcessLimits) -> list[Any]:
    """Return the limits of each process. All are named: podman forgets its own defaults as soon as one is."""
    import resource

    from docker.types import Ulimit

    def at_most(number: int, kind: int) -> int:
        allowed = resource.getrlimit(kind)[1]  # no engine of this user can give more
        return number if allowed == resource.RLIM_INFINITY else min(number, allowed)

    hard = {
        "nofile": at_most(OPEN_FILES, resource.RLIMIT_NOFILE),
        # Counted per user of the machine, not per container: the limit of the container is the other one.
        "nproc": at_most(USER_PROCESSES, resource.RLIMIT_NPROC),
        "fsize": at_most(limits.file_size_bytes or 0, resource.RLIMIT_FSIZE),
        "core": 0,
    }
    soft = dict(hard)
    if limits.cpu_time_s is not None:
        # Told by SIGXCPU, which says why; killed a second later where that is not heard.
        soft["cpu"] = at_most(max(1, round(limits.cpu_time_s)), resource.RLIMIT_CPU)
        hard["cpu"] = at_most(soft["cpu"] + 1, resource.RLIMIT_CPU)
    return [Ulimit(name=name, soft=soft[name], hard=number) for name, number in hard.items()]
