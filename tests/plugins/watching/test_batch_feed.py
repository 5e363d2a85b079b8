"""A batch that somebody watches, whose episodes fail and are computed once more."""

import json
from hashlib import sha256
from pathlib import Path

import pytest

from benchbot.plugins.watching import plain
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.batch_list import BatchList
from benchbot.plugins.watching.batch_list import batches as listed
from tests.cli.solutions import PASSIVE
from tests.plugins.batch.conftest import Batches, batches, sources  # noqa: F401 - fixtures
from tests.supervisor.harness import eventually

PATIENCE_S = 240.0
FRAIL = """\
import pathlib, time
here = pathlib.Path({here!r})
while not (here / "open").exists():
    time.sleep(0.05)
assert not (here / "broken").exists()
"""


def test_a_batch_is_found_watched_and_tried_again(
    batches: Batches,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR", "BENCHBOT_PLUGINS", "PYTHONPATH"):
        monkeypatch.setenv(name, batches.cli.variables[name])
    here, folder = batches.cli.home, batches.path("night")
    (here / "broken").touch()
    batches.cli.script("passive.py", FRAIL.format(here=str(here)) + PASSIVE)
    driver = batches.cli.start(*batches.words("night", "--jobs", "1", "--no-canary", seeds="0..1", envs="arena:1"))
    assert eventually(lambda: [entry.alive for entry in listed()] == [True], PATIENCE_S)
    feed = BatchFeed(folder)
    assert eventually(lambda: sorted(cell.state for cell in feed.view.cells) == ["pending", "running"], PATIENCE_S)
    view = feed.view
    (running,) = [cell for cell in view.cells if cell.state == "running"]
    assert [(row.name, row.episode) for row in view.workers] == [(running.worker, running.name)]
    assert view.alive
    assert [(cell.robot, cell.environment, cell.seed) for cell in view.cells] == [
        ("sample_robot", "arena:1", 0),
        ("sample_robot", "arena:1", 1),
    ]

    # The solution is broken, and every episode fails.
    (here / "open").touch()
    driver.communicate(timeout=PATIENCE_S)
    assert driver.returncode == 1
    assert eventually(lambda: [cell.state for cell in feed.view.cells] == ["agent", "agent"], PATIENCE_S)
    assert all(cell.log is not None and "AssertionError" in cell.log.read_text() for cell in feed.view.cells)
    (entry,) = listed()
    assert (entry.folder, entry.alive, entry.episodes, entry.finished) == (folder, False, 2, 2)

    # It is mended, and whoever watches has the episodes computed once more.
    (here / "broken").unlink()
    assert feed.retry(["agent"]) == 2
    assert eventually(lambda: [cell.state for cell in feed.view.cells] == ["done", "done"], PATIENCE_S)
    plain.follow(feed, "plain")
    assert "2 of 2 episodes are finished, all of them well." in capfd.readouterr().err
    feed.close()
    assert eventually(lambda: not listed()[0].alive, PATIENCE_S)


def test_a_list_of_batches_tells_at_once_what_the_last_one_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    folder = tmp_path / "batch"
    (folder / "events").mkdir(parents=True)
    keys = [str(number) * 64 for number in range(3)]
    plan = {"version": 2, "episodes": [{"key": key, "label": "room"} for key in keys]}
    (folder / "plan.json").write_text(json.dumps(plan))
    result = folder / "episodes" / f"room-{keys[0][:8]}" / "result.json"
    result.parent.mkdir(parents=True)
    result.write_text("{}")
    place = tmp_path / "state" / "batches"
    place.mkdir(parents=True)
    entry = {"folder": str(folder), "begun_s": 1.0, "driver": None}
    (place / f"{sha256(str(folder).encode()).hexdigest()[:16]}.json").write_text(json.dumps(entry))

    assert [each.finished for each in BatchList().look()] == [1]
    result.unlink()  # no event tells of it
    remembering = BatchList(remembers=True)
    assert [each.finished for each in remembering.look()] == [1]
    assert [each.finished for each in remembering.look()] == [0]
    (folder / "events" / "w.jsonl").write_text(json.dumps({"what": "began", "key": keys[1]}) + "\n")
    assert [each.finished for each in BatchList(remembers=True).look()] == [0]
