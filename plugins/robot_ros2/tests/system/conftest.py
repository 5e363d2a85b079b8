from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from plugins.robot_ros2.tests.system.chain import PLUGIN, plugin_files
from tests.command_line import CommandLine, cli, make_plugin

__all__ = ["cli", "make_plugin"]


@pytest.fixture
def declared(domain: int, cli: CommandLine, make_plugin: Callable[..., Path]) -> Callable[..., CommandLine]:
    """Returns a command line for which the test robot is declared, with these settings of its driver."""

    def declare(**driver: Any) -> CommandLine:
        cli.variables["BENCHBOT_PLUGINS"] = "benchbot-robot-ros2"
        make_plugin("benchbot-hall", PLUGIN, plugin_files(**driver))
        return cli

    return declare
