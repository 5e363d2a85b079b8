import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.channels import Observations
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.host import Status
from benchbot.core.motion import Outcome
from benchbot.core.progress import ActionResult, State
from benchbot.core.request import Limits
from benchbot.core.selection import Selection
from benchbot.core.session import Session


@dataclass
class RailHost:
    """A robot on a rail along x, with a wall at x = 5, a battery that may die and somebody who may halt it."""

    dies_at_step: int | None = None
    halted: str | None = None
    x: float = 0.0
    clock_s: float = 0.0
    steps: int = 0
    loads: list[tuple[int, int]] = field(default_factory=list)
    closed: bool = False
    taken_over_s: tuple[float, ...] = ()

    def prepare(self) -> None:
        pass

    def load(self, scene_index: int, seed: int) -> Status:
        self.loads.append((scene_index, seed))
        self.x = self.clock_s = 0.0
        return self.status()

    def act(self, action: str, arguments: Mapping[str, Any], goal: Pose | None) -> tuple[Outcome, Status]:
        self.steps += 1
        if self.steps == self.dies_at_step:
            raise BenchbotError("The simulator died.", "Battery.", "Reset.", failure=FailureClass.PLATFORM)
        if self.halted is not None:
            raise BenchbotError(
                "The wagon was stopped.", self.halted, "Look.", failure=FailureClass.PLATFORM, ends_run=True
            )
        self.clock_s += 1.0
        self.x = goal.translation_xyz[0] if goal else self.x + arguments.get("distance", 0.0)
        return (Outcome.COLLIDED if self.x >= 5 else Outcome.REACHED), self.status()

    def observe(self, channels: Iterable[str]) -> Observations:
        return {"goal": np.array([self.x])}

    def status(self) -> Status:
        told, self.taken_over_s = self.taken_over_s, ()
        return Status(Pose.planar(self.x, 0, 0), self.clock_s, self.x >= 5, taken_over_s=told)

    def halt(self, why: str) -> None:
        self.halted = why

    def close(self) -> None:
        self.closed = True


def declaration(kind: str, name: str, **data: Any) -> Declaration:
    return Declaration(kind, name, Path("rail.yaml"), "acme", {"name": name, **data})


def selection(*actions: str, scenes: int = 1, limits: Limits | None = None) -> Selection:
    def scene(number: int) -> Declaration:
        trajectory = [[1, 0, 0, 0, x, 0, 0] for x in (1, 2)]
        start = [1, 0, 0, 0, 0, 0, 0]
        name = f"rail:{number}"
        return declaration("environments", name, variant=number, start_pose=start, trajectory_poses=trajectory)

    return Selection(
        declaration("tasks", "ride", actions=list(actions), observations=["goal"]),
        declaration("robots", "wagon"),
        tuple(scene(number) for number in range(1, scenes + 1)),
        None,
        seed=10,
        limits=limits or Limits(),
    )


def session(*actions: str, host: RailHost | None = None, **kwargs: Any) -> Session:
    return Session(selection(*actions, **kwargs), lambda: host or RailHost())


def test_a_passive_episode_runs_along_the_trajectory_and_finishes() -> None:
    ride = session("move_next")
    first = ride.reset()
    assert (first.state, first.result, first.actions) == (State.CLEAN, ActionResult.SUCCESS, ("move_next",))
    assert ride.step("move_next").state is State.DIRTY
    last = ride.step("move_next")
    assert (last.state, last.result, last.actions) == (State.FINISHED, ActionResult.FINISHED, ())
    assert last.observations["goal"] == 2
    assert ride.progress.simulated_time_s == 2
    with pytest.raises(BenchbotError, match="'move_next' is unavailable due to: FINISHED"):
        ride.step("move_next")


def test_a_collision_ends_the_episode_until_reset() -> None:
    ride = session("move_distance", scenes=2)
    ride.reset()
    crashed = ride.step("move_distance", {"distance": 9})
    assert (crashed.state, crashed.result, crashed.actions) == (State.COLLIDED, ActionResult.COLLISION, ())
    assert ride.progress.failure is FailureClass.COLLISION
    with pytest.raises(BenchbotError, match="out of reach after a collision"):
        ride.next_scene()
    assert ride.reset().state is State.CLEAN
    assert ride.progress.failure is None


def test_scenes_advance_and_reset_returns_to_the_first() -> None:
    host = RailHost()
    ride = session("move_next", host=host, scenes=2)
    ride.reset()
    ride.step("move_next")
    second = ride.next_scene()
    assert second is not None
    assert (second.scene_number, second.state) == (1, State.CLEAN)
    ride.step("move_next")
    assert ride.progress.simulated_time_s == 2
    assert ride.next_scene() is None
    assert ride.reset().scene_number == 0
    assert host.loads == [(0, 10), (1, 11), (0, 10)]


def test_observing_alone_takes_no_step() -> None:
    ride = session("move_distance")
    ride.reset()
    assert ride.step(None).state is State.CLEAN
    assert (ride.progress.steps, ride.progress.frames) == (0, 2)


def test_a_robot_that_is_moved_by_other_means_takes_a_step() -> None:
    host = RailHost()
    ride = session("move_distance", host=host)
    ride.reset()

    def push(distance: float) -> Status:
        return host.act("move_distance", {"distance": distance}, None)[1]

    moved = ride.move_by("push", {"distance": 1.0}, lambda: push(1.0))
    assert moved.observations["goal"] == 1.0
    assert (moved.state, ride.progress.steps) == (State.DIRTY, 1)
    assert ride.move_by("push", {}, lambda: push(9.0)).result is ActionResult.COLLISION
    with pytest.raises(BenchbotError, match="cannot move any more"):
        ride.move_by("push", {}, lambda: push(1.0))


@pytest.mark.parametrize(
    ("action", "arguments", "title"),
    [
        ("move_distanse", {}, "is not an action of the task"),
        ("move_next", {}, "is not an action of the task"),
        ("move_distance", {"dist": 1}, "has no argument 'dist'"),
        ("move_distance", {"distance": math.nan}, "is nan"),
        ("move_distance", {"distance": math.inf}, "is inf"),
        ("move_distance", {"distance": True}, "is True"),
        ("move_distance", {"distance": "far"}, "is 'far'"),
    ],
)
def test_a_wrong_action_is_the_agents_error_and_moves_nothing(
    action: str, arguments: dict[str, Any], title: str
) -> None:
    ride = session("move_distance", "move_angle")
    ride.reset()
    with pytest.raises(BenchbotError, match=title) as caught:
        ride.step(action, arguments)
    assert caught.value.failure is FailureClass.AGENT
    assert ride.step(None).state is State.CLEAN


@pytest.mark.parametrize(
    ("action", "argument", "call"),
    [
        ("move_distance", "distance", "move_distance with {'distance': 1.0}"),
        ("move_angle", "angle", "move_angle with {'angle': 1.0}"),
        ("move_next", "none", "move_next with no argument"),
    ],
)
def test_a_wrong_argument_is_answered_with_the_right_one(action: str, argument: str, call: str) -> None:
    ride = session(action)
    ride.reset()
    with pytest.raises(BenchbotError, match=f"'{action}' has no argument 'speed'") as caught:
        ride.step(action, {"speed": 2.0})
    assert caught.value.why == f"Its argument: {argument}."
    assert caught.value.fix == f"Call it like this: {call}"


@pytest.mark.parametrize(
    ("limits", "unit"), [(Limits(steps=2), "2 steps"), (Limits(simulated_time_s=1.5), "1.5 seconds of simulated time")]
)
def test_a_limit_ends_the_episode_as_a_timeout(limits: Limits, unit: str) -> None:
    ride = session("move_distance", limits=limits)
    ride.reset()
    for _ in range(2):
        ride.step("move_distance", {"distance": 0.1})
    with pytest.raises(BenchbotError, match="reached its limit") as caught:
        ride.step("move_distance", {"distance": 0.1})
    assert unit in caught.value.why
    assert (ride.progress.failure, ride.progress.state) == (FailureClass.TIMEOUT, State.FAILED)


def test_a_dead_platform_fails_the_episode_and_reset_starts_another() -> None:
    hosts = [RailHost(dies_at_step=2), RailHost()]
    ride = Session(selection("move_distance"), lambda: hosts.pop(0))
    dying = hosts[0]
    ride.reset()
    ride.step("move_distance", {"distance": 1})
    with pytest.raises(BenchbotError, match="The simulator died"):
        ride.step("move_distance", {"distance": 1})
    assert dying.closed
    assert (ride.progress.failure, ride.progress.state) == (FailureClass.PLATFORM, State.FAILED)
    with pytest.raises(BenchbotError, match="not running") as caught:
        ride.step(None)
    assert (caught.value.why, caught.value.failure) == ("The simulator died. Battery.", FailureClass.PLATFORM)
    assert ride.reset().state is State.CLEAN


@pytest.mark.parametrize("failure", [None, *(kind for kind in FailureClass if kind is not FailureClass.PLATFORM)])
def test_an_error_of_the_host_that_is_not_its_death_leaves_it_running(failure: FailureClass | None) -> None:
    host = RailHost()
    ride = session("move_distance", host=host)
    ride.reset()

    def slip() -> Status:
        raise BenchbotError("The wheels slip.", "Leaves.", "Sweep.", failure=failure)

    with pytest.raises(BenchbotError, match="The wheels slip"):
        ride.move_by("push", {}, slip)

    assert not host.closed
    assert ride.step("move_distance", {"distance": 1}).state is State.DIRTY


def test_there_is_no_way_back_from_a_safety_stop() -> None:
    hosts = [RailHost(), RailHost()]
    ride = Session(selection("move_distance"), lambda: hosts.pop(0))
    ride.reset()
    ride.halt("Somebody is on the rail.")
    with pytest.raises(BenchbotError, match="The wagon was stopped") as stopped:
        ride.step("move_distance", {"distance": 1})
    assert stopped.value.ends_run
    assert (ride.progress.failure, ride.progress.state) == (FailureClass.PLATFORM, State.FAILED)
    assert ride.progress.ends_run
    with pytest.raises(BenchbotError, match="The wagon was stopped") as again:
        ride.reset()
    assert again.value.ends_run
    assert "Somebody is on the rail." in (ride.progress.failure_why or "")
    assert len(hosts) == 1


def test_a_robot_that_is_halted_while_it_starts_is_halted_when_it_is_there() -> None:
    ride = session("move_distance")
    ride.halt("Nobody is there yet.")
    ride.reset()
    with pytest.raises(BenchbotError, match="The wagon was stopped"):
        ride.step("move_distance", {"distance": 1})


@pytest.mark.parametrize("action", [None, "move_next"])
@pytest.mark.parametrize("prepared", [False, True])
def test_nothing_runs_before_the_first_reset(action: str | None, prepared: bool) -> None:
    ride = session("move_next")
    if prepared:
        ride.prepare()
    with pytest.raises(BenchbotError, match="not running") as caught:
        ride.step(action)
    assert caught.value.why == "It has not been started yet."


def test_steps_by_hand_are_counted_until_a_result_is_handed_in() -> None:
    ride = session("move_distance")
    ride.reset()
    ride.step("move_distance", {"distance": 1})
    assert ride.driven_by_hand == 0
    ride.step("move_distance", {"distance": 1}, by_hand=True)
    ride.step(None)
    ride.reset()
    assert ride.driven_by_hand == 1
    ride.handed_in = True
    ride.reset()
    assert (ride.driven_by_hand, ride.handed_in) == (0, False)


def test_the_same_episode_has_the_same_digest_and_another_has_another() -> None:
    def digest(distance: float) -> str:
        ride = session("move_distance")
        ride.reset()
        ride.step("move_distance", {"distance": distance})
        return ride.digest.hexdigest()

    assert digest(1.0) == digest(1.0)
    assert digest(1.0) != digest(1.1)


def test_the_first_failure_stays() -> None:
    ride = session("move_distance")
    ride.reset()
    ride.fail(FailureClass.AGENT, "It crashed.")
    ride.fail(FailureClass.INFRASTRUCTURE, "Later.")
    assert (ride.progress.failure, ride.progress.failure_why) == (FailureClass.AGENT, "It crashed.")


def test_scenes_without_a_trajectory_cannot_be_toured() -> None:
    task = selection("move_next")
    scene = task.environments[0]
    bare = replace(scene, data={**scene.data, "trajectory_poses": []})
    ride = Session(replace(task, environments=(bare,)), RailHost)
    ride.reset()
    with pytest.raises(BenchbotError, match="no trajectory"):
        ride.step("move_next")


def test_what_a_person_had_the_robot_for_is_counted_over_scenes_and_attempts_until_a_result_is_handed_in() -> None:
    host = RailHost(taken_over_s=(3.0,))
    ride = session("move_distance", host=host, scenes=2)
    ride.reset()
    host.taken_over_s = (1.5, 0.5)
    ride.step("move_distance", {"distance": 1})
    ride.next_scene()
    assert ride.taken_over_s == [3.0, 1.5, 0.5]
    ride.reset()
    assert ride.taken_over_s == [3.0, 1.5, 0.5]
    ride.handed_in = True
    ride.reset()
    assert ride.taken_over_s == []
