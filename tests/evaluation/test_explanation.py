"""Explanations of scores."""

from dataclasses import replace
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation.score import explain, score_files, write_explanation
from tests.made_results import Make, MakeRun, Save


def test_every_scored_result_is_explained_in_the_order_of_the_rows(
    catalog: Catalog, make_run: MakeRun, make_result: Make, save: Save, tmp_path: Path
) -> None:
    files = [save("a.json", make_run(0.0, seed=4)), save("b.json", "no"), save("c.json", make_result(variant=2))]
    evaluation = score_files(files, catalog=catalog)

    document = explain(evaluation)

    assert [entry["source"] for entry in document["results"]] == [str(files[0]), str(files[2])]
    first, second = document["results"]
    assert (first["environment"], first["seed"]) == ("flat:1", 4)
    assert [item["verdict"] for item in first["objects"]] == ["match", "false_negative"]
    assert [item["why"] for item in second["objects"]] == ["The map is empty."]
    write_explanation(tmp_path / "why.json", document)
    assert schema.read(tmp_path / "why.json") == document


def test_a_method_that_does_not_explain_is_told(catalog: Catalog, make_result: Make, save: Save) -> None:
    evaluation = score_files([save("a.json", make_result())], catalog=catalog)
    silent = replace(evaluation, evaluator=replace(evaluation.evaluator, explain=None))

    with pytest.raises(BenchbotError, match="'omq' does not explain"):
        explain(silent)
