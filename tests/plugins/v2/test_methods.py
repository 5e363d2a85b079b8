from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.plugins.v2 import addons, methods, trust
from tests.v2_addon import make

TRUTH: Any = {"ground_truth": {"counts": {"bottle": 1, "chair": 2}}}


def result(task: str = "t", **counts: int) -> Any:
    return {"task_details": {"name": task}, "environment_details": [{"name": "hall"}], "results": {"counts": counts}}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    return make(tmp_path / "addons")


def method(folder: Path, code: str | None = None, declared: str = "") -> Evaluator:
    declared_in = folder / "me/eval_count/evaluation_methods"
    if code is not None:
        (declared_in / "count_error.py").write_text(code)
        text = (declared_in / "count_error.yaml").read_text().replace('  combine: "count_error.combine"\n', declared)
        (declared_in / "count_error.yaml").write_text(text)
    addon = addons.find(folder)
    trust.remember(addon)
    (found,) = methods.evaluators(addon)
    assert isinstance(found, Evaluator)
    return found


def test_a_method_scores_and_leaves_its_arguments_as_they_are(folder: Path) -> None:
    scored = result(bottle=1)

    assert method(folder).evaluate(scored, [TRUTH]) == {"exact": 0.5, "classes": 2.0}
    assert scored == result(bottle=1)


def test_combine_is_given_what_v2_gave_it(folder: Path) -> None:
    code = """\
def evaluate(results, ground_truths):
    return {"task_details": results["task_details"], "scores": {"s": len(results["results"]["counts"])}}

def combine(scores):
    return {"scores": {"named_a": sum(one["task_details"]["name"] == "a" for one in scores if one), "all": len(scores)}}
"""
    found = method(folder, code, '  combine: "count_error.combine"\n')
    first, second = (found.evaluate(one, [TRUTH]) for one in (result("a", bottle=1), result("b")))

    assert found.combine([first, second, {}]) == {"named_a": 1.0, "all": 3.0}


def test_without_combine_it_is_the_mean_and_a_missing_result_counts_as_zero(folder: Path) -> None:
    found = method(folder, "def evaluate(results, ground_truths): return {'s': 3}")

    assert found.combine([found.evaluate(result(), [TRUTH]), {}]) == {"s": 1.5}
    assert found.combine([{}]) == {"count_error": 0.0}


@pytest.mark.parametrize("returned", ["None", "{}", "{'scores': {}}", "{'scores': {'s': 'high'}}", "[1]"])
def test_a_method_that_gives_no_numbers_is_named(returned: str, folder: Path) -> None:
    found = method(folder, f"def evaluate(results, ground_truths): return {returned}")

    with pytest.raises(BenchbotError, match="The method 'count_error' gave no scores") as caught:
        found.evaluate(result(), [TRUTH])

    assert "count_error.yaml" in caught.value.why


def test_numpy_numbers_are_numbers(folder: Path) -> None:
    code = "import numpy\ndef evaluate(results, ground_truths): return {'scores': {'s': numpy.float32(0.5)}}"

    assert method(folder, code).evaluate(result(), [TRUTH]) == {"s": 0.5}


def test_the_version_follows_the_code(folder: Path) -> None:
    before = method(folder).version

    assert method(folder, "def evaluate(results, ground_truths): return {'s': 3}").version != before
