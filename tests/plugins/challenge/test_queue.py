"""The queue: nothing is lost, nothing counts twice, teams get equal shares; in both kinds of database."""

import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from sqlalchemy import func, select

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge import organiser, people, queue, submissions
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import QUEUED, RUNNING, SCORED, Challenge, Phase
from benchbot.plugins.challenge.queue import LEASE_S, MOST_FAILURES, Claim
from benchbot.plugins.challenge.tables import scores, teams
from tests.plugins.challenge.conftest import Clock, join, received


def test_a_hundred_submissions_at_once_never_exceed_the_quota(
    database: Database, challenge: Challenge, phase: Phase
) -> None:
    team = join(database, challenge, "A")
    strict = replace(phase, per_day=7)

    def submit(_: int) -> str:
        try:
            submissions.accept(database, strict, team, received())
        except BenchbotError as error:
            return error.title
        return "accepted"

    with ThreadPoolExecutor(20) as threads:
        answers = Counter(threads.map(submit, range(100)))
    assert answers.pop("accepted") == 7
    ((refusal, count),) = answers.items()
    assert "has used up its submissions" in refusal
    assert count == 93
    numbers = [row.number for row in submissions.of_team(database, team.id)]
    assert numbers == [7, 6, 5, 4, 3, 2, 1]


def test_a_day_of_the_quota_ends_at_midnight_utc(
    database: Database, challenge: Challenge, phase: Phase, clock: Clock
) -> None:
    team = join(database, challenge, "A")
    clock.now_s = 20_000 * 86_400 - 1.0
    for _ in range(2):
        submissions.accept(database, replace(phase, per_day=1, in_all=2), team, received())
        clock.now_s += 1.0
    clock.now_s += 86_400
    with pytest.raises(BenchbotError, match="used up") as refused:
        submissions.accept(database, replace(phase, per_day=1, in_all=2), team, received())
    assert "in this phase" in refused.value.why


def test_a_statement_counts_once(database: Database, challenge: Challenge, phase: Phase) -> None:
    team = join(database, challenge, "A")
    submissions.accept(database, phase, team, received(statement="5" * 64))
    with pytest.raises(BenchbotError, match="handed in already"):
        submissions.accept(database, phase, team, received(statement="5" * 64))
    assert len(submissions.of_team(database, team.id)) == 1


def test_workers_at_once_claim_each_submission_once(database: Database, challenge: Challenge, phase: Phase) -> None:
    team = join(database, challenge, "A")
    handed_in = {submissions.accept(database, replace(phase, per_day=None), team, received())["id"] for _ in range(20)}
    with ThreadPoolExecutor(8) as threads:
        claims = list(threads.map(lambda number: queue.claim(database, f"w{number}"), range(30)))
    claimed = [claim.submission for claim in claims if claim is not None]
    assert len(claimed) == len(set(claimed))
    # A worker that found the others' rows locked may have found none: it asks again.
    while (claim := queue.claim(database, "last")) is not None:
        claimed.append(claim.submission)
    assert set(claimed) == handed_in


def test_teams_get_equal_shares_however_much_one_hands_in(
    database: Database, challenge: Challenge, phase: Phase, clock: Clock
) -> None:
    a, b = join(database, challenge, "A"), join(database, challenge, "B")
    order = [*[a] * 6, *[b] * 3]
    owners = {
        submissions.accept(database, replace(phase, per_day=None), team, received())["id"]: team for team in order
    }
    served = []
    for _ in order:
        clock.now_s += 1.0
        claim = queue.claim(database, "w")
        assert claim is not None
        served.append(owners[claim.submission].name)
        queue.finish(database, claim, 0.5, {}, {})
    assert "".join(served) == "ABABABAAA"


def test_a_lost_worker_gives_its_submission_back_and_its_late_score_does_not_count(
    database: Database, challenge: Challenge, phase: Phase, clock: Clock
) -> None:
    submissions.accept(database, phase, join(database, challenge, "A"), received())
    lost = queue.claim(database, "lost")
    assert lost is not None
    assert queue.claim(database, "other") is None
    clock.now_s += LEASE_S + 1
    taken = queue.claim(database, "other")
    assert taken == replace(lost, attempt=2)
    assert not queue.extend(database, lost)
    assert not queue.finish(database, lost, 0.9, {}, {})
    assert queue.finish(database, taken, 0.5, {}, {})
    assert not queue.finish(database, taken, 0.7, {}, {})
    assert submissions.of_team(database, 1)[0].score == 0.5
    assert [row.running for row in people.all_teams(database)] == [0]


def test_a_machine_that_fails_again_and_again_is_the_organisers_to_mend(
    database: Database, challenge: Challenge, phase: Phase
) -> None:
    submissions.accept(database, phase, join(database, challenge, "A"), received())
    for _ in range(MOST_FAILURES):
        claim = queue.claim(database, "w")
        assert claim is not None
        queue.fail(database, claim, "at place42: out of memory")
    assert queue.claim(database, "w") is None
    (row,) = submissions.of_team(database, 1)
    assert row.state == "failed"
    assert "place42" not in row.reason
    assert "place42" in organiser.log(database)[0].detail
    organiser.requeue(database, row.id, "mended")
    assert queue.claim(database, "w") is not None


def test_a_pause_lets_nothing_begin_and_a_disqualification_ends_what_runs(
    database: Database, challenge: Challenge, phase: Phase
) -> None:
    submissions.accept(database, phase, join(database, challenge, "A"), received())
    organiser.pause(database, "the disk is full")
    assert queue.claim(database, "w") is None
    organiser.pause(database, None)
    claim = queue.claim(database, "w")
    assert claim is not None
    organiser.disqualify(database, claim.submission, "it reads the truth")
    assert not queue.finish(database, claim, 1.0, {}, {})
    (row,) = submissions.of_team(database, 1)
    assert (row.state, row.reason, row.score) == ("disqualified", "it reads the truth", None)


def test_only_what_waits_can_be_withdrawn_and_only_by_its_team(
    database: Database, challenge: Challenge, phase: Phase
) -> None:
    a, b = join(database, challenge, "A"), join(database, challenge, "B")
    only = replace(phase, per_day=1)
    made = submissions.accept(database, only, a, received())
    with pytest.raises(BenchbotError, match="no submission"):
        submissions.withdraw(database, made["id"], b.id)
    submissions.withdraw(database, made["id"], a.id)
    again = submissions.accept(database, only, a, received())  # what was withdrawn counts for no quota
    queue.claim(database, "w")
    with pytest.raises(BenchbotError, match="cannot be withdrawn"):
        submissions.withdraw(database, again["id"], a.id)


class AnyOrder(RuleBasedStateMachine):
    """Workers that come, go and die in any order, against a clock that jumps."""

    def __init__(self) -> None:
        super().__init__()
        self.clock = Clock()
        self.folder = tempfile.TemporaryDirectory()
        self.database = Database(f"sqlite:///{self.folder.name}/challenge.db", self.clock)
        challenge = Challenge(folder=None, name="c", title="C", phases={})  # type: ignore[arg-type]
        self.phase = Phase("p", "P", {"evaluate_with": "omq"})
        self.teams = [join(self.database, challenge, name) for name in "AB"]
        self.claims: list[Claim] = []
        self.handed_in = 0
        self.counted = 0

    def teardown(self) -> None:
        self.database.engine.dispose()
        self.folder.cleanup()

    @rule(team=st.integers(0, 1))
    def hand_in(self, team: int) -> None:
        submissions.accept(self.database, self.phase, self.teams[team], received())
        self.handed_in += 1

    @rule()
    def claim(self) -> None:
        claim = queue.claim(self.database, "w")
        self.claims += [] if claim is None else [claim]

    @rule(which=st.integers(0, 9), score=st.floats(0, 1))
    def finish(self, which: int, score: float) -> None:
        if self.claims:
            self.counted += queue.finish(self.database, self.claims[which % len(self.claims)], score, {}, {})

    @rule(which=st.integers(0, 9))
    def give_back(self, which: int) -> None:
        if self.claims:
            queue.give_back(self.database, self.claims[which % len(self.claims)])

    @rule(seconds=st.sampled_from([1.0, LEASE_S / 2, LEASE_S + 1]))
    def wait(self, seconds: float) -> None:
        self.clock.now_s += seconds

    @invariant()
    def nothing_is_lost_and_nothing_counts_twice(self) -> None:
        counts = organiser.counts(self.database)
        assert sum(counts.values()) == self.handed_in
        assert set(counts) <= {QUEUED, RUNNING, SCORED}
        with self.database.reading() as connection:
            assert connection.scalar(select(func.count()).select_from(scores)) == counts.get(SCORED, 0) == self.counted
            assert (connection.scalar(select(func.sum(teams.c.running))) or 0) == counts.get(RUNNING, 0)


TestAnyOrder = AnyOrder.TestCase
TestAnyOrder.settings = settings(
    max_examples=8, stateful_step_count=20, deadline=None, suppress_health_check=list(HealthCheck)
)


def test_two_servers_that_start_at_once_enter_a_baseline_once(database: Database, phase: Phase) -> None:
    def enter(_: int) -> bool:
        team = people.add_baseline(database, "Floor")
        try:
            submissions.accept(database, phase, team, received())
        except BenchbotError:
            return False
        return True

    with ThreadPoolExecutor(8) as threads:
        assert sum(threads.map(enter, range(16))) == 1
    (team,) = people.all_teams(database)
    assert len(submissions.of_team(database, team.id)) == 1
