"""What a guard decides, from one instant to the next."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.motion import MotionConfig
from benchbot_robot_ros2.guard.state import GuardState
from benchbot_robot_ros2.ramp import REST, Velocity

MOTION = MotionConfig(linear_acceleration_mps2=2.0, angular_acceleration_radps2=3.0)
TICK_S = 0.02
FULL = Velocity(1.0, 0.5)


def drive(state: GuardState, wanted: Velocity, start_s: float, duration_s: float) -> list[Velocity | None]:
    """Return what is published while a command is repeated at every tick."""
    published = []
    for tick in range(1, round(duration_s / TICK_S) + 1):
        now_s = start_s + tick * TICK_S
        state.command(wanted, now_s)
        published.append(state.step(now_s))
    return published


def watch(state: GuardState, start_s: float, duration_s: float) -> list[Velocity | None]:
    """Return what is published while nobody commands anything."""
    return [state.step(start_s + tick * TICK_S) for tick in range(1, round(duration_s / TICK_S) + 1)]


@pytest.fixture
def moving() -> GuardState:
    """A guard that was commanded until time 2, and drives as commanded."""
    state = GuardState(MOTION, 0.15)
    state.step(0.0)
    assert drive(state, FULL, 0.0, 2.0)[-1] == FULL
    return state


def test_nothing_is_published_before_the_first_command() -> None:
    assert watch(GuardState(MOTION, 0.15), 0.0, 1.0) == [None] * 50


def test_a_command_is_ramped_to() -> None:
    state = GuardState(MOTION, 0.15)
    state.step(0.0)
    published = drive(state, FULL, 0.0, 0.1)
    assert published == [pytest.approx((2.0 * TICK_S * tick, 3.0 * TICK_S * tick, 0.0)) for tick in range(1, 6)]


def test_a_pause_does_not_make_the_velocity_jump() -> None:
    state = GuardState(MOTION, 0.15)
    state.step(0.0)
    state.command(FULL, 10.0)
    assert state.step(10.0) == pytest.approx((0.2, 0.3, 0.0))


def test_a_zero_command_brakes_to_rest_needs_no_follower_and_frees_the_topic(moving: GuardState) -> None:
    moving.command(REST, 2.0)
    published = watch(moving, 2.0, 2.0)
    assert published[0] == pytest.approx((0.96, 0.44, 0.0))
    assert published.count(REST) == pytest.approx(0.5 / TICK_S, abs=2)
    assert published[-1] is None
    assert moving.trip is None


def test_silence_trips_and_stays(moving: GuardState) -> None:
    published = watch(moving, 2.0, 1.0)
    assert published[:7] == [FULL] * 7
    assert published[8:] == [REST] * 42
    assert moving.trip is not None
    assert "No velocity command came for 0.16 s" in moving.trip.why
    assert set(drive(moving, FULL, 3.0, 1.0)) == {REST}


def test_the_first_reason_stays(moving: GuardState) -> None:
    moving.stop("one")
    moving.stop("two")
    assert moving.trip is not None
    assert moving.trip.why == "one"
    assert moving.step(2.0) == REST


def test_the_emergency_stop_trips_at_rest_too_and_again_after_a_release() -> None:
    state = GuardState(MOTION, 0.15)
    state.e_stop(pressed=True)
    assert state.trip is not None
    state.release()
    assert state.trip is not None
    state.e_stop(pressed=False)
    assert state.trip is not None
    state.release()
    assert state.trip is None


def test_after_a_release_the_robot_starts_from_rest(moving: GuardState) -> None:
    moving.stop("for a moment")
    moving.release()
    assert not moving.moving
    assert moving.step(2.0 + TICK_S) != FULL
    assert drive(moving, FULL, 2.0 + TICK_S, TICK_S) == [pytest.approx((0.04, 0.06, 0.0))]


@pytest.mark.parametrize("wanted", [(math.nan, 0.0), (0.0, math.inf), (0.0, 0.0, math.nan)])
def test_what_is_no_velocity_trips(moving: GuardState, wanted: tuple[float, ...]) -> None:
    moving.command(Velocity(*wanted), 2.0)
    assert moving.trip is not None
    assert moving.step(2.0) == REST


def test_a_clock_that_jumps_back_trips_a_moving_robot_only(moving: GuardState) -> None:
    moving.step(1.0)
    assert moving.trip is not None
    assert "jumped back by 1.00 s" in moving.trip.why
    at_rest = GuardState(MOTION, 0.15)
    at_rest.step(2.0)
    at_rest.step(1.0)
    assert at_rest.trip is None


class TestDeadMan:
    @pytest.fixture
    def state(self) -> GuardState:
        state = GuardState(MOTION, 0.15, dead_man_timeout_s=0.3)
        state.step(0.0)
        return state

    def test_at_rest_nobody_needs_to_hold_it(self, state: GuardState) -> None:
        state.dead_man(held=False, now_s=0.0)
        watch(state, 0.0, 1.0)
        assert state.trip is None

    def test_moving_needs_it(self, state: GuardState) -> None:
        assert set(drive(state, FULL, 0.0, 0.1)) == {REST}
        assert state.trip is not None
        assert "dead-man" in state.trip.why

    def test_held_the_robot_moves_released_it_stops(self, state: GuardState) -> None:
        state.dead_man(held=True, now_s=0.0)
        assert drive(state, FULL, 0.0, 0.2)[-1] != REST
        state.dead_man(held=False, now_s=0.2)
        assert state.step(0.21) == REST

    def test_its_silence_stops_the_robot(self, state: GuardState) -> None:
        state.dead_man(held=True, now_s=0.0)
        published = drive(state, FULL, 0.0, 0.5)
        assert REST not in published[:14]
        assert published[-5:] == [REST] * 5


@given(
    st.lists(
        st.tuples(
            st.floats(0.001, 0.3),
            st.one_of(st.none(), st.builds(Velocity, st.floats(-9, 9), st.floats(-9, 9))),
            st.sampled_from(["", "", "", "stop"]),
        ),
        max_size=50,
    )
)
def test_whatever_happens_the_limits_are_kept_and_a_trip_is_for_good(
    events: list[tuple[float, Velocity | None, str]],
) -> None:
    state = GuardState(MOTION, 0.15)
    state.step(0.0)
    now_s, last = 0.0, REST
    for elapsed_s, wanted, event in events:
        now_s += elapsed_s
        if wanted is not None:
            state.command(wanted, now_s)
        if event == "stop":
            state.stop("asked to")
        tripped = state.trip is not None
        velocity = state.step(now_s)
        assert velocity == REST or not tripped
        if velocity is not None and state.trip is None:
            assert -0.6 <= velocity.linear_mps <= 1.5
            assert abs(velocity.angular_radps) <= 1.0
            assert abs(velocity.linear_mps - last.linear_mps) <= 2.0 * min(elapsed_s, 0.1) + 1e-9
        last = velocity or REST


def hold(state: GuardState, start_s: float, duration_s: float) -> list[Velocity | None]:
    """Return what is published while a person holds the take-over switch, and the driver commands on."""
    published = []
    for tick in range(1, round(duration_s / TICK_S) + 1):
        now_s = start_s + tick * TICK_S
        state.take_over(held=True, now_s=now_s)
        state.command(FULL, now_s)
        published.append(state.step(now_s))
    return published


def test_a_robot_that_is_taken_over_is_told_to_stop_and_then_left_to_the_person(moving: GuardState) -> None:
    published = hold(moving, 2.0, 1.0)
    zeros = published.count(REST)
    assert zeros == pytest.approx(0.1 / TICK_S, abs=1)
    assert published == [REST] * zeros + [None] * (50 - zeros)
    assert not moving.moving
    assert moving.trip is None


def test_it_is_left_to_them_until_the_driver_resumes(moving: GuardState) -> None:
    hold(moving, 2.0, 1.0)
    moving.resume()
    assert moving.yielded  # they hold it still
    moving.take_over(held=False, now_s=3.0)
    assert drive(moving, FULL, 3.0, 1.0) == [None] * 50
    moving.resume()
    assert drive(moving, FULL, 4.0, 1.0)[-1] == FULL


def test_a_take_over_switch_that_falls_silent_while_it_is_held_trips() -> None:
    state = GuardState(MOTION, 0.15, take_over_timeout_s=0.5)
    hold(state, 0.0, 1.0)
    assert watch(state, 1.0, 1.0)[-1] == REST
    assert state.trip is not None
    assert "fell silent for 0.52 s while it was held" in state.trip.why

    released = GuardState(MOTION, 0.15, take_over_timeout_s=0.5)
    released.take_over(held=False, now_s=0.0)
    assert drive(released, FULL, 5.0, 1.0)[-1] == FULL


def test_the_emergency_stop_counts_while_a_person_has_the_robot(moving: GuardState) -> None:
    hold(moving, 2.0, 1.0)
    moving.e_stop(pressed=True)
    assert moving.step(3.02) == REST


@given(st.lists(st.sampled_from(["command", "hold", "release", "resume", "step"]), max_size=60))
def test_no_velocity_is_published_from_a_take_over_until_the_driver_resumes_after_it(events: list[str]) -> None:
    state, now_s, theirs, held = GuardState(MOTION, 5.0), 0.0, False, False
    for event in events:
        now_s += TICK_S
        if event == "command":
            state.command(FULL, now_s)
        elif event in ("hold", "release"):
            held = event == "hold"
            theirs = theirs or held
            state.take_over(held=held, now_s=now_s)
        elif event == "resume":
            theirs = theirs and held
            state.resume()
        velocity = state.step(now_s)
        assert not theirs or velocity in (REST, None)
        assert state.yielded == theirs


def attend(state: GuardState, start_s: float, duration_s: float) -> list[Velocity | None]:
    """Return what is published while the robot's navigation drives it, and that is said at every tick."""
    published = []
    for tick in range(1, round(duration_s / TICK_S) + 1):
        now_s = start_s + tick * TICK_S
        state.attend(now_s)
        published.append(state.step(now_s))
    return published


def test_nothing_is_published_while_navigation_drives_and_silence_stops_it() -> None:
    state = GuardState(MOTION, 0.15)
    assert attend(state, 0.0, 1.0) == [None] * 50
    assert state.moving
    assert watch(state, 1.0, 0.2)[-1] == REST
    assert state.trip is not None
    assert "No velocity command came" in state.trip.why


def test_a_command_ends_the_navigation_and_at_rest_needs_no_follower() -> None:
    state = GuardState(MOTION, 0.15)
    attend(state, 0.0, 0.5)
    state.command(REST, 0.52)
    assert not state.moving
    assert watch(state, 0.52, 1.0) == [None] * 50
    assert state.trip is None


@pytest.mark.parametrize("device", ["e-stop", "dead-man"])
def test_devices_stop_a_robot_that_navigation_drives(device: str) -> None:
    state = GuardState(MOTION, 0.15, dead_man_timeout_s=0.3)
    state.dead_man(held=True, now_s=0.9)
    assert attend(state, 0.9, 0.2)[-1] is None
    if device == "e-stop":
        state.e_stop(pressed=True)
    assert attend(state, 1.1, 0.4)[-1] == REST
    assert not state.moving
