"""Solutions as an axis: each in every episode, scored for itself, compared pair by pair, with its costs."""

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch import solution_axis
from benchbot.plugins.batch.attempts import Attempts
from benchbot.plugins.batch.costs import of_batch
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan
from benchbot.plugins.batch.request import merged
from tests.cli.solutions import PASSIVE
from tests.plugins.batch.conftest import Batches, wait_until
from tests.plugins.batch.test_batch import TRUTHS, truth

WANTED: dict[str, Any] = {"task": "sample:passive", "robots": ["sample_robot"], "environments": "arena:1,arena:2"}
SEES_A_BOTTLE = PASSIVE.replace(
    "json.dump(empty_results, file)",
    'json.dump({**empty_results, "results": {"class_list": ["bottle", "background"], "objects": [BOTTLE]}}, file)',
).replace(
    "import json, sys, time\n",
    "import json, sys, time\n"
    "BOTTLE = {'label_probs': [1, 0], 'centroid': [0, 0, 0.5], 'extent': [1, 1, 1]}\n"
    "until = time.process_time() + 0.3\n"
    "while time.process_time() < until: pass\n",
)


def planned(folder: Path, **given: Any) -> Plan:
    for name in "ab":
        (folder / f"{name}.py").write_text(f"print({name!r})\n")
    return solution_axis.plan(solution_axis.each({**WANTED, **given}), Catalog(plugin_manager.load()), folder)[0]


def test_each_solution_has_the_keys_that_it_has_alone_and_pairs_come_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    both = planned(tmp_path, solutions=["one=python a.py", "two=python b.py"], seeds="0..1")
    alone = planned(tmp_path, native="python a.py", seeds="0..1")

    assert [episode.solution for episode in both.episodes] == ["one", "two"] * 4
    assert [each.key for each in both.episodes if each.solution == "one"] == [each.key for each in alone.episodes]
    assert both.each()["one"].solution == alone.solution
    assert len({episode.name for episode in both.episodes}) == 8
    plans.write(tmp_path / "plan.json", both)
    assert plans.read(tmp_path / "plan.json") == both


def test_a_solution_may_be_of_any_kind_and_all_are_held_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "box").mkdir()
    (tmp_path / "box" / "Dockerfile").write_text("FROM scratch\n")
    commands = {"base": "example:hello_passive", "mine": "python a.py", "held": "sandbox:python a.py"}

    plan = planned(tmp_path, solutions={**commands, "box": "containerised:box"})

    assert plan.solutions["base"].example == "hello_passive"
    assert (plan.solutions["mine"].native, plan.solutions["mine"].hold.sandboxed) == ("python a.py", False)
    assert plan.solutions["held"].hold.sandboxed
    assert plan.solutions["box"].hold.context == str(tmp_path / "box") or plan.solutions["box"].hold.context == "box"
    sandboxed = planned(tmp_path, solutions={"a": "python a.py", "b": "python b.py"}, sandboxed=True)
    assert all(solution.hold.sandboxed for solution in sandboxed.solutions.values())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"solutions": ["=python a.py"]}, "names no solution"),
        ({"solutions": ["a"]}, "names no solution"),
        ({"solutions": ["a/b=python a.py"]}, "names no solution"),
        ({"solutions": ["a=python a.py", "a=python b.py"]}, "names no solution"),
        ({"solutions": ["a=python a.py"], "native": "python b.py"}, "not clear what to submit"),
        ({"solutions": ["a=python a.py", "b=python a.py"]}, "'a' and 'b' are the same"),
        ({"solutions": ["a=nothing_here x", "b=example:nothing"]}, "for 2 reasons"),
    ],
)
def test_what_is_no_axis_is_refused(
    given: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BenchbotError, match=said):
        planned(tmp_path, **given)


def test_options_name_other_solutions_than_the_file() -> None:
    assert "native" not in merged({"native": "python a.py"}, {"solutions": ["a=b"]})
    assert "solutions" not in merged({"solutions": {"a": "b"}}, {"example": "hello_passive"})


def test_a_batch_of_two_is_ended_gone_on_with_compared_and_its_costs_are_told(
    batches: Batches, make_plugin: Callable[..., Path]
) -> None:
    make_plugin("arena-truths", TRUTHS, {f"ground_truths/{n}.json": truth(n) for n in (1, 2)})
    seeing = batches.cli.script("seeing.py", SEES_A_BOTTLE)
    words = batches.words("b", "--jobs", "2", "--evaluate-with", "omq", "--zip", seeds="0..1")
    place = words.index("--native")
    words[place : place + 2] = ["--solution", f"blind={batches.solution}", "--solution", f"seeing={seeing}"]

    process = batches.cli.start(*words)
    wait_until(lambda: batches.told("b", "finished"))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    done = batches.cli("batch", "attach", "b", "--zip")
    folder = batches.path("b")
    before = batches.results("b")
    again = batches.cli(*words, "--json")

    assert done.returncode == 0, done.stderr
    assert "seeing" in done.stdout
    assert "OMQ" in done.stdout
    assert json.loads(again.stdout)["comparison"]["comparisons"][0]["pairs"] == 4
    assert batches.results("b") == before, "nothing is computed twice"
    compared = json.loads((folder / "comparison.json").read_text())
    assert [(each["name"], each["score"]) for each in compared["sets"]] == [("blind", 0.0), ("seeing", 1.0)]
    for name in ("blind", "seeing"):
        assert len(list((folder / "results" / name).glob("*.json"))) == 4
        assert (folder / "scores" / name / "report.html").is_file()
    by_hand = batches.cli("compare", f"blind={folder}/results/blind", f"seeing={folder}/results/seeing")
    assert by_hand.stdout == done.stdout
    blind, seen = json.loads((folder / "costs.json").read_text())["costs"]
    assert seen["cpu_hours"] - blind["cpu_hours"] > 4 * 0.25 / 3600
    assert seen["gpu_hours"] is None
    assert seen["wall_hours"] > seen["cpu_hours"]
    assert "GPUs held not measured" in done.stderr


def test_one_broken_solution_of_two_ends_both_before_anything_is_wasted(batches: Batches) -> None:
    broken = batches.cli.script("broken.py", "import os\nraise SystemExit('no weights')\n")
    words = batches.words("b", "--jobs", "2", seeds="0..4")
    place = words.index("--native")
    words[place : place + 2] = ["--solution", f"good={batches.solution}", "--solution", f"broken={broken}"]

    done = batches.cli(*words)

    assert done.returncode == 1
    assert "broken_sample_robot_arena-1_seed0" in done.stderr
    assert "no weights" in done.stderr
    assert len(batches.results("b")) <= 2


def test_costs_are_sums_of_what_was_measured_and_say_what_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    plan = planned(tmp_path, native="python a.py")
    folder = Folder(tmp_path / "b")
    first, second = (folder.attempts(episode) for episode in plan.episodes)

    def attempt(attempts: Attempts, **said: Any) -> None:
        made = attempts.begin("w")
        attempts.note(made, **said) if said else None

    attempt(first, ended="failed", failure="platform", duration_s=1800, cpu_s=360, gpus=2)
    attempt(first, ended="done", duration_s=1800, cpu_s=360, gpus=2)
    attempt(second)
    (cost,) = of_batch(folder, plan)
    assert (cost.wall_hours, cost.cpu_hours, cost.gpu_hours) == pytest.approx((1.0, 0.2, 2.0))
    assert (cost.attempts, cost.cut_off) == (3, 1)
    assert "1 more cut off and not counted" in str(cost)

    attempt(second, ended="done", duration_s=3600, cpu_s=None, gpus=2)
    (cost,) = of_batch(folder, plan)
    assert (cost.wall_hours, cost.cpu_hours, cost.gpu_hours) == (2.0, None, 4.0)
    assert "CPU of the solution not measured" in str(cost)
