"""The log of actions: one row for each observation, whoever claims otherwise."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.digest import MARK_DIGITS, MAX_OBSERVATIONS, ActionLog, BackgroundDigest, ObservationDigest
from tests.core.test_track import chosen, started

Taken = tuple[str | None, dict[str, int]]
LOOK: st.SearchStrategy[Taken] = st.tuples(st.none(), st.just({}))
TURN: st.SearchStrategy[Taken] = st.tuples(
    st.just("move_angle"), st.fixed_dictionaries({"angle": st.integers(-90, 90)})
)


@given(st.lists(st.lists(LOOK | TURN, min_size=1), min_size=1, max_size=3))
def test_every_observation_has_a_row_with_its_mark(scenes: list[list[Taken]]) -> None:
    log = ActionLog()
    for number, rows in enumerate(scenes):
        log.entered(f"arena:{number}")
        for action, arguments in rows:
            log.observed(action, arguments)
    count = sum(map(len, scenes))

    told = log.as_list([str(number) for number in range(count)])

    assert told is not None
    assert [scene["scene"] for scene in told] == [f"arena:{number}" for number in range(len(scenes))]
    assert [row[0] for scene in told for row in scene["rows"]] == [str(number) for number in range(count)]
    assert [(row[1:] or [None, {}]) for scene in told for row in scene["rows"]] == [
        [action, arguments] for rows in scenes for action, arguments in rows
    ]
    assert log.as_list(["one mark"] * (count + 1)) is None


def test_a_run_that_is_too_long_has_no_log() -> None:
    log, digest = ActionLog(), ObservationDigest()
    log.entered("arena:1")
    for number in range(MAX_OBSERVATIONS):
        log.observed("move_next", {})
        digest.update({"number": number})
    told = log.as_list(digest.marks())
    assert told is not None
    assert len(told[0]["rows"]) == MAX_OBSERVATIONS

    log.observed("move_next", {})
    digest.update({})

    assert len(digest.marks()) == MAX_OBSERVATIONS
    assert log.as_list(digest.marks()) is None


def test_what_a_solution_claims_to_have_done_is_replaced(tmp_path: Path) -> None:
    session = started(chosen(), tmp_path)
    session.step("move_angle", {"angle": 30})
    claim = {**results.empty_result(session.selection), "actions": [{"scene": "moon:1", "rows": []}]}

    for document in (results.finish(claim, session), results.failed(session)):
        (scene,) = document["actions"]
        assert scene["scene"] == "arena:1"
        assert [row[1:] for row in scene["rows"]] == [[], ["move_angle", {"angle": 30}]]
        assert scene["rows"][-1][0] == document["provenance"]["observation_digest"][:MARK_DIGITS]
        schema.check(document, "result", Path("result.json"))

    session.reset()
    assert [row[1:] for row in results.failed(session)["actions"][0]["rows"]] == [[]]


def test_the_background_makes_the_same_marks() -> None:
    plain = ObservationDigest()
    with ThreadPoolExecutor(1) as executor:
        background = BackgroundDigest(executor)
        for value in range(3):
            plain.update({"value": value})
            background.update({"value": value})
        assert background.marks() == plain.marks()
    assert len(set(plain.marks())) == 3
