"""ROS 2: can it be imported, and is its environment of one piece?"""

import importlib.util
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import children

HIGHEST_DOMAIN = 232
RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
IMPORT = "import rclpy, rclpy._rclpy_pybind11; print(rclpy.__file__)"


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
    asked = children.ask([sys.executable, "-P", "-c", IMPORT], {**variables, "AMENT_PREFIX_PATH": prefix})
    if asked.problem:
        fix = (
            "Install it again: pip install --force-reinstall benchbot-robot-ros2; or source the setup.bash of one ROS 2"
        )
        yield Finding(Level.WARNING, "ROS 2", f"rclpy cannot be imported: {asked.problem}", fix)
    else:
        yield Finding(Level.OK, "ROS 2", f"rclpy from {Path(asked.said.strip()).parent}, {middleware}")
        yield from _mixed(Path(asked.said.strip()), sourced)
    yield from _discovery(variables)


def _mixed(module: Path, sourced: list[str]) -> Iterator[Finding]:
    missing = [part for part in sourced if not Path(part).is_dir()]
    if missing:
        fix = "Open a new terminal, and source only workspaces that are there."
        yield Finding(Level.WARNING, "ROS 2 folders", f"AMENT_PREFIX_PATH names {', '.join(missing)}: not there", fix)
    if sourced and not any(module.is_relative_to(part) for part in sourced) and sys.prefix not in sourced:
        detail = f"rclpy is from {module.parent}, and AMENT_PREFIX_PATH is of another ROS 2: {sourced[0]}"
        fix = "Use one of both: unset AMENT_PREFIX_PATH, or run the Python of the ROS 2 that you have sourced."
        yield Finding(Level.WARNING, "ROS 2 folders", detail, fix)


def _discovery(variables: Mapping[str, str]) -> Iterator[Finding]:
    domain, reach = variables.get("ROS_DOMAIN_ID", "0"), variables.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    detail = f"ROS_DOMAIN_ID {domain}, ROS_AUTOMATIC_DISCOVERY_RANGE {reach}"
    if not domain.isdigit() or int(domain) > HIGHEST_DOMAIN:
        fix = f"export ROS_DOMAIN_ID=0, or what the robot has: a number up to {HIGHEST_DOMAIN}."
        yield Finding(Level.WARNING, "ROS 2 discovery", f"{detail}: no such domain", fix)
    elif reach not in RANGES:
        fix = f"export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET; there is {', '.join(RANGES)}."
        yield Finding(Level.WARNING, "ROS 2 discovery", f"{detail}: no such range", fix)
    elif variables.get("ROS_LOCALHOST_ONLY") == "1" or reach in ("LOCALHOST", "OFF"):
        detail += ", ROS_LOCALHOST_ONLY 1" if variables.get("ROS_LOCALHOST_ONLY") == "1" else ""
        note = "robots on other machines are not found; for those: unset both, or SUBNET"
        yield Finding(Level.OK, "ROS 2 discovery", f"{detail}: {note}")
    else:
        yield Finding(Level.OK, "ROS 2 discovery", detail)
