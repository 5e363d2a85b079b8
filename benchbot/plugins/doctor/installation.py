"""The Python that runs, the command that is found, and the versions of what BenchBot stands on."""

import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import Distribution
from pathlib import Path
from typing import NamedTuple

from benchbot.core import plugin_manager
from benchbot.core.findings import Finding, Level

SUPPORTED_PYTHON = ((3, 11), (3, 13))
TOLD = ("numpy", "scipy", "taichi", "opencv-python-headless", "gymnasium", "ray", "docker", "ros-jazzy-rclpy", "torch")
"""Whose versions matter most when a result or an error is to be understood."""


class _Found(NamedTuple):
    version: str
    folder: Path


_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_FOLDER = re.compile(r"(?P<name>.+?)-(?P<version>[^-]+)(?:-py[\d.]+)?\.(?:dist|egg)-info")


def python() -> Iterator[Finding]:
    """Say which Python runs on which machine."""
    lowest, highest = SUPPORTED_PYTHON
    detail = f"{platform.python_version()} on {platform.platform()}, {sys.executable}"
    if lowest <= sys.version_info[:2] <= highest:
        yield Finding(Level.OK, "Python", detail)
    else:
        wanted = f"{lowest[0]}.{lowest[1]} to {highest[0]}.{highest[1]}"
        yield Finding(Level.WARNING, "Python", detail, f"BenchBot is tested with Python {wanted}: use one of these.")


def commands() -> Iterator[Finding]:
    """Say whether the command that a shell finds is the one of this environment."""
    found = shutil.which("benchbot")
    own = Path(sys.prefix) / "bin" / "benchbot"
    if found is None:
        yield Finding(Level.OK, "command", f"not on PATH; it is {own}" if own.exists() else "not on PATH")
    elif own.exists() and not Path(found).samefile(own):
        fix = f"Activate this environment: source {own.parent / 'activate'}"
        yield Finding(
            Level.WARNING, "command", f"the shell finds {found}, and this is the environment {sys.prefix}", fix
        )
    else:
        yield Finding(Level.OK, "command", found)


def versions() -> Iterator[Finding]:
    """Say which versions there are, and which requirements of BenchBot and of its plug-ins are not met."""
    there = _there()
    told = ["benchbot", *TOLD]
    shown = [f"{name} {there[name].version}" for name in told if name in there]
    yield Finding(Level.OK, "versions", ", ".join(shown))
    for info in plugin_manager.installed():
        found = there.get(_normal(info.distribution))
        for missing in _unmet(found.folder, there) if found else ():
            yield Finding(Level.BROKEN, f"requirements of {info.distribution}", *missing)


def _there() -> dict[str, _Found]:
    """Return what is installed, from the names of folders alone: reading all metadata would take the longest of all.

    https://packaging.python.org/en/latest/specifications/recording-installed-packages/
    """
    found: dict[str, _Found] = {}
    for place in filter(None, sys.path):
        folder = Path(place)
        for info in sorted(folder.glob("*-info")) if folder.is_dir() else ():
            named = _FOLDER.fullmatch(info.name)
            if named:
                # The first on sys.path is the one that Python imports.
                found.setdefault(_normal(named["name"]), _Found(named["version"], info))
    return found


def _unmet(folder: Path, there: dict[str, _Found]) -> Iterator[tuple[str, str]]:
    """Yield what is required and not installed, or in another version, each with its fix."""
    for text in Distribution.at(folder).requires or ():
        wanted, _, marker = (part.strip() for part in text.partition(";"))
        if "extra" in marker or not _applies(marker):
            continue
        name = _NAME.match(wanted)
        found = there.get(_normal(name[0])) if name else None
        if found is None:
            yield f"{wanted} is not installed", f"pip install '{wanted}'"
        elif not _fits(wanted, found.version):
            yield f"{wanted} is required, and {found.version} is installed", f"pip install '{wanted}'"


def _applies(marker: str) -> bool:
    try:
        from packaging.markers import Marker
    except ImportError:  # it comes with pip and nearly everything else, but nothing here requires it
        return not marker
    return not marker or Marker(marker).evaluate()


def _fits(wanted: str, version: str) -> bool:
    try:
        from packaging.requirements import Requirement
    except ImportError:
        return True
    return Requirement(wanted).specifier.contains(version, prereleases=True)


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
