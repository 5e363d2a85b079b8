import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.host import Host, InProcessHost
from benchbot.core.motion import MotionConfig, Outcome
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.selection import Selection
from benchbot.supervisor.platform.host import ChildHost, Operator, Timeouts
from tests.supervisor.harness import alive, children_of, eventually, sample_selection

StartHost = Callable[..., ChildHost]


@pytest.fixture
def start_host(tmp_path: Path) -> Iterator[StartHost]:
    hosts: list[ChildHost] = []

    def start(
        selection: Selection | None = None, timeouts: Timeouts | None = None, operator: Operator | None = None
    ) -> ChildHost:
        log = tmp_path / "platform.log"
        hosts.append(ChildHost(selection or sample_selection(), log, timeouts=timeouts, operator=operator))
        return hosts[-1]

    yield start
    for host in hosts:
        host.close()


def in_process(selection: Selection, cache_dir: Path) -> InProcessHost:
    create = load().record("simulators", "sim_sample").create
    platform = create(PlatformSpec(selection.robot.data, selection.localisation, cache_dir))
    scenes = [Scene(scene.data, scene.path.parent) for scene in selection.environments]
    return InProcessHost(platform, scenes, MotionConfig.from_robot(selection.robot.data, selection.localisation))


def drive(host: Host, selection: Selection) -> list[object]:
    """Load, drive a little and look: everything that a host says."""
    said: list[object] = [host.load(0, 7)]
    said.append(host.act("move_distance", {"distance": 0.5}, None))
    said.append(host.act("move_next", {}, Pose.planar(-1.0, 0.2, 0.3)))
    said.append(host.observe(selection.observations))
    return said


def test_a_child_says_what_the_platform_says_in_this_process(start_host: StartHost, tmp_path: Path) -> None:
    selection = sample_selection()
    far, near = start_host(selection), in_process(selection, tmp_path)
    for there, here in zip(drive(far, selection), drive(near, selection), strict=True):
        np.testing.assert_equal(there, here)


def test_arrays_keep_their_type_and_shape(start_host: StartHost) -> None:
    host = start_host()
    host.load(0, 0)
    seen = host.observe(["image_rgb", "image_depth", "image_segment", "laser"])
    assert seen["image_rgb"].dtype == np.uint8
    assert seen["image_rgb"].shape == (32, 48, 3)
    assert seen["image_depth"].dtype == np.float32
    assert seen["image_segment"]["instance_segment_img"].dtype == np.uint16
    assert seen["laser"]["scans"].dtype == np.float64


def test_close_ends_the_child(start_host: StartHost) -> None:
    host = start_host()
    host.close()
    host.close()
    assert not alive(host.pid)


def test_a_child_that_dies_is_told_with_its_last_words(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:crash"))
    host.load(0, 0)
    for _ in range(2):
        host.observe(["laser"])
    with pytest.raises(BenchbotError, match="The simulator died") as caught:
        host.observe(["laser"])
    assert caught.value.failure is FailureClass.PLATFORM
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert "SIGABRT" in caught.value.why
    assert "simulator.py" in caught.value.why
    assert "platform.log" in caught.value.fix


def test_a_child_that_is_killed_is_told(start_host: StartHost) -> None:
    host = start_host()
    host.load(0, 0)
    os.kill(host.pid, signal.SIGKILL)
    with pytest.raises(BenchbotError, match="The simulator died") as caught:
        host.act("move_distance", {"distance": 1.0}, None)
    assert "SIGKILL" in caught.value.why


def test_a_child_that_hangs_is_ended(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:hang"), Timeouts(call_s=2.0))
    host.load(0, 0)
    for _ in range(2):
        host.observe(["laser"])
    with pytest.raises(BenchbotError, match="hangs") as caught:
        host.observe(["laser"])
    assert caught.value.failure is FailureClass.PLATFORM
    assert "2 s" in caught.value.why
    assert not alive(host.pid)


def test_an_error_of_the_platform_arrives_as_it_was(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:load"))
    with pytest.raises(BenchbotError, match="The sample world does not load") as caught:
        host.load(0, 0)
    assert caught.value.failure is FailureClass.PLATFORM
    assert caught.value.fix == "Choose another environment."


def test_a_mistake_in_the_platform_is_told_in_words(start_host: StartHost, tmp_path: Path) -> None:
    host = start_host()
    host.load(0, 0)
    with pytest.raises(BenchbotError, match="The simulator failed") as caught:
        host.observe(["no such channel"])
    assert "KeyError: 'no such channel'" in caught.value.why
    assert caught.value.failure is FailureClass.PLATFORM
    assert "Traceback" in (tmp_path / "platform.log").read_text("utf-8")


def test_closing_from_another_thread_ends_a_call_under_way(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:hang"))
    host.load(0, 0)
    for _ in range(2):
        host.observe(["laser"])
    with ThreadPoolExecutor() as executor:
        looking = executor.submit(host.observe, ["laser"])
        assert eventually(looking.running)
        host.close()
        error = looking.exception()
    assert isinstance(error, BenchbotError)
    assert error.failure is FailureClass.PLATFORM
    assert not alive(host.pid)


def test_a_robot_is_halted_in_the_middle_of_an_action(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:halts"))
    host.load(0, 0)
    with ThreadPoolExecutor() as executor:
        turning = executor.submit(host.act, "move_angle", {"angle": 36000.0}, None)
        assert eventually(turning.running)
        host.halt("Somebody stepped in.")
        error = turning.exception()
    assert isinstance(error, BenchbotError)
    assert (error.why, error.failure, error.ends_run) == ("Somebody stepped in.", FailureClass.PLATFORM, True)
    with pytest.raises(BenchbotError, match="stopped for safety"):
        host.act("move_distance", {"distance": 0.1}, None)
    assert host.observe(["laser"])


def test_a_halt_that_comes_before_the_platform_is_not_lost(start_host: StartHost) -> None:
    host = start_host(sample_selection(environment="faulty:halts"))
    host.halt("Not today.")
    host.load(0, 0)
    with pytest.raises(BenchbotError, match="stopped for safety") as caught:
        host.act("move_distance", {"distance": 0.1}, None)
    assert caught.value.why == "Not today."


def test_halting_changes_nothing_for_a_simulator_or_a_child_that_is_gone(start_host: StartHost) -> None:
    host = start_host()
    host.load(0, 0)
    host.halt("Nobody is in danger.")
    assert host.act("move_distance", {"distance": 0.1}, None)[0] is Outcome.REACHED
    os.kill(host.pid, signal.SIGKILL)
    assert eventually(lambda: not alive(host.pid))
    host.halt("It is dead already.")
    host.close()
    host.halt("It is closed.")


def test_the_operator_may_take_longer_than_a_platform(start_host: StartHost) -> None:
    asked: list[str | None] = []
    operator = Operator(asked.append)
    timeouts = Timeouts(load_s=4.0)
    host = start_host(sample_selection(environment="faulty:asks"), timeouts, operator)
    with ThreadPoolExecutor() as executor:
        loading = executor.submit(host.load, 0, 0)
        assert eventually(lambda: bool(asked))
        too_late_s = time.monotonic() + timeouts.load_s
        assert eventually(lambda: time.monotonic() > too_late_s)
        assert operator.confirm() == "Carry the robot to its start."
        assert loading.result().clock_s == 0.0
    assert asked == ["Carry the robot to its start.", None]
    assert operator.confirm() is None


def test_a_platform_that_says_what_it_waits_for_may_wait_longer_than_one_that_hangs(start_host: StartHost) -> None:
    asked: list[str | None] = []
    timeouts = Timeouts(load_s=4.0)
    host = start_host(taken_over(timeouts.load_s + 1.0), timeouts, Operator(asked.append))
    assert host.load(0, 0).clock_s == 0.0
    assert asked == ["A person has the robot.", None]
    # Without anybody who reads it, it is the same.
    assert start_host(taken_over(timeouts.load_s + 1.0), timeouts).load(0, 0).clock_s == 0.0


def test_a_simulator_is_created_before_it_is_needed_also_for_the_run_after(start_host: StartHost) -> None:
    ahead, plain = start_host(), start_host()
    ahead.prepare()
    ahead.prepare()
    ahead.renew(sample_selection(), None)
    assert ahead.load(0, 0) == plain.load(0, 0)


def test_a_simulator_that_dies_while_it_is_created_ahead_is_told_by_the_first_load(start_host: StartHost) -> None:
    host = start_host()
    os.kill(host.pid, signal.SIGKILL)
    host.prepare()
    with pytest.raises(BenchbotError, match="died") as caught:
        host.load(0, 0)
    assert caught.value.failure is FailureClass.PLATFORM


def test_what_a_platform_does_where_that_takes_long_is_told_and_logged(start_host: StartHost, tmp_path: Path) -> None:
    noted: list[str | None] = []
    host = start_host(operator=Operator(lambda request: None, noted.append))
    host.load(0, 0)
    assert [text for text in noted if text is not None] == ["the simulator reads its world"]
    assert noted[-1] is None, "it is over with the answer"
    (log,) = tmp_path.rglob("*.log")
    assert "the simulator reads its world" in log.read_text("utf-8")


def taken_over(seconds: float) -> Selection:
    """Return a selection whose simulator is taken over by a person for some seconds."""
    selection = sample_selection()
    scenes = [
        replace(scene, data=scene.data | {"options": {"taken_over_s": seconds}}) for scene in selection.environments
    ]
    return replace(selection, environments=tuple(scenes))


@pytest.mark.parametrize("end", ["close", "halt", "kill"])
def test_a_question_ends_with_what_asked_it(end: str, start_host: StartHost) -> None:
    asked: list[str | None] = []
    operator = Operator(asked.append)
    host = start_host(sample_selection(environment="faulty:asks"), operator=operator)
    with ThreadPoolExecutor() as executor:
        loading = executor.submit(host.load, 0, 0)
        assert eventually(lambda: bool(asked))
        if end == "close":
            host.close()
        elif end == "halt":
            host.halt("The solution hung up.")
        else:
            os.kill(host.pid, signal.SIGKILL)
        error = loading.exception()
    assert isinstance(error, BenchbotError)
    assert error.failure is FailureClass.PLATFORM
    assert error.ends_run == (end == "halt")
    assert asked[-1] is None
    assert operator.confirm() is None


def test_a_platform_without_an_operator_is_told_so(start_host: StartHost) -> None:
    with pytest.raises(BenchbotError, match="nobody to carry the robot"):
        start_host(sample_selection(environment="faulty:asks")).load(0, 0)


def test_a_real_robot_whose_driver_dies_or_fails_is_not_moved_again(start_host: StartHost) -> None:
    host = start_host(sample_selection(robot="sample_real_robot"))
    host.load(0, 0)
    with pytest.raises(BenchbotError, match="The robot's driver failed") as failed:
        host.observe(["no such channel"])
    os.kill(host.pid, signal.SIGKILL)
    with pytest.raises(BenchbotError, match="The robot's driver died") as died:
        host.observe(["laser"])
    for error in (failed.value, died.value):
        assert error.ends_run
        assert error.failure is FailureClass.PLATFORM
        assert "reset()" not in error.fix


def test_a_driver_that_is_frozen_while_its_robot_moves_is_ended(start_host: StartHost) -> None:
    host = start_host(sample_selection("sample:active", "faulty:halts", "sample_real_robot"))
    host.load(0, 0)
    with ThreadPoolExecutor() as executor:
        turning = executor.submit(host.act, "move_angle", {"angle": 36000.0}, None)
        assert not turning.done()
        os.kill(host.pid, signal.SIGSTOP)
        error = turning.exception()
    assert isinstance(error, BenchbotError)
    assert error.failure is FailureClass.PLATFORM
    assert error.ends_run
    assert error.why.startswith("Its process was frozen (SIGSTOP, or Ctrl-Z) while the robot moved.")


def test_a_simulator_that_is_frozen_goes_on_where_it_was(start_host: StartHost) -> None:
    host = start_host(sample_selection("sample:active"))
    host.load(0, 0)
    os.kill(host.pid, signal.SIGSTOP)
    with ThreadPoolExecutor() as executor:
        moving = executor.submit(host.act, "move_distance", {"distance": 0.5}, None)
        time.sleep(0.3)
        assert not moving.done()
        os.kill(host.pid, signal.SIGCONT)
        assert moving.result()[0] is Outcome.REACHED


def test_the_solutions_folder_cannot_replace_modules_of_the_child(
    start_host: StartHost, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "yaml.py").write_text("raise SystemExit('wrong module')")
    monkeypatch.chdir(tmp_path)
    assert start_host().load(0, 0).clock_s == 0.0


STUBBORN = """
import ctypes
from benchbot.plugin import Simulator, hookimpl

def create(spec):
    print("busy", flush=True)
    ctypes.PyDLL(None).sleep(600)  # holds Python's lock, as a simulator that compiles does

@hookimpl
def benchbot_simulators():
    yield Simulator("sim_stubborn", create)
"""


@pytest.fixture
def stubborn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Selection:
    """A selection whose simulator never comes up, and does not let go of Python's lock meanwhile."""
    metadata = tmp_path / "stubborn-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: stubborn\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[benchbot]\nstubborn = stubborn\n")
    (tmp_path / "stubborn.py").write_text(STUBBORN)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]]))
    selection = sample_selection()
    return replace(selection, robot=replace(selection.robot, data={**selection.robot.data, "type": "sim_stubborn"}))


def is_busy(log: Path) -> bool:
    return log.exists() and "busy" in log.read_text("utf-8")


SUPERVISOR = """
import sys
from dataclasses import replace
from pathlib import Path
from benchbot.supervisor.platform.host import ChildHost
from tests.supervisor.harness import sample_selection

selection = sample_selection()
robot = replace(selection.robot, data={**selection.robot.data, "type": "sim_stubborn"})
ChildHost(replace(selection, robot=robot), Path(sys.argv[1])).load(0, 0)
"""


@pytest.mark.usefixtures("stubborn")
def test_a_child_that_holds_pythons_lock_ends_with_the_supervisor_too(tmp_path: Path) -> None:
    log = tmp_path / "platform.log"
    supervisor = subprocess.Popen([sys.executable, "-c", SUPERVISOR, str(log)])
    assert eventually(lambda: is_busy(log))
    (child,) = children_of(supervisor.pid)
    supervisor.kill()
    supervisor.wait()
    assert eventually(lambda: not alive(child))


def test_a_child_that_does_not_come_up_can_be_ended(stubborn: Selection, start_host: StartHost, tmp_path: Path) -> None:
    host = start_host(stubborn)
    with ThreadPoolExecutor() as executor:
        loading = executor.submit(host.load, 0, 0)
        assert eventually(lambda: is_busy(tmp_path / "platform.log"))
        host.close()
        error = loading.exception()
    assert isinstance(error, BenchbotError)
    assert not alive(host.pid)


def test_motion_ends_in_the_child_as_it_does_here(start_host: StartHost) -> None:
    host = start_host()
    host.load(0, 0)
    outcome, status = host.act("move_distance", {"distance": 50.0}, None)
    assert outcome is Outcome.COLLIDED
    assert status.collided
