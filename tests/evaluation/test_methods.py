"""Which method scores: the one that is named, the task's own, or the only one that reads the format."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins, installed
from benchbot.evaluation.score import evaluate_files, method_for_task
from tests.made_results import Make, Save, chair, ground_truth
from tests.plugin_factory import PluginFactory

COUNT = """\
from math import nan
from pathlib import Path
from benchbot.plugin import hookimpl
from benchbot.plugin import Evaluator

@hookimpl
def benchbot_evaluators():
    formats = frozenset({"object_map"})
    yield Evaluator(
        name="count",
        version="1",
        headline="count",
        result_formats=formats,
        ground_truth_formats=frozenset({"object_map_ground_truth"}),
        evaluate=lambda result, truths: {"truths": len(truths), "count": float(len(result["results"]["objects"]))},
        combine=lambda scores: {
            key: float(sum(score.get(key, 0.0) for score in scores)) for key in ("truths", "count")
        },
    )
    yield Evaluator(
        name="length",
        version="1",
        headline="",
        result_formats=frozenset({"object_map"}),
        ground_truth_formats=frozenset(),
        evaluate=lambda result, truths: {"length": len(result["results"]["objects"]) + 100.0 * len(truths) or nan},
        combine=lambda scores: {"length": sum(score.get("length", 0.0) for score in scores)},
    )

@hookimpl
def benchbot_tasks():
    yield Path(__file__).parent / "tasks"
"""
COUNTING = """\
name: counting
actions: [move_next]
observations: [poses]
results_format: object_map
evaluation_method: count
"""


@pytest.fixture
def catalog(tmp_path: Path) -> Iterator[Catalog]:
    """All installed plug-ins, and one with a second method for object maps and a task that asks for it."""
    sys.path.insert(0, str(tmp_path))
    PluginFactory(tmp_path).make("counting-for-evaluation", COUNT, {"tasks/counting.yaml": COUNTING})
    yield Catalog(Plugins(installed()))
    sys.path.remove(str(tmp_path))
    sys.modules.pop("counting_for_evaluation", None)


@pytest.mark.parametrize(
    ("task", "name", "method"),
    [
        ({"name": "mapping", "results_format": "object_map", "evaluation_method": "count"}, None, "count"),
        ({"name": "counting", "results_format": "object_map"}, None, "count"),
        ({"name": "counting", "results_format": "object_map", "evaluation_method": "omq"}, None, "omq"),
        ({"name": "counting", "results_format": "object_map"}, "omq", "omq"),
        ({"name": "changes", "results_format": "object_map_with_states"}, None, "omq"),
    ],
)
def test_the_named_method_goes_before_the_task_s_own_and_that_before_the_only_one(
    catalog: Catalog, task: dict[str, Any], name: str | None, method: str
) -> None:
    assert method_for_task(catalog, name, task).name == method


def test_of_several_methods_none_is_chosen_silently(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="several methods") as caught:
        method_for_task(catalog, None, {"name": "mapping", "results_format": "object_map"})

    assert "count, length, omq" in caught.value.why
    assert "--method" in caught.value.fix


def test_a_task_whose_method_is_not_installed_is_told(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="'cuont' is not an installed evaluator"):
        method_for_task(catalog, None, {"name": "m", "results_format": "object_map", "evaluation_method": "cuont"})


@pytest.mark.parametrize(("method", "headline"), [("count", "count"), ("length", "length")])
def test_the_headline_is_the_one_that_the_method_names_else_its_first_score(
    catalog: Catalog, make_result: Make, save: Save, method: str, headline: str
) -> None:
    truth = save("truth.json", ground_truth(1, chair(0.0)))

    document = evaluate_files(
        [save("a.json", make_result(0.0))], catalog=catalog, method=method, ground_truth_paths=[truth]
    )

    assert document["method"]["headline"] == headline
    assert document["scores"] == ({"truths": 1.0, "count": 1.0} if method == "count" else {"length": 1.0})


def test_a_named_method_must_read_the_format_of_the_results(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="The method 'count' cannot score these results") as caught:
        method_for_task(catalog, "count", {"name": "changes", "results_format": "object_map_with_states"})

    assert caught.value.why == "They have the format 'object_map_with_states'; it reads: object_map."


def test_a_score_that_is_no_number_counts_as_a_missing_result(catalog: Catalog, make_result: Make, save: Save) -> None:
    paths = [save("empty.json", make_result()), save("a.json", make_result(0.0, variant=2))]

    document = evaluate_files(paths, catalog=catalog, method="length")

    assert document["scores"] == {"length": 1.0}
    (missing,) = document["coverage"]["missing"]
    assert missing["environment"] == "flat:1"
    assert f"The method 'length' gave no usable score. length of {paths[0]} is nan." in missing["reason"]
    with pytest.raises(BenchbotError, match="gave no usable score"):
        evaluate_files(paths[:1], catalog=catalog, method="length")


def test_a_method_without_ground_truth_is_given_none(catalog: Catalog, make_result: Make, save: Save) -> None:
    document = evaluate_files([save("a.json", make_result(0.0, 1.0, variant=77))], catalog=catalog, method="length")

    assert document["scores"] == {"length": 2.0}
    assert document["rows"][0]["ground_truths"] == []
