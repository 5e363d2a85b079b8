"""Which limits an engine really imposes: some accept every limit and ignore it."""

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.engine import Engine

LIMITS = {"MemoryLimit": "memory", "PidsLimit": "processes", "CpuCfsQuota": "processors"}
"""What an engine's information says it can limit."""


def ignored_limits(engine: Engine) -> list[str]:
    """Return what this engine would let a solution use without limit."""
    # Without root there are no limits on control groups of version 1, whatever the kernel can do for others.
    powerless = engine.rootless and str(engine.information.get("CgroupVersion")) == "1"
    return [what for key, what in LIMITS.items() if powerless or not engine.information.get(key)]


def check(engine: Engine, *, weak_limits: bool) -> list[str]:
    """Return the limits that would be ignored, where that was allowed; raises BenchbotError where it was not."""
    ignored = ignored_limits(engine)
    if ignored and not weak_limits:
        whose = "without root " if engine.rootless else ""
        raise BenchbotError(
            "The container could take all that this machine has.",
            f"{engine.name} {whose}on control groups of version {engine.information.get('CgroupVersion')} "
            f"ignores limits on {' and '.join(ignored)}.",
            "Run it as root, or on a machine with control groups of version 2; or trust the solution: --weak-limits",
        )
    return ignored
