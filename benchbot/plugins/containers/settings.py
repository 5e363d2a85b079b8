"""The settings that confine a solution's container: mounts, limits, the filter of system calls.

Some engines accept every limit and ignore it: their information says which.
"""

import errno
import json
import os
import socket as sockets
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.engine import Engine
from benchbot.plugins.sandbox.syscalls import NEW_NAMESPACES, REFUSED, SOCKETS
from benchbot.plugins.sandbox.weak_limits import MEMORY, refused
from benchbot.submission.limits import TEMPORARY_BYTES, of_each_process
from benchbot.submission.modes import ProcessLimits

SOCKET = "/benchbot/supervisor.sock"
OUTBOX = "/benchbot/outbox"
"""The supervisor's socket and the folder of the result, as a solution sees them."""

V2_RESULT = "/tmp/benchbot_result"  # noqa: S108
"""The file that BenchBot v2's client saves its result to."""

NOBODY = 65534
"""The user that a solution runs as where root submits it."""

USER_PROCESSES = 16384

PROCESSES, PROCESSORS = "processes", "processors"
LIMIT_KEYS = {"MemoryLimit": MEMORY, "PidsLimit": PROCESSES, "CpuCfsQuota": PROCESSORS}
"""Keys of an engine's information, and the resources that it can limit if they are true."""

SECCOMP_PROFILES = (Path("/etc/containers/seccomp.json"), Path("/usr/share/containers/seccomp.json"))
"""The places of podman's filter (containers.conf(5), `seccomp_profile`)."""


def user() -> tuple[int, int]:
    """Return the user and group that a solution runs as: never root, and of this machine, since it writes a file."""
    return (NOBODY, NOBODY) if os.geteuid() == 0 else (os.geteuid(), os.getegid())


def ignored_limits(engine: Engine) -> list[str]:
    """Return the resources that this engine would let a solution use without limit."""
    # Without root there are no limits on control groups of version 1, whatever the kernel can do for others.
    powerless = engine.rootless and str(engine.information.get("CgroupVersion")) == "1"
    return [what for key, what in LIMIT_KEYS.items() if powerless or not engine.information.get(key)]


def check_limits(engine: Engine, *, allowed: bool, processors: float | None = None) -> list[str]:
    """Return the limits that would be ignored, where that is `allowed`; raises BenchbotError where it is not."""
    ignored = [what for what in ignored_limits(engine) if what != PROCESSORS or processors is not None]
    if ignored and not allowed:
        whose = "without root " if engine.rootless else ""
        version = engine.information.get("CgroupVersion")
        raise refused(ignored, f"{engine.name} {whose}on control groups of version {version} ignores them.")
    return ignored


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
    v2_result: Path | None = None,
    volumes: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the part of a container's settings that confines it (Docker Engine API, `HostConfig`).

    No network, no capability, no way to gain one, nothing to write to but `folder` and, in memory, a temporary one and
    the `volumes` of the image; the limits in `ignored` are left away. `seccomp` is the file of a filter for podman,
    `v2_result` one that BenchBot v2's client writes to. Raises BenchbotError for GPUs on an engine that cannot be asked
    for them.
    """
    from docker.types import DeviceRequest, HostConfig, LogConfig, Mount

    options: dict[str, Any] = {}
    if MEMORY not in ignored:
        options |= {"mem_limit": limits.memory_bytes, "memswap_limit": limits.memory_bytes}
    if PROCESSES not in ignored:
        options |= {"pids_limit": limits.processes}
    if processors is not None and PROCESSORS not in ignored:
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
    # Else an engine makes volumes on this machine's disk.
    temporary = {"/tmp", *volumes} - {SOCKET, OUTBOX, V2_RESULT}  # noqa: S108
    config = HostConfig(
        version="1.41",
        **{
            "network_mode": "none",
            "ipc_mode": "private",
            "read_only": True,
            "cap_drop": ["ALL"],
            "security_opt": security,
            "init": True,
            "tmpfs": dict.fromkeys(temporary, f"size={TEMPORARY_BYTES},mode=1777"),
            "ulimits": _ulimits(limits, ignored),
            # What it prints goes to us, chunk by chunk; a log of the engine's would fill the disk.
            "log_config": LogConfig(type="none"),
            "mounts": [
                Mount(SOCKET, str(socket), type="bind", read_only=True),
                Mount(OUTBOX, str(folder), type="bind", read_only=False),
                *([Mount(V2_RESULT, str(v2_result), type="bind", read_only=False)] if v2_result else ()),
            ],
            **options,
        },
    )
    if engine.name == "podman" and engine.rootless:
        config["UsernsMode"] = "keep-id"  # the user inside is the one outside, so that the result is theirs
    return dict(config)


def _ulimits(limits: ProcessLimits, ignored: Sequence[str]) -> list[Any]:
    """Return the limits of each process. All are named: podman forgets its own defaults as soon as one is."""
    import resource

    from docker.types import Ulimit

    wanted = of_each_process(limits, grouped=MEMORY not in ignored)
    if PROCESSES not in ignored:
        # Counted per user of the machine, not per container: the limit of the container is the other one.
        wanted["RLIMIT_NPROC"] = USER_PROCESSES
    found = []
    for name, number in wanted.items():
        allowed = resource.getrlimit(getattr(resource, name))[1]  # no engine of this user can give more
        most = number if allowed == resource.RLIM_INFINITY else min(number, allowed)
        # SIGXCPU names the cause; where it is ignored, SIGKILL follows a second later.
        hard = most + 1 if name == "RLIMIT_CPU" and allowed != most else most
        found.append(Ulimit(name=name.removeprefix("RLIMIT_").lower(), soft=most, hard=hard))
    return found


def write_seccomp_profile(engine: Engine, path: Path, *, internet: bool = False) -> Path | None:
    """Write podman's filter of system calls without those that a sandbox refuses; None keeps the engine's own.

    With `internet` it allows sockets of IPv4, for a network that leads to this machine's end of it alone.

    podman's lets every process make namespaces, which is of use to containers in containers only. docker's does not.
    """
    if engine.name != "podman":
        return None
    usual = next((profile for profile in SECCOMP_PROFILES if profile.is_file()), None)
    if usual is None:
        return None
    path.write_text(json.dumps(stricter_profile(json.loads(usual.read_text("utf-8")), internet)), "utf-8")
    return path


def stricter_profile(profile: dict[str, Any], internet: bool = False) -> dict[str, Any]:
    """Return a filter (OCI runtime specification, `seccomp`) that allows no more than a sandbox does.

    It knows the machine's own table of system calls alone: a process that uses another one, of 32 bits or x32, is
    killed.
    """
    refused = {*REFUSED, "clone", "clone3", "socketcall"}
    rules = []
    for rule in profile["syscalls"]:
        # Nothing but what is below decides on sockets: a rule that looks at no argument would come before it.
        gone = {*SOCKETS, *(refused if rule["action"] == "SCMP_ACT_ALLOW" else ())}
        rules.append({**rule, "names": [name for name in rule["names"] if name not in gone]})
    # Of clone3 no filter sees the flags: unknown, it is replaced by clone.
    same = {"index": 0, "value": NEW_NAMESPACES, "valueTwo": 0, "op": "SCMP_CMP_MASKED_EQ"}
    rules.append({"names": ["clone"], "action": "SCMP_ACT_ALLOW", "args": [same]})
    # Of the families up to IPv4 there are but this one and unix sockets.
    last, allowed, others = (
        (sockets.AF_INET, "SCMP_CMP_LE", "SCMP_CMP_GT") if internet else (sockets.AF_UNIX, "SCMP_CMP_EQ", "SCMP_CMP_NE")
    )
    for operator, decision in (
        (allowed, {"action": "SCMP_ACT_ALLOW"}),
        (others, {"action": "SCMP_ACT_ERRNO", "errnoRet": errno.EACCES}),
    ):
        family = {"index": 0, "value": int(last), "valueTwo": 0, "op": operator}
        rules.append({"names": list(SOCKETS), **decision, "args": [family]})
    tables = [{"architecture": each["architecture"]} for each in profile.get("archMap") or ()]
    return {**profile, "archMap": tables, "syscalls": [rule for rule in rules if rule["names"]]}
