"""The names of v2's evaluation, for people who call it from Python."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.results import read_scores
from benchbot_eval import Evaluator, GroundTruthCreator, Validator
from benchbot_eval.evaluator import Validator as ValidatorOfEvaluator
from tests.made_results import Make, Save


@pytest.fixture(autouse=True)
def flats(catalog: Catalog, monkeypatch: pytest.MonkeyPatch) -> None:
    """The plug-in with flats is among the installed ones, and nothing was validated yet."""
    monkeypatch.setattr("benchbot_eval.validator._validated", [])
    plugin_manager.load.cache_clear()


def test_what_was_validated_is_scored_as_in_v2(
    make_result: Make, save: Save, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(save("a.json", make_result(0.0, 3.0))), str(save("b.json", make_result(variant=2)))]

    assert Validator(files, required_envs=["flat:1", "flat:3"]).validate_results_data()
    document = Evaluator("omq", str(tmp_path / "scores.json")).evaluate()

    assert document["scores"]["OMQ"] == 0.5
    assert read_scores(tmp_path / "scores.json") == document
    assert "missing: flat:3" in capsys.readouterr().out


def test_a_single_file_may_be_named_alone(
    make_result: Make, save: Save, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Validator(save("a.json", make_result(0.0, 3.0)))
    evaluator = Evaluator(None, tmp_path / "scores.json", skip_load=True, print_all=False)
    evaluator.load_validator()

    assert evaluator.evaluate()["scores"]["OMQ"] == 1.0
    assert capsys.readouterr().out == "OMQ 1.0000\n"


def test_results_that_are_not_valid_are_told(make_result: Make, save: Save, tmp_path: Path) -> None:
    broken = make_result(0.0)
    broken["results"]["objects"][0]["extent"] = [1.0, -1.0, 1.0]

    with pytest.raises(BenchbotError, match=r"b\.json.*extent\[1\]"):
        ValidatorOfEvaluator([save("a.json", make_result()), save("b.json", broken)])
    with pytest.raises(BenchbotError, match="no validated results"):
        Evaluator("omq", tmp_path / "scores.json")


def test_a_ground_truth_begins_with_its_environment_and_format(tmp_path: Path) -> None:
    creator = GroundTruthCreator("object_map_ground_truth", "flat:2")

    truth = creator.create_empty()
    truth["ground_truth"]["objects"].append(creator.function("create_object")() | {"class": "chair"})

    assert truth["environment"]["variant"] == 2
    assert truth["format"]["name"] == "object_map_ground_truth"
    assert creator.functions() == ["create", "create_object", "validate"]
    assert schema.problems(json.loads(json.dumps(truth)), "ground_truth", tmp_path) == []


@pytest.mark.parametrize(
    ("form", "environment", "text"),
    [
        ("object_map_ground_thruth", "flat:1", "Did you mean 'object_map_ground_truth'"),
        ("object_map_ground_truth", "flat:9", "'flat:9' is not a known environment"),
        ("object_map_ground_truth", "flat:1:2", "'flat:1:2' names 2 scenes"),
    ],
)
def test_names_that_are_unknown_are_told(form: str, environment: str, text: str) -> None:
    with pytest.raises(BenchbotError, match=text):
        GroundTruthCreator(form, environment)


def test_a_function_that_is_unknown_is_told() -> None:
    with pytest.raises(BenchbotError, match="It has: create, create_object, validate"):
        GroundTruthCreator("object_map_ground_truth", "flat:1").function("make")


def test_importing_the_names_imports_nothing_heavy() -> None:
    code = "import sys, benchbot_eval; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert not {"numpy", "scipy", "jsonschema", "yaml"} & set(done.stdout.split())


def test_results_are_read_by_v2s_helper(tmp_path: Path) -> None:
    from benchbot_eval.helpers import load_results

    document = {"task_details": {"name": "t"}, "environment_details": [{"name": "e", "variant": 1}], "results": {}}
    (tmp_path / "a.json").write_text(json.dumps(document))
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as archive:
        archive.writestr("c.json", json.dumps(document))
    found = load_results([tmp_path / "a.json", tmp_path / "b.zip"])
    assert list(found) == [str(tmp_path / "a.json"), f"{tmp_path / 'b.zip'}:c.json"]
    assert all(each["task_details"]["name"] == "t" for each in found.values())
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(BenchbotError, match=r"a\.json is no result"):
        load_results(str(tmp_path / "a.json"))
