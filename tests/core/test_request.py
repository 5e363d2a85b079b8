from dataclasses import replace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.request import Limits, RunRequest, canonical

REQUEST = RunRequest("sample:passive", "sample_robot", "arena:1", seed=3)

SETTINGS = st.dictionaries(st.text(), st.none() | st.booleans() | st.integers() | st.text(), max_size=4)
REQUESTS = st.builds(
    RunRequest,
    st.text(),
    st.text(),
    st.text(),
    st.integers(0, 2**63 - 1),
    st.none() | st.integers(0, 99),
    SETTINGS,
    st.builds(Limits, st.none() | st.integers(1, 9), st.none() | st.floats(0, 9), st.none() | st.floats(0, 9)),
)


@given(REQUESTS, REQUESTS)
def test_requests_have_the_same_bytes_when_they_are_equal_and_only_then(one: RunRequest, other: RunRequest) -> None:
    assert one.canonical() == replace(one).canonical()
    assert (one.canonical() == other.canonical()) == (one.determining() == other.determining())


@given(st.dictionaries(st.text(), st.integers(), min_size=2))
def test_the_order_of_settings_does_not_matter(settings: dict[str, Any]) -> None:
    turned = dict(reversed(settings.items()))
    assert replace(REQUEST, settings=settings).canonical() == replace(REQUEST, settings=turned).canonical()


def test_how_a_run_is_scored_and_recorded_does_not_change_what_it_is() -> None:
    scored = replace(REQUEST, method="omq", record={"frames": "/tmp/frames"})
    assert scored.canonical() == REQUEST.canonical()
    assert scored != REQUEST


def test_the_bytes_stay_as_they_are_from_version_to_version() -> None:
    changed = replace(REQUEST, settings={"lighting.time": "21:30"}, limits=Limits(steps=5))
    assert changed.canonical() == (
        b'{"environment":"arena:1","episode":null,'
        b'"limits":{"simulated_time_s":null,"steps":5,"wall_time_s":null},"robot":"sample_robot","seed":3,'
        b'"settings":{"lighting.time":"21:30"},"task":"sample:passive"}'
    )


def test_a_limit_of_restarts_changes_the_bytes_only_where_it_is_set() -> None:
    assert b"restarts" not in REQUEST.canonical()
    assert b'"limits":{"restarts":0,' in replace(REQUEST, limits=Limits(restarts=0)).canonical()


def test_a_secret_changes_the_bytes_and_is_not_shown() -> None:
    hidden = replace(REQUEST, secret=16 * "0f")
    assert b"secret" not in REQUEST.canonical()
    assert b'"secret":"0f0f' in hidden.canonical()
    assert "0f0f" not in repr(hidden)


def test_a_request_can_be_a_key() -> None:
    assert {REQUEST: 1}[replace(REQUEST)] == 1


def test_canonical_json_has_no_spaces_and_keeps_signs() -> None:
    assert canonical({"b": "ü", "a": [1, 2]}) == '{"a":[1,2],"b":"ü"}'.encode()


def test_a_device_changes_the_bytes_where_it_is_asked_for() -> None:
    assert b"device" not in REQUEST.canonical()
    assert b'"device":"cuda"' in replace(REQUEST, device="cuda").canonical()
