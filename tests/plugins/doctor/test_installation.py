import importlib.util
import os
import sys
from pathlib import Path

import pytest

from benchbot.core.findings import Level
from benchbot.plugins.doctor import installation

NOTHING: dict[str, str] = {"PATH": os.defpath}


def module(folder: Path, code: str = "") -> dict[str, str]:
    """Make a rclpy that can be imported, or not; return the environment that finds it."""
    (folder / "rclpy").mkdir()
    (folder / "rclpy" / "__init__.py").write_text(code)
    (folder / "rclpy" / "_rclpy_pybind11.py").touch()
    return {**NOTHING, "PYTHONPATH": str(folder)}


@pytest.mark.parametrize(
    ("variables", "level", "said"),
    [
        ({}, Level.OK, "ROS_DOMAIN_ID 0, ROS_AUTOMATIC_DISCOVERY_RANGE SUBNET"),
        ({"ROS_DOMAIN_ID": "233"}, Level.WARNING, "no such domain"),
        ({"ROS_DOMAIN_ID": "robot"}, Level.WARNING, "no such domain"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCAL"}, Level.WARNING, "no such range"),
        ({"ROS_LOCALHOST_ONLY": "1"}, Level.OK, "robots on other machines are not found"),
    ],
)
def test_discovery_is_told(variables: dict[str, str], level: Level, said: str, tmp_path: Path) -> None:
    (finding,) = (found for found in installation.ros(NOTHING | variables) if found.subject == "ROS 2 discovery")

    assert finding.level is level
    assert said in finding.detail


def test_a_ros_that_cannot_be_imported_is_a_warning(tmp_path: Path) -> None:
    variables = module(tmp_path, "raise ImportError('librcl.so: cannot open shared object file')")

    first = next(installation.ros(variables))

    assert (first.level, first.subject) == (Level.WARNING, "ROS 2")
    assert first.detail == "rclpy cannot be imported: ImportError: librcl.so: cannot open shared object file"


def test_two_of_them_mixed_are_a_warning(tmp_path: Path) -> None:
    other = tmp_path / "opt" / "ros" / "humble"
    other.mkdir(parents=True)
    variables = module(tmp_path) | {"AMENT_PREFIX_PATH": f"{other}:{tmp_path}/gone"}

    told = list(installation.ros(variables))

    gone, mixed = (finding for finding in told if finding.subject == "ROS 2 folders")
    assert gone.detail == f"AMENT_PREFIX_PATH names {tmp_path}/gone: not there"
    assert mixed.detail == f"rclpy is from {tmp_path}/rclpy, and AMENT_PREFIX_PATH is of another ROS 2: {other}"


def test_without_ros_nothing_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)

    assert [(found.level, found.fix) for found in installation.ros(NOTHING)] == [(Level.OK, "")]
    (sourced,) = installation.ros({**NOTHING, "AMENT_PREFIX_PATH": "/opt/ros/jazzy"})
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    assert sourced.detail == f"/opt/ros/jazzy is sourced, and this Python ({version}) has no rclpy"


def test_versions_are_told_and_requirements_that_are_not_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "needy-1.0.dist-info"
    info.mkdir()
    (info / "entry_points.txt").write_text("[benchbot]\nneedy = needy\n")
    needs = ["no-such-thing>=2", "numpy<1", "pyyaml", "never>=1; python_version < '3'", "more; extra == 'all'"]
    requirements = "".join(f"Requires-Dist: {need}\n" for need in needs)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: needy\nVersion: 1.0\n{requirements}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("BENCHBOT_PLUGINS", "needy")

    told, *unmet = installation.versions()

    assert "numpy " in told.detail
    assert [finding.subject for finding in unmet] == ["requirements of needy"] * 2
    assert [finding.fix for finding in unmet] == ["pip install 'no-such-thing>=2'", "pip install 'numpy<1'"]
    assert unmet[0].detail == "no-such-thing>=2 is not installed"


def test_a_command_of_another_environment_is_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other, own = tmp_path / "other", tmp_path / "own" / "bin"
    for folder in (other, own):
        folder.mkdir(parents=True)
        (folder / "benchbot").write_text("#!/bin/sh\n")
        (folder / "benchbot").chmod(0o755)
    monkeypatch.setattr("sys.prefix", str(own.parent))
    monkeypatch.setenv("PATH", str(own))
    assert installation.commands().level is Level.OK
    monkeypatch.setenv("PATH", str(other))

    warning = installation.commands()

    assert warning.fix == f"Activate this environment: source {own}/activate"
