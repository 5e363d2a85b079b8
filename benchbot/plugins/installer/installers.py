"""What does the installing: uv where there is one, else pip, behind one small interface."""

import importlib.util
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.running import Runner


@dataclass(frozen=True)
class Pin:
    """One distribution of one version: its normal name, and the line of a requirements file that means just this."""

    name: str
    version: str
    line: str


@dataclass(frozen=True)
class Order:
    """What an installer is asked: lines of requirements, and under which conditions.

    Of the names in `upgrade` the newest version is wanted; `fixed` are pins of what must not change. `alone` leaves out
    what the distributions need. `may_build` allows distributions without a wheel, whose own code runs to build one.
    """

    lines: Sequence[str]
    upgrade: frozenset[str] = frozenset()
    fixed: Sequence[str] = ()
    require_hashes: bool = False
    alone: bool = False
    may_build: bool = False
    indexes: Indexes = field(default_factory=Indexes)


class Installer(Protocol):
    """pip or uv. Every method raises BenchbotError with the reason that it gave."""

    @property
    def name(self) -> str:
        """`uv` or `pip`."""

    def resolve(self, order: Order) -> list[Pin]:
        """Return what would be installed; changes nothing."""

    def unpack(self, order: Order, folder: Path) -> None:
        """Unpack exactly the pinned lines into a folder."""

    def install(self, order: Order) -> None:
        """Install exactly the pinned lines, over whatever is there."""

    def remove(self, names: Sequence[str]) -> None:
        """Uninstall distributions."""

    def build(self, source: Path, folder: Path, indexes: Indexes) -> None:
        """Build a wheel of a project and put it into a folder."""

    def hashes(self, pins: Sequence[Pin], indexes: Indexes) -> dict[str, list[str]]:
        """Return by name the hashes `sha256:…` of the files that an index offers for pins."""


def choose(wanted: str | None, environment: Environment, runner: Runner) -> Installer:
    """Return the installer that was asked for, or the best there is; raises BenchbotError when there is none."""
    from benchbot.plugins.installer.pip import Pip
    from benchbot.plugins.installer.uv import Uv

    uv = _uv()
    if wanted not in (None, "uv", "pip"):
        raise BenchbotError(
            f"'{wanted}' is no installer.", "There are uv and pip.", "Leave it out, or give --installer uv or pip."
        )
    if uv and wanted != "pip":
        return Uv(uv, environment, runner)
    if wanted == "uv":
        raise BenchbotError(
            "uv is not installed.", "It is neither on the PATH nor in this environment.", "pip install uv"
        )
    if importlib.util.find_spec("pip") is None:
        raise BenchbotError(
            "There is nothing to install with.",
            f"{environment.prefix} has neither uv nor pip.",
            f"Put pip into it: {sys.executable} -m ensurepip",
        )
    return Pip(environment, runner)


def _uv() -> list[str] | None:
    found = shutil.which("uv")
    if found is not None:
        return [found]
    return [sys.executable, "-m", "uv"] if importlib.util.find_spec("uv") is not None else None


_PINNED = re.compile(r"([A-Za-z0-9][\w.-]*)==([^\s;]+)")


def pinned(line: str) -> str | None:
    """Return the version that a line of requirements pins, or None."""
    found = _PINNED.match(line.replace(" ", ""))
    return None if found is None else found[2].partition("--")[0]


def write_lines(folder: Path, lines: Sequence[str], name: str = "requirements.txt") -> Path:
    """Write a requirements file; return its path."""
    path = folder / name
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path
