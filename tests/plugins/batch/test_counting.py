"""Counting the episodes of a batch without reading them again: all that would make a count wrong without a word."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import FailureClass
from benchbot.plugins.batch import counting, matrix
from benchbot.plugins.batch.counting import BatchCounter, Count
from benchbot.plugins.batch.folder import Folder, prepare
from benchbot.plugins.batch.journal import EventLog
from benchbot.plugins.batch.plan import Plan, PlannedEpisode
from benchbot.plugins.batch.request import BatchRequest
from benchbot.plugins.batch.status import Monitor

EPISODES = 6
AT_ONCE_S = 10.0
"""Time enough for looking at every result."""
Compute = Callable[..., None]


@pytest.fixture
def batch(tmp_path: Path) -> tuple[Folder, Plan]:
    """A batch that is about to begin."""
    request = BatchRequest("sample:passive", ["sample_robot"], ["arena:1"], native="true", seeds=range(EPISODES))
    folder = Folder(tmp_path / "batch")
    plan = matrix.make(request, Catalog(plugin_manager.load()), tmp_path)[0]
    prepare(folder, plan)
    for path in (folder.events, folder.claims):
        path.mkdir()
    return folder, plan


def compute(folder: Folder, episode: PlannedEpisode, failure: FailureClass | None = None, *, told: bool = True) -> None:
    """Finish an episode as a worker does; `told` says whether its event arrives, as on a disk that is not full."""
    tried = folder.attempts(episode)
    attempt = tried.begin("worker")
    (attempt.folder / "result.json").write_text(json.dumps({"seed": episode.seed}))
    tried.publish(attempt, failure)
    if told:
        EventLog(folder.events, "worker").tell("finished", key=episode.key, failure=failure)


def both(folder: Folder, counter: BatchCounter, monitor: Monitor, audit_s: float = 0.0) -> Count:
    """Return what a list of batches shows, which is what the batch's own screen shows."""
    count = counter.look(audit_s)
    status = monitor.look()
    assert count == Count(status.episodes, status.finished, dict(status.failures))
    return count


def test_what_is_finished_fails_or_is_retried_is_counted_by_its_events(
    batch: tuple[Folder, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, plan = batch
    counter, monitor = BatchCounter(folder.path), Monitor(folder, plan)
    assert both(folder, counter, monitor) == Count(EPISODES, 0)
    compute(folder, plan.episodes[3])
    compute(folder, plan.episodes[4], FailureClass.AGENT)
    assert both(folder, counter, monitor) == Count(EPISODES, 2, {"agent": 1})

    # It is retried by somebody else, and fails in another way: events of clocks that differ have no order.
    folder.attempts(plan.episodes[4]).begin_anew()
    EventLog(folder.events, "driver").tell("retried", key=plan.episodes[4].key)
    assert both(folder, counter, monitor) == Count(EPISODES, 1)
    monkeypatch.setattr("benchbot.plugins.batch.journal.time.time", lambda: 0.0)
    compute(folder, plan.episodes[4], FailureClass.TIMEOUT)
    expected = Count(EPISODES, 2, {"timeout": 1})
    assert both(folder, counter, monitor) == expected
    # So it is for those who come now, and find all events at once.
    assert both(folder, BatchCounter(folder.path), Monitor(folder, plan)) == expected


@pytest.mark.parametrize("harm", ["deleted", "edited", "edited in place with its old time"])
def test_a_result_that_is_deleted_or_edited_counts_no_more(batch: tuple[Folder, Plan], harm: str) -> None:
    folder, plan = batch
    for episode in plan.episodes:
        compute(folder, episode)
    counter, monitor = BatchCounter(folder.path), Monitor(folder, plan)
    assert both(folder, counter, monitor, AT_ONCE_S) == Count(EPISODES, EPISODES)
    result = folder.result(plan.episodes[2].name)
    before = result.stat()
    if harm == "deleted":
        result.unlink()
    else:
        result.write_bytes(result.read_bytes()[::-1])
    if harm == "edited in place with its old time":
        os.utime(result, ns=(before.st_atime_ns, before.st_mtime_ns))
        assert result.stat().st_size == before.st_size
    assert both(folder, counter, monitor, AT_ONCE_S) == Count(EPISODES, EPISODES - 1)


def test_results_whose_events_were_lost_are_found_in_turn(batch: tuple[Folder, Plan]) -> None:
    folder, plan = batch
    counter = BatchCounter(folder.path)
    counter.look(0.0)
    for episode in plan.episodes:
        compute(folder, episode, FailureClass.AGENT, told=False)
    counts = [counter.look(0.0) for _ in range(EPISODES)]
    assert counts[-1] == Count(EPISODES, EPISODES, {"agent": EPISODES})


def test_a_batch_at_rest_is_not_read_again(batch: tuple[Folder, Plan], monkeypatch: pytest.MonkeyPatch) -> None:
    folder, plan = batch
    for episode in plan.episodes:
        compute(folder, episode)
    counter = BatchCounter(folder.path)
    count = counter.look(0.0)

    def read(*_: object) -> None:
        raise AssertionError("a result is read")

    for name in ("_receipt", "_check", "_read_plan"):
        monkeypatch.setattr(counting.BatchCounter, name, read)
    assert [counter.look(0.0) for _ in range(2 * EPISODES)] == [count] * 2 * EPISODES


def test_another_plan_in_the_same_folder_is_counted_anew(batch: tuple[Folder, Plan], tmp_path: Path) -> None:
    folder, plan = batch
    compute(folder, plan.episodes[0])
    counter = BatchCounter(folder.path)
    assert counter.look(0.0) == Count(EPISODES, 1)
    request = BatchRequest("sample:passive", ["sample_robot"], ["arena:1"], native="true", seeds=range(2 * EPISODES))
    prepare(folder, matrix.make(request, Catalog(plugin_manager.load()), tmp_path)[0], update=True)
    assert counter.look(0.0) == Count(2 * EPISODES, 1)
    folder.plan.write_bytes(folder.plan.read_bytes()[:100])
    assert counter.look(0.0) is None
