"""The environment that is installed into: the one that this Python runs in."""

import os
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError

_VENV = "python3 -m venv ~/benchbot && ~/benchbot/bin/pip install benchbot, then use ~/benchbot/bin/benchbot"


@dataclass(frozen=True)
class Environment:
    """A virtual environment: its folder, its Python, and the folders that distributions are installed into."""

    prefix: Path
    python: Path
    sites: tuple[Path, ...]

    @property
    def site(self) -> Path:
        """The folder of pure Python."""
        return self.sites[0]

    @property
    def own(self) -> Path:
        """The folder that BenchBot keeps its lock and its journal in."""
        return self.prefix / ".benchbot"


def current() -> Environment:
    """Return the environment of this process; raises BenchbotError where nothing should or can be installed."""
    prefix = Path(sys.prefix)
    if sys.prefix == sys.base_prefix and not (prefix / "conda-meta").is_dir():
        managed = (Path(sysconfig.get_path("stdlib")) / "EXTERNALLY-MANAGED").is_file()
        raise BenchbotError(
            "BenchBot does not run in a virtual environment.",
            f"{prefix} belongs to the system"
            f"{', whose package manager looks after it (PEP 668)' if managed else ''}: "
            "what is installed there may break other programs.",
            f"Make one of its own: {_VENV}",
        )
    sites = dict.fromkeys(Path(sysconfig.get_path(name)) for name in ("purelib", "platlib"))
    found = Environment(prefix, Path(sys.executable), tuple(sites))
    for folder in (prefix, *found.sites):
        if not os.access(folder, os.W_OK | os.X_OK):
            raise BenchbotError(
                "Nothing can be installed here: no permission to write.",
                f"{folder} is not yours to write, or is on a disk that is mounted read-only.",
                f"Ask whom it belongs to, or make an environment of your own: {_VENV}",
            )
    return found
