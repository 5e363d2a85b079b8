"""The queue of a challenge, by its own code on its own database, with many workers and a clock that jumps.

Workers come within ten seconds and compute for half a minute in the median; some die, and others take their places.
"""

import heapq
import os
import random
import statistics
import time
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

WORKERS, QUEUED, QUEUING_TEAMS = 1_000, 10_000, 200
EPISODE_S, SPREAD = 30.0, 0.5
"""Episodes take half a minute in the median, log-normally."""
DEATHS, NEXT_WORKER_S, IDLE_S, ARRIVAL_S = 0.05, 30.0, 10.0, 10.0
SHARES_EVERY_S = 5.0


class Clock:
    """A clock that stands until it is set."""

    now_s = 1_800_000_000.0

    def __call__(self) -> float:
        return self.now_s


def jain(values: Sequence[float]) -> float:
    """Return Jain's index of fairness: 1 where all have the same, 1/n where one has all."""
    squares = sum(value**2 for value in values)
    return sum(values) ** 2 / (len(values) * squares) if squares else 1.0


def max_min_shares(asked: Sequence[float], capacity: float) -> list[float]:
    """Return the max-min fair shares of a capacity: nobody gets more than is asked, what is left is shared alike."""
    shares = [0.0] * len(asked)
    left = capacity
    by_need = sorted(range(len(asked)), key=lambda number: asked[number])
    for place, number in enumerate(by_need):
        shares[number] = min(asked[number], left / (len(asked) - place))
        left -= shares[number]
    return shares


def simulated(kind: str, url: str) -> dict[str, Any]:
    """Return what the queue does with workers that come within ten seconds, and of which one claim in 20 kills one."""
    from benchbot.plugins.challenge import organiser, people, queue, submissions
    from benchbot.plugins.challenge.database import Database
    from benchbot.plugins.challenge.document import Challenge, Phase

    clock, chance = Clock(), random.Random(2)
    database = Database(url, clock)
    challenge = Challenge(folder=Path(), name="c", title="C", phases={})
    phase = Phase("p", "P", {"evaluate_with": "omq"})
    costs: dict[str, list[tuple[float, float]]] = {}

    def timed(what: str, act: Callable[[], Any]) -> Any:
        start_s, used_s = time.perf_counter(), time.process_time()
        try:
            return act()
        finally:
            costs.setdefault(what, []).append((time.perf_counter() - start_s, time.process_time() - used_s))

    teams = []
    for number in range(QUEUING_TEAMS):
        token = people.join(database, challenge, people.invite(database), f"Team {number}")
        team = people.team_of(database, token)
        assert team is not None
        teams.append(team)
    # Team n hands in as many as 1/n: the first some 1,700, the last nine.
    order = chance.choices(teams, [1 / (number + 1) for number in range(QUEUING_TEAMS)], k=QUEUED)
    owner, waiting = {}, dict.fromkeys(range(1, QUEUING_TEAMS + 1), 0)
    for team in order:
        random_name = uuid.uuid4().hex
        known = {"id": random_name[:16], "title": "", "mode": "sandbox", "sha256": random_name * 2, "size_bytes": 1}
        record = {**known, "envelope": {}, "statement": random_name * 2}
        timed("accept", lambda: submissions.accept(database, phase, team, record))  # noqa: B023
        owner[record["id"]] = team.id
        waiting[team.id] += 1
    start_s = clock.now_s
    events: list[tuple[float, int, str, Any, float]]
    events = [(start_s + chance.uniform(0, ARRIVAL_S), number, "poll", None, 0.0) for number in range(WORKERS)]
    heapq.heapify(events)
    sequence, done, died, work_s = WORKERS, 0, 0, 0.0
    running = dict.fromkeys(waiting, 0)
    leased = dict.fromkeys(waiting, 0)
    shares: dict[str, list[float]] = {"equal": [], "demand": [], "leases": []}
    lost_at: dict[str, float] = {}
    recovery_s: list[float] = []
    next_sample_s = start_s + ARRIVAL_S + SHARES_EVERY_S
    simulation_s, used_s = time.perf_counter(), time.process_time()
    while done < QUEUED:
        clock.now_s, _, what, claim, until_s = heapq.heappop(events)
        sequence += 1
        if clock.now_s >= next_sample_s:
            next_sample_s += SHARES_EVERY_S
            backlogged = [team for team, left in waiting.items() if left]
            if len(backlogged) > 1:
                shares["equal"].append(jain([running[team] for team in backlogged]))
                asking = [team for team in waiting if running[team] or waiting[team]]
                for name, has in (("demand", running), ("leases", leased)):
                    asked = [has[team] + waiting[team] for team in asking]
                    fair = max_min_shares(asked, sum(has[team] for team in asking))
                    pairs = zip(asking, fair, strict=True)
                    shares[name].append(jain([has[team] / share for team, share in pairs if share > 0]))
        if what == "poll":
            claim = timed("claim", lambda: queue.claim(database, "w"))
            if claim is None:
                heapq.heappush(events, (clock.now_s + IDLE_S, sequence, "poll", None, 0.0))
                continue
            if claim.submission in lost_at:
                recovery_s.append(clock.now_s - lost_at.pop(claim.submission))
            else:
                leased[owner[claim.submission]] += 1
            waiting[owner[claim.submission]] -= 1
            running[owner[claim.submission]] += 1
            length_s = chance.lognormvariate(0, SPREAD) * EPISODE_S
            work_s += length_s
            if chance.random() < DEATHS:
                dies_s = clock.now_s + chance.random() * length_s
                heapq.heappush(events, (dies_s, sequence, "die", claim, 0.0))
            else:
                due_s = min(clock.now_s + queue.LEASE_S / 4, clock.now_s + length_s)
                heapq.heappush(events, (due_s, sequence, "extend", claim, clock.now_s + length_s))
        elif what == "die":
            died += 1
            lost_at[claim.submission] = clock.now_s
            waiting[owner[claim.submission]] += 1
            running[owner[claim.submission]] -= 1
            heapq.heappush(events, (clock.now_s + NEXT_WORKER_S, sequence, "poll", None, 0.0))
        elif clock.now_s < until_s:
            assert timed("extend", lambda: queue.extend(database, claim))  # noqa: B023
            due_s = min(clock.now_s + queue.LEASE_S / 4, until_s)
            heapq.heappush(events, (due_s, sequence, "extend", claim, until_s))
        else:
            assert timed("finish", lambda: queue.finish(database, claim, 0.5, {}, {}))  # noqa: B023
            done += 1
            leased[owner[claim.submission]] -= 1
            running[owner[claim.submission]] -= 1
            heapq.heappush(events, (clock.now_s, sequence, "poll", None, 0.0))
    simulation_s, used_s = time.perf_counter() - simulation_s, time.process_time() - used_s
    assert organiser.counts(database) == {"scored": QUEUED}
    database.engine.dispose()
    makespan_s = clock.now_s - start_s
    calls = sum(len(found) for what, found in costs.items() if what != "accept")
    print(f"{kind}: {QUEUED} episodes, {WORKERS} workers, {died} died: {makespan_s / 60:.1f} simulated minutes,")
    print(f"  {work_s / WORKERS / makespan_s:.0%} of the workers' time at work, {QUEUED / makespan_s:.1f} episodes/s")
    for name, what in (
        ("demand", "what teams have, by their max-min fair share of what they ask for"),
        ("leases", "the same, where a lost worker has its lease until it ends"),
        ("equal", "what teams that wait have, by equal shares whatever they ask for"),
    ):
        print(f"  {what}: Jain's index {statistics.fmean(shares[name]):.3f}, least {min(shares[name]):.3f}")
    print(f"  a lost one was begun anew after {statistics.median(recovery_s):.0f} s, at most {max(recovery_s):.0f} s")
    for name, found in costs.items():
        walls_s, used_each_s = zip(*found, strict=True)
        cuts_s = statistics.quantiles(walls_s, n=100)
        print(
            f"  {name:8}{len(found):7} × {statistics.fmean(used_each_s) * 1e3:.2f} ms of the caller's processor,",
            end="",
        )
        print(f" p50 {cuts_s[49] * 1e3:.1f}, p99 {cuts_s[98] * 1e3:.1f} ms")
    print(f"  {calls / simulation_s:.0f} calls/s of one caller ({used_s:.0f} s of its processor)")
    print(f"  load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    means_s = {name: statistics.fmean(used for _, used in found) for name, found in costs.items()}
    return {
        "makespan_s": makespan_s,
        "at_work": work_s / WORKERS / makespan_s,
        "jain": {name: statistics.fmean(found) for name, found in shares.items()},
        "recovery_median_s": statistics.median(recovery_s),
        "recovery_most_s": max(recovery_s),
        "caller_processor_s": means_s,
    }
