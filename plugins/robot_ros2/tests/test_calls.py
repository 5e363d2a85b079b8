"""Services that are called before a run and after it, whatever becomes of it."""

from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.motion import Outcome
from plugins.robot_ros2.tests.unicycle import act, declaration, driver, scene, unicycle

pytestmark = pytest.mark.usefixtures("domain")

POWER = {"ros_service": "/power", "ros_type": "std_srvs/srv/SetBool"}
BEFORE = [{"ros_service": "/claim"}, POWER]
AFTER = [{"ros_service": "/release"}, POWER | {"data": False}]
BEGUN, ENDED = ["claim", "powerTrue"], ["powerFalse", "release"]


def test_a_run_begins_and_ends_with_its_services_and_trials_in_between_call_none(tmp_path: Path) -> None:
    robot = declaration(before=BEFORE, after=AFTER)
    with unicycle() as there:
        with driver(robot, tmp_path) as platform:
            platform.load(scene(), 0)
            assert act(platform, robot, "move_distance", distance=0.2) is Outcome.REACHED
            platform.load(scene(), 0)
            assert there.state["called"] == BEGUN
        assert there.state["called"] == BEGUN + ENDED


def test_a_service_that_refuses_is_a_failure_of_the_platform_in_its_own_words(tmp_path: Path) -> None:
    with unicycle(refuses=["power"]) as there, driver(declaration(before=BEFORE, after=AFTER), tmp_path) as platform:
        with pytest.raises(BenchbotError, match="did not do what /power asks of it") as caught:
            platform.load(scene(), 0)
        assert caught.value.failure is FailureClass.PLATFORM
        assert "it answered: power: somebody else has it." in caught.value.why
        assert "ros2 service call /power std_srvs/srv/SetBool '{data: true}'" in caught.value.fix
        # What was begun is ended; that ending it fails, too, hides nothing.
        assert there.state["called"] == BEGUN + ENDED


def test_a_service_that_nobody_offers_is_waited_for_as_long_as_declared(tmp_path: Path) -> None:
    robot = declaration(before=[{"ros_service": "/stand", "timeout_s": 0.5}])
    with unicycle(), driver(robot, tmp_path) as platform, pytest.raises(BenchbotError) as caught:
        platform.load(scene(), 0)
    assert "nobody offers it within 0.5 s" in caught.value.why


def test_what_fails_after_a_run_is_in_its_log(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with unicycle(refuses=["release"]):
        with driver(declaration(after=AFTER), tmp_path) as platform:
            platform.load(scene(), 0)
        assert "After the run: The robot 'unicycle' did not do what /release asks of it." in capfd.readouterr().err


def test_a_run_that_is_stopped_for_safety_ends_with_its_services(tmp_path: Path) -> None:
    robot = declaration(before=BEFORE, after=AFTER)
    with unicycle() as there:
        with driver(robot, tmp_path) as platform:
            platform.load(scene(), 0)
            platform.halt("Enough.")
            with pytest.raises(BenchbotError):
                act(platform, robot, "move_distance", distance=1.0)
        assert there.state["called"] == BEGUN + ENDED
