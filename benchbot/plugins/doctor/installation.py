"""Installed software: Python, the command, the versions of what BenchBot depends on, and ROS 2."""

import importlib.util
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import Distribution
from pathlib import Path
from typing import NamedTuple

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from benchbot.core import plugin_manager
from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import child_process

SUPPORTED_PYTHON = ((3, 11), (3, 13))
SHOWN = ("numpy", "scipy", "taichi", "opencv-python-headless", "gymnasium", "ray", "docker", "ros-jazzy-rclpy", "torch")
"""The distributions whose versions matter most when a result or an error is to be understood."""
_FOLDER = re.compile(r"(?P<name>.+?)-(?P<version>[^-]+)(?:-py[\d.]+)?\.(?:dist|egg)-info")

HIGHEST_DOMAIN = 232
DISCOVERY_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
IMPORT_RCLPY = "import rclpy, rclpy._rclpy_pybind11; print(rclpy.__file__)"


class _Installed(NamedTuple):
    version: str
    folder: Path


def python() -> Finding:
    """Say which Python runs on which machine."""
    lowest, highest = SUPPORTED_PYTHON
    detail = f"{platform.python_version()} on {platform.platform()}, {sys.executable}"
    if lowest <= sys.version_info[:2] <= highest:
        return Finding(Level.OK, "Python", detail)
    wanted = f"{lowest[0]}.{lowest[1]} to {highest[0]}.{highest[1]}"
    return Finding(Level.WARNING, "Python", detail, f"BenchBot is tested with Python {wanted}: use one of these.")


def commands() -> Finding:
    """Say whether the command that a shell finds is the one of this environment."""
    found = shutil.which("benchbot")
    own = Path(sys.prefix) / "bin" / "benchbot"
    if found is None:
        return Finding(Level.OK, "command", f"not on PATH; it is {own}" if own.exists() else "not on PATH")
    if own.exists() and not Path(found).samefile(own):
        detail = f"the shell finds {found}, and this is the environment {sys.prefix}"
        return Finding(Level.WARNING, "command", detail, f"Activate this environment: source {own.parent / 'activate'}")
    return Finding(Level.OK, "command", found)


def versions() -> Iterator[Finding]:
    """Say which versions are installed, and which requirements of BenchBot and of its plug-ins are not met."""
    installed = _installed()
    shown = [f"{name} {installed[name].version}" for name in ("benchbot", *SHOWN) if name in installed]
    yield Finding(Level.OK, "versions", ", ".join(shown))
    for info in plugin_manager.installed():
        found = installed.get(canonicalize_name(info.distribution))
        for missing in _unmet(found.folder, installed) if found else ():
            yield Finding(Level.BROKEN, f"requirements of {info.distribution}", *missing)


def _installed() -> dict[str, _Installed]:
    """Return the installed distributions by the names of their folders alone: reading all metadata takes far longer.

    https://packaging.python.org/en/latest/specifications/recording-installed-packages/
    """
    found: dict[str, _Installed] = {}
    for place in filter(None, sys.path):
        folder = Path(place)
        for info in sorted(folder.glob("*-info")) if folder.is_dir() else ():
            named = _FOLDER.fullmatch(info.name)
            if named:
                # The first on sys.path is the one that Python imports.
                found.setdefault(canonicalize_name(named["name"]), _Installed(named["version"], info))
    return found


def _unmet(folder: Path, installed: Mapping[str, _Installed]) -> Iterator[tuple[str, str]]:
    """Yield what is required and not installed, or in another version, each with its fix."""
    for text in Distribution.at(folder).requires or ():
        requirement = Requirement(text)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        wanted = text.partition(";")[0].strip()
        found = installed.get(canonicalize_name(requirement.name))
        if found is None:
            yield f"{wanted} is not installed", f"pip install '{wanted}'"
        elif not requirement.specifier.contains(found.version, prereleases=True):
            yield f"{wanted} is required, and {found.version} is installed", f"pip install '{wanted}'"


def ros(variables: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Say whether ROS 2 is there, and what of its environment keeps robots from being found."""
    sourced = [part for part in variables.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]
    found = importlib.util.find_spec("rclpy")
    if found is None:
        if sourced:
            fix = "Use the Python that this ROS 2 is for, or have one here: benchbot install benchbot-robot-ros2"
            detail = (
                f"{sourced[0]} is sourced, and this Python ({sys.version_info[0]}.{sys.version_info[1]}) has no rclpy"
            )
            yield Finding(Level.WARNING, "ROS 2", detail, fix)
        else:
            yield Finding(Level.OK, "ROS 2", "not installed; real robots need it: benchbot install benchbot-robot-ros2")
        return
    prefix = variables.get("AMENT_PREFIX_PATH") or sys.prefix
    middleware = variables.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    answer = child_process.ask([sys.executable, "-P", "-c", IMPORT_RCLPY], {**variables, "AMENT_PREFIX_PATH": prefix})
    if answer.problem:
        fix = (
            "Install it again: pip install --force-reinstall benchbot-robot-ros2; or source the setup.bash of one ROS 2"
        )
        yield Finding(Level.WARNING, "ROS 2", f"rclpy cannot be imported: {answer.problem}", fix)
    else:
        module = Path(answer.output.strip())
        yield Finding(Level.OK, "ROS 2", f"rclpy from {module.parent}, {middleware}")
        yield from _mixed_installations(module, sourced)
    yield _discovery(variables)


def _mixed_installations(module: Path, sourced: list[str]) -> Iterator[Finding]:
    missing = [part for part in sourced if not Path(part).is_dir()]
    if missing:
        fix = "Open a new terminal, and source only workspaces that are there."
        yield Finding(Level.WARNING, "ROS 2 folders", f"AMENT_PREFIX_PATH names {', '.join(missing)}: not there", fix)
    if sourced and not any(module.is_relative_to(part) for part in sourced) and sys.prefix not in sourced:
        detail = f"rclpy is from {module.parent}, and AMENT_PREFIX_PATH is of another ROS 2: {sourced[0]}"
        fix = "Use one of both: unset AMENT_PREFIX_PATH, or run the Python of the ROS 2 that you have sourced."
        yield Finding(Level.WARNING, "ROS 2 folders", detail, fix)


def _discovery(variables: Mapping[str, str]) -> Finding:
    domain, reach = variables.get("ROS_DOMAIN_ID", "0"), variables.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    localhost_only = variables.get("ROS_LOCALHOST_ONLY") == "1"
    subject, detail = "ROS 2 discovery", f"ROS_DOMAIN_ID {domain}, ROS_AUTOMATIC_DISCOVERY_RANGE {reach}"
    if not domain.isdigit() or int(domain) > HIGHEST_DOMAIN:
        fix = f"export ROS_DOMAIN_ID=0, or what the robot has: a number up to {HIGHEST_DOMAIN}."
        return Finding(Level.WARNING, subject, f"{detail}: no such domain", fix)
    if reach not in DISCOVERY_RANGES:
        fix = f"export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET; there is {', '.join(DISCOVERY_RANGES)}."
        return Finding(Level.WARNING, subject, f"{detail}: no such range", fix)
    if localhost_only or reach in ("LOCALHOST", "OFF"):
        detail += ", ROS_LOCALHOST_ONLY 1" if localhost_only else ""
        detail += ": robots on other machines are not found; for those: unset both, or SUBNET"
    return Finding(Level.OK, subject, detail)
