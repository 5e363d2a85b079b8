"""The network between a moving robot and what drives it fails for two seconds."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot.core.errors import ExitCode
from plugins.robot_ros2.tests.system.chain import STAYS_S, assert_stays, has_passed, strike, submission, until_under_way
from plugins.robot_ros2.tests.system.private_network import CABLE_DOWN, CABLE_UP, Network, two_networks
from plugins.robot_ros2.tests.unicycle import MOUNTS, unicycle, until
from plugins.robot_ros2.tests.unicycle_robot import ACCELERATION_MPS2, COMMAND_TIMEOUT_S
from tests.command_line import CommandLine

CUT_S = 2.0
FASTEST_MPS = 1.0


def links_up(network: Network) -> set[str]:
    """Return the names of the network devices that anything could leave through."""
    return set(re.findall(r"^\d+: (\w+)", network.run("ip", "-oneline", "link", "show", "up"), re.MULTILINE))


def test_the_base_stops_by_itself_and_the_robot_stays_stopped(
    declared: Callable[..., CommandLine], monkeypatch: pytest.MonkeyPatch
) -> None:
    cli = declared(timing={"feedback_timeout_s": CUT_S / 2})
    with two_networks() as (host, there):
        assert links_up(host) == links_up(there) == {"lo", "cable"}
        # Announcements may go wherever they can: no further than to the other end of the cable.
        network = {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
            "FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).with_name("udp_only.xml")),
        }
        cli.variables |= network
        for name, value in network.items():
            monkeypatch.setenv(name, value)
        prefix = (*host.prefix, "env", f"--chdir={cli.folder}")
        with unicycle(*there.prefix, mounts=MOUNTS) as robot, submission(cli, prefix=prefix) as submitted:
            until_under_way(robot, submitted)
            strike(robot, run=CABLE_DOWN)
            until(has_passed(robot, CUT_S))
            cut = robot.state
            assert cut["v"] == 0.0
            # What was on its way arrives; a busy machine delivers it late.
            assert cut["moved_s"] - cut["struck_s"] < CUT_S / 4
            braking_s = FASTEST_MPS / ACCELERATION_MPS2
            assert cut["rested_s"] - cut["struck_s"] < COMMAND_TIMEOUT_S + braking_s + CUT_S / 4
            there.run(*CABLE_UP)
            # What the network kept may hold an old velocity; it is not to be the last word, and leads nowhere.
            until(lambda: robot.state["zeroed_s"] is not None)
            until(has_passed(robot, STAYS_S))
            assert robot.state["zeroed_s"] is not None
            assert robot.state["x"] == pytest.approx(cut["x"], abs=0.01)

            code, failure = submitted.ended()
            assert (code, failure["class"]) == (ExitCode.INTERNAL, "platform")
            assert "The robot was stopped for safety. Nothing new came on" in failure["why"]
            acted, reset = submitted.told
            assert reset == acted
            assert_stays(robot)
