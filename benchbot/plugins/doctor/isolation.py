"""What a sandboxed solution is held by: bubblewrap, namespaces, Landlock and control groups."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.core.findings import Finding, Level

APPARMOR = Path("/proc/sys/kernel/apparmor_restrict_unprivileged_userns")
CLONE = Path("/proc/sys/kernel/unprivileged_userns_clone")
MOST = Path("/proc/sys/user/max_user_namespaces")


def sandbox() -> Iterator[Finding]:
    """Say whether `benchbot submit --sandbox` can hold a solution on this machine, and with which limits."""
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
        yield Finding(Level.WARNING, "sandbox", problem, _way_out())
    version = landlock.version()
    if version >= landlock.NEEDED_VERSION:
        yield Finding(Level.OK, "Landlock", f"version {version} of its interface")
    else:
        fix = f"Use a kernel that has version {landlock.NEEDED_VERSION} of it (Linux 6.12), with landlock in lsm=."
        found = f"version {version} of its interface" if version else "not in this kernel"
        yield Finding(Level.OK, "Landlock", f"{found}. {fix}")
    yield _control_groups()


def _way_out() -> str:
    """Return how this user comes to namespaces, which some distributions keep from them."""
    if _number(APPARMOR) == 1:
        setting = f"sudo sysctl kernel.{APPARMOR.name}=0"
        return f"Let bubblewrap make namespaces: by an AppArmor profile for it, or {setting}"
    if _number(CLONE) == 0:
        return "Allow namespaces: sudo sysctl kernel.unprivileged_userns_clone=1"
    if _number(MOST) == 0:
        return "Allow namespaces: sudo sysctl user.max_user_namespaces=15000"
    return "Allow namespaces; in a container, start it with --security-opt seccomp=unconfined, or use --containerised."


def _control_groups() -> Finding:
    from benchbot.plugins.sandbox.control_group import MOUNTED, control_group
    from benchbot.submission.modes import ProcessLimits

    version = 2 if (MOUNTED / "cgroup.controllers").exists() else 1
    with control_group(ProcessLimits(memory_bytes=2**30, processes=100)) as made:
        if made is not None:
            return Finding(Level.OK, "control groups", f"version {version}; this user can set limits")
    detail = f"version {version}; this user cannot make one, so limits are those of each process alone"
    return Finding(
        Level.OK, "control groups", f"{detail}. As root, or below a service with Delegate=yes, they hold for all"
    )


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):
        return None
