"""What was before: the steps of a leaderboard, the leaderboard of a past day, the states of a submission."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.testclient import TestClient

from benchbot.core import plugin_manager
from benchbot.plugins.challenge import history, organiser, people, queue, signing, submissions
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import Challenge, Phase
from benchbot.plugins.challenge.history import Step
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import Site
from tests.plugins.challenge.conftest import Clock, join, received, scores_document
from tests.plugins.challenge.test_uploads import statements

DAY_S = 86_400.0
HOSTILE = "<script>alert(1)</script>"


@pytest.fixture
def site(tmp_path: Path, challenge: Challenge, clock: Clock) -> Iterator[Site]:
    """A site whose clock a test sets."""
    database = Database(f"sqlite:///{tmp_path / 'one.db'}", clock)
    evaluators = {"omq": plugin_manager.load().record("evaluators", "omq")}
    yield Site(challenge, database, signing.load(challenge.folder / "challenge.key"), evaluators, "operator")
    database.engine.dispose()


def score(site: Site, team: Any, value: float, phase: Phase | None = None) -> str:
    """Hand in a submission of a team, and score it."""
    made = received()
    submissions.accept(site.database, phase or site.challenge.phases["development"], team, made)
    claim = queue.claim(site.database, "worker secret-host:1")
    assert claim is not None
    assert queue.finish(site.database, claim, value, scores_document({"miniroom:1": value}), {})
    return str(made["id"])


def test_the_past_has_what_counted_and_nothing_else(site: Site, clock: Clock) -> None:
    ada, bob = (join(site.database, site.challenge, name) for name in ("Ada", "Bob"))
    start_s = clock.now_s
    for team, value in ((ada, 0.4), (bob, 0.6), (ada, 0.3), (ada, 0.8), (bob, 0.7)):
        score(site, team, value)
        clock.now_s += DAY_S
    made = site.history("development")
    assert [(step.team, step.score, step.rank, (step.at - start_s) / DAY_S) for step in made] == [
        ("Ada", 0.4, 1, 0),
        ("Bob", 0.6, 1, 1),
        ("Ada", 0.8, 1, 3),
        ("Bob", 0.7, 2, 4),
    ]
    then = history.standing_at(made, start_s + 2 * DAY_S, lower_is_better=False)
    assert [(step.rank, step.team, step.score) for step in then] == [(1, "Bob", 0.6), (2, "Ada", 0.4)]
    last = replace(site.challenge.phases["development"], counts="last")
    of_last = history.steps(site.database, last, site.evaluators["omq"])
    assert [step.score for step in of_last] == [0.4, 0.6, 0.3, 0.8, 0.7]


def test_its_end_is_the_leaderboard(site: Site, clock: Clock) -> None:
    """Ties, and what was disqualified or is computed anew, included."""
    teams = [join(site.database, site.challenge, f"Team {number}") for number in range(4)]
    made = []
    for number, value in enumerate((0.5, 0.7, 0.5, 0.7, 0.9, 0.9, 0.2)):
        made.append(score(site, teams[number % 4], value))
        clock.now_s += 60
    organiser.disqualify(site.database, made[4], "it cheats")
    organiser.requeue(site.database, made[5], "a machine was broken")
    board = site.board("development").standings
    end = history.standing_at(site.history("development"), clock.now_s, lower_is_better=False)
    assert [(row.rank, row.team, row.score) for row in end] == [(row.rank, row.team, row.score) for row in board]


def test_pages_and_api_tell_it(site: Site, clock: Clock) -> None:
    ada = join(site.database, site.challenge, HOSTILE)
    score(site, ada, 0.4)
    clock.now_s += 3 * DAY_S
    score(site, ada, 0.8)
    with TestClient(create_app(site)) as client:
        page = client.get("/phases/development/history")
        assert page.status_code == 200
        assert "<script" not in page.text
        assert "0.8000" in page.text
        past = client.get("/phases/development/history", params={"day": "2027-01-16"}).text
        assert "0.8000" not in past.partition("Each step")[0]
        assert "0.4000" in past
        assert "Nothing had been scored" in client.get("/phases/development/history?day=2026-01-01").text
        for day in ("never", "2027-02-31", HOSTILE, "0001-01-01T"):
            refused = client.get("/phases/development/history", params={"day": day})
            assert (refused.status_code, "<script" in refused.text) == (400, False)
        told = client.get("/api/v1/phases/development/history").json()
        assert [step["score"] for step in told] == [0.4, 0.8]


def test_a_team_sees_the_states_of_its_own_alone(site: Site, clock: Clock) -> None:
    token = people.join(site.database, site.challenge, people.invite(site.database), "Ada")
    ada, bob = people.team_of(site.database, token), join(site.database, site.challenge, "Bob")
    identifier, foreign = score(site, ada, 0.4), score(site, bob, 0.6)
    organiser.requeue(site.database, identifier, "a machine was broken")
    claim = queue.claim(site.database, "worker secret-host:1")
    assert claim is not None
    queue.fail(site.database, claim, "no space left in /srv/private")
    claim = queue.claim(site.database, "worker secret-host:1")
    assert claim is not None
    queue.give_back(site.database, claim)
    organiser.disqualify(site.database, identifier, f"it cheats {HOSTILE}")
    with TestClient(create_app(site), headers={"authorization": f"Bearer {token}"}) as client:
        with statements(site) as asked:
            told = client.get(f"/api/v1/submissions/{identifier}/history")
        assert len([statement for statement, _ in asked if "FROM submissions" in statement]) == 1
        assert [(step["state"], step["why"]) for step in told.json()] == [
            ("queued", ""),
            ("running", ""),
            ("scored", ""),
            ("queued", "a machine was broken"),
            ("running", ""),
            ("queued", ""),
            ("running", ""),
            ("queued", ""),
            ("disqualified", f"it cheats {HOSTILE}"),
        ]
        page = client.get(f"/mine/{identifier}")
        assert "<script" not in page.text
        assert page.headers["cache-control"] == "no-store"
        for word in ("secret-host", "/srv/private", "0.4"):
            assert word not in page.text.partition("<main")[2]
            assert word not in told.text
        absent = client.get(f"/api/v1/submissions/{'0' * 16}/history")
        refused = client.get(f"/api/v1/submissions/{foreign}/history")
        assert refused.status_code == absent.status_code == 400
        assert refused.text.replace(foreign, "0" * 16) == absent.text  # like what is not there
        assert client.get(f"/mine/{foreign}").status_code == 400
        client.headers.pop("authorization")
        assert client.get(f"/api/v1/submissions/{identifier}/history").status_code == 401
        assert client.get(f"/mine/{identifier}").status_code == 401


def test_where_results_are_told_at_fixed_moments_no_other_moment_of_a_run_is_told(site: Site, clock: Clock) -> None:
    phase = replace(site.challenge.phases["development"], hidden=True, told_every_s=600)
    clock.now_s = start_s = 1_800_000_000.0 + 7
    ada = join(site.database, site.challenge, "Ada")
    again = Site(
        replace(site.challenge, phases={"development": phase}), site.database, site.key, site.evaluators, "operator"
    )
    made = received()
    submissions.accept(site.database, phase, ada, made)

    def told() -> list[tuple[str, float]]:
        found = submissions.submission(site.database, made["id"], ada.id)
        return [(step["state"], step["at"]) for step in history.states(site.database, phase, found)]

    clock.now_s += 11
    claim = queue.claim(site.database, "w")
    assert claim is not None
    clock.now_s += 123
    assert queue.finish(site.database, claim, 0.5, scores_document({"flat:1": 0.5}), {})
    assert told() == [("queued", start_s)]
    assert again.history("development") == ()
    clock.now_s += 600
    moment = 1_800_000_600.0
    assert told() == [("queued", start_s), ("scored", moment)]
    assert [step.at for step in again.history("development")] == [moment]
    organiser.requeue(site.database, made["id"], "again")
    anew = queue.claim(site.database, "w")
    assert anew is not None
    assert queue.finish(site.database, anew, 0.25, scores_document({"flat:1": 0.25}), {})
    organiser.disqualify(site.database, made["id"], "it cheats")  # before it was told
    clock.now_s += 1200
    assert [state for state, _ in told()] == ["queued", "scored", "queued", "disqualified"]
    assert not [at for state, at in told() if state == "scored" and at % 600]


@given(st.lists(st.tuples(st.floats(0, 1e9), st.sampled_from("abcdefgh"), st.floats(-1e3, 1e3)), min_size=1))
def test_a_chart_stays_in_its_frame(drawn: list[tuple[float, str, float]]) -> None:
    made = tuple(Step(at, team, False, value, 1) for at, team, value in sorted(drawn))
    found = history.chart(made, 1e9, lower_is_better=False)
    left, right, top, bottom = history.FRAME
    for curve in found.curves:
        for corner in curve.points.split():
            x, y = map(float, corner.split(","))
            assert left - 0.1 <= x <= right + 0.1
            assert top - 0.1 <= y <= bottom + 0.1
    named = sorted(curve.label_y for curve in found.curves if curve.label_y is not None)
    assert all(b - a >= history.LINE_PX - 1e-6 for a, b in itertools.pairwise(named))
    assert len(found.up) <= 8


@pytest.mark.parametrize("span_s", [5, 60, 90, 1000, 86_400, 4e5, 1e8])
def test_a_chart_names_no_two_moments_alike(span_s: float) -> None:
    found = history.chart((Step(1e9, "a", False, 1.0, 1),), 1e9 + span_s, lower_is_better=False)
    assert len({label for _, label in found.across}) == len(found.across)
