import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.records import Resources
from benchbot.plugins.batch import attempts, finalization, following, matrix
from benchbot.plugins.batch.finalization import evaluate
from benchbot.plugins.batch.folder import Folder, prepare, preview
from benchbot.plugins.batch.plan import Plan
from benchbot.plugins.batch.request import BatchRequest
from benchbot.plugins.batch.status import Monitor
from benchbot.plugins.batch.worker_pool import WorkerPool

EPISODES = 30
FAILED = 10


@pytest.fixture
def catalog() -> Catalog:
    return Catalog(plugin_manager.load())


@pytest.fixture
def batch(tmp_path: Path, catalog: Catalog) -> tuple[Folder, Plan]:
    """A batch that is finished; some of its episodes failed."""
    request = BatchRequest("sample:passive", ["sample_robot"], ["arena:1"], native="true", seeds=range(EPISODES))
    folder, plan = Folder(tmp_path / "batch"), matrix.make(request, catalog, tmp_path)[0]
    prepare(folder, plan)
    for episode in plan.episodes:
        tried = folder.attempts(episode)
        attempt = tried.begin("worker")
        result = {"seed": episode.seed, "snapshot": plan.solution.snapshot}
        (attempt.folder / "result.json").write_text(json.dumps(result))
        tried.publish(attempt, FailureClass.AGENT if episode.seed < FAILED else None)
    return folder, plan


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The results that are read and hashed."""
    found: list[Path] = []
    hashed = attempts._digest

    def noting(path: Path) -> str:
        found.append(path)
        return hashed(path)

    monkeypatch.setattr(attempts, "_digest", noting)
    return found


def test_a_command_reads_each_result_once_however_often_it_looks(
    batch: tuple[Folder, Plan], catalog: Catalog, read: list[Path]
) -> None:
    folder, plan = batch
    assert len(preview(folder, plan).done) == EPISODES
    status = Monitor(folder, plan).look()
    files = evaluate(folder, plan, catalog).files
    assert evaluate(folder, plan, catalog).files == files
    assert sorted(read) == sorted(folder.result(episode.name) for episode in plan.episodes)
    assert (status.finished, status.failures, status.mean_s is None) == (EPISODES, {"agent": FAILED}, False)
    assert len(list(Path(files["results"]).iterdir())) == EPISODES


def test_a_result_that_changes_meanwhile_is_looked_at_again(batch: tuple[Folder, Plan], read: list[Path]) -> None:
    folder, plan = batch
    episode = plan.episodes[0]
    result = folder.result(episode.name)
    assert folder.finished(episode) is not None
    content = result.read_bytes()
    result.write_bytes(b"damaged")
    assert folder.finished(episode) is None
    result.write_bytes(content)
    assert folder.finished(episode) is not None
    folder.attempts(episode).begin_anew()
    assert folder.finished(episode) is None
    assert read == [result] * 3


def test_a_gathered_copy_that_was_changed_is_made_again(batch: tuple[Folder, Plan], catalog: Catalog) -> None:
    folder, plan = batch
    gathered = Path(evaluate(folder, plan, catalog).files["results"])
    changed, *others = sorted(gathered.iterdir())
    before = {path: path.stat().st_ino for path in others}
    content = changed.read_bytes()
    changed.write_bytes(content.replace(b"seed", b"weed"))
    os.utime(changed, ns=(0, 0))
    evaluate(folder, plan, catalog)
    assert changed.read_bytes() == content
    assert {path: path.stat().st_ino for path in others} == before


def test_a_batch_that_is_complete_is_scored_once(
    batch: tuple[Folder, Plan], catalog: Catalog, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, plan = batch
    scored: list[int] = []

    def score(paths: Sequence[Path], **_: object) -> None:
        scored.append(len(paths))
        raise BenchbotError("Enough.", "It is only counted.", "Nothing.")

    for name in ("score_files", "evaluate_files"):
        monkeypatch.setattr(finalization, name, score)
    pool = WorkerPool("local", 1, Resources(1, 0, None, None), {})
    ended = following.drive(folder, pool, catalog, replace(plan, method="omq"), as_json=False, display="none")
    assert ended.status is not None
    assert ended.status.is_complete
    assert scored == [EPISODES]
