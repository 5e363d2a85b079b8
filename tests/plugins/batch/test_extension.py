"""Seeds that are added to a batch: the same plan as if all had been asked for at once, and nothing computed twice."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch import solution_axis
from benchbot.plugins.batch.extension import extended, next_seeds
from benchbot.plugins.batch.plan import Plan
from tests.plugins.batch.conftest import Batches, wait_until
from tests.plugins.batch.test_batch import GATED, TRUTHS, truth

WANTED: dict[str, Any] = {"task": "sample:passive", "robots": ["sample_robot"], "environments": "arena:1,arena:2"}
SHAPES: dict[str, dict[str, Any]] = {
    "one": {"native": "python a.py"},
    "solutions": {"solutions": ["one=python a.py", "two=python b.py"]},
    "repeats": {"native": "python a.py", "repeats": 2},
    "settings": {"native": "python a.py", "set": ["lighting.time=08:00,20:00"]},
    "limits": {"native": "python a.py", "limits": {"steps": 3}, "timeout_s": 9.5},
    "held": {"sandbox": "python a.py", "memory": "1G"},
}


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in "ab":
        Path(f"{name}.py").write_text(f"print({name!r})\n")


def planned(**given: Any) -> Plan:
    catalog = Catalog(plugin_manager.load())
    return solution_axis.plan(solution_axis.each({**WANTED, **given}), catalog, Path.cwd())[0]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_plan_with_more_seeds_is_the_one_of_the_whole_command(shape: str) -> None:
    small, whole = planned(**SHAPES[shape], seeds="0..1"), planned(**SHAPES[shape], seeds="0..3")
    plans.write(Path("plan.json"), small)
    Path("a.py").write_text("print('edited since: the batch runs what it has kept')\n")

    grown = extended(plans.read(Path("plan.json")), [1, 2, 3], Catalog(plugin_manager.load()))

    assert grown == whole
    assert set(small.episodes) < set(grown.episodes)
    assert next_seeds(small) == "2..3"


def test_nothing_is_added_twice_nor_to_what_would_be_computed_otherwise_now() -> None:
    plan, catalog = planned(native="python a.py", seeds="3,5"), Catalog(plugin_manager.load())
    with pytest.raises(BenchbotError, match=r"has them already: 3, 5\.") as raised:
        extended(plan, [5, 3], catalog)
    assert raised.value.fix == "Name others: --seeds 6..7"

    other = tuple(replace(each, key=f"{each.key[:-1]}x") for each in plan.episodes)
    with pytest.raises(BenchbotError, match="would not be like those that are there"):
        extended(replace(plan, episodes=other), [4], catalog)


def test_a_batch_that_runs_is_added_to_and_ends_as_if_it_had_been_whole(
    batches: Batches, make_plugin: Callable[..., Path]
) -> None:
    make_plugin("arena-truths", TRUTHS, {f"ground_truths/{n}.json": truth(n) for n in (1, 2)})
    batches.solution = f"{batches.cli.script('gated.py', GATED)} {batches.cli.home}"
    folder, scored = batches.path("b"), ("--jobs", "1", "--evaluate-with", "omq")
    assert batches.cli(*batches.words("b", *scored, seeds="0"), "--detach").returncode == 0
    wait_until(lambda: batches.told("b", "finished") == 1 and batches.told("b", "began") == 2)

    shown = json.loads(batches.cli("batch", "extend", "b", "--seeds", "0..1", "--dry-run", "--json").stdout)
    assert [episode["done"] for episode in shown["episodes"]].count(True) == 1
    added = batches.cli("batch", "extend", "b", "--seeds", "0..1", "--detach", "--jobs", "2")
    assert added.returncode == 0, added.stderr
    assert "1 done, 3 to do" in added.stderr
    (batches.cli.home / "open").mkdir()
    wait_until((folder / "conclusion.json").is_file)
    wait_until(lambda: not batches.processes("benchbot.plugins.batch"))

    assert len(batches.results("b")) == len(list((folder / "results").glob("*.json"))) == 4
    assert [episode for episode, entries in batches.journals("b").items() if _ended_well(entries) != 1] == []
    scores = json.loads((folder / "scores.json").read_text())
    assert len(scores["rows"]) == 4
    (warning,) = scores["coverage"]["warnings"]
    assert warning.startswith("The batch b was added to: it had 2 episodes of 4 when results of it could be seen.")
    for one in ("b/results", "b/scores.json"):
        compared = batches.cli("compare", f"gathered={one}", "computed=b/episodes", "--over", "environments", "--json")
        assert json.loads(compared.stdout)["notes"] == [warning], compared.stderr
    whole = batches.run("b", *scored, seeds="0..1")
    assert "4 done, 0 to do" in whole.stderr
    assert json.loads((folder / "plan.json").read_text())["grown_from"] == [2]


def _ended_well(entries: list[dict[str, Any]]) -> int:
    return sum(entry.get("ended") == "done" for entry in entries)
