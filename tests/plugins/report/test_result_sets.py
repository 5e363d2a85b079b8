import json
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.report import result_sets
from tests.made_results import Make, MakeRun, Save


@pytest.fixture
def folder(make_result: Make, save: Save, tmp_path: Path) -> Path:
    """A folder with a set of two results, another with one, and a third with the scores of the first."""
    for name, places in (("new", [[0.0, 3.0], [0.0]]), ("old", [[0.0]])):
        (tmp_path / name).mkdir()
        for variant, found in enumerate(places, 1):
            save(f"{name}/{variant}.json", make_result(*found, variant=variant))
    return tmp_path


def test_results_are_scored_and_scores_are_read(folder: Path, catalog: Catalog) -> None:
    scored = result_sets.read([str(folder / "new"), f"before={folder / 'old' / '1.json'}"], catalog=catalog)
    (folder / "kept.json").write_text(json.dumps(scored[0].document))

    read = result_sets.read([str(folder / "kept.json"), str(folder / "old")], catalog=catalog)

    assert [item.name for item in scored] == ["new", "before"]
    assert [item.name for item in read] == ["kept", "old"]
    assert [row["scores"]["OMQ"] for row in read[0].rows] == [1.0, 1.0]
    assert result_sets.evaluator_of(read, catalog).name == "omq"


def test_documents_called_scores_are_named_by_their_folder(folder: Path, catalog: Catalog) -> None:
    for item in result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog):
        (folder / item.name / "scores.json").write_text(json.dumps(item.document))

    read = result_sets.read([str(folder / name / "scores.json") for name in ("new", "old")], catalog=catalog)

    assert [item.name for item in read] == ["new", "old"]


def test_one_set_is_nothing_to_compare(folder: Path, catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="nothing to compare with"):
        result_sets.read([str(folder / "new")], catalog=catalog)


def test_a_file_that_cannot_be_read_is_named(folder: Path, catalog: Catalog) -> None:
    torn = folder / "torn.json"
    torn.write_text('{"scores": {"OMQ": 0.5')
    with pytest.raises(BenchbotError, match=r"torn\.json is not a result") as raised:
        result_sets.read([str(torn), str(folder / "old")], catalog=catalog)

    assert "It is not valid JSON" in raised.value.why


def test_equal_names_are_an_error_that_says_how_to_name_them(folder: Path, catalog: Catalog) -> None:
    other = folder / "yesterday" / "new"
    other.mkdir(parents=True)
    for name, said in (("new", ""), ("same", "same=")):
        with pytest.raises(BenchbotError, match=f"2 sets are called '{name}'") as raised:
            result_sets.read([f"{said}{folder / 'new'}", f"{said}{other}"], catalog=catalog)

        assert raised.value.why == f"They are: {folder / 'new'}, {other}."
        assert "before=PATH" in raised.value.fix


def test_a_path_may_hold_an_equals_sign(folder: Path, catalog: Catalog, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "seed=3").mkdir()
    (folder / "new" / "1.json").rename(folder / "seed=3" / "rays=8.json")
    monkeypatch.chdir(folder)

    sets = result_sets.read(["seed=3", "seed=3/rays=8.json", "again=seed=3"], catalog=catalog)

    assert [item.name for item in sets] == ["seed=3", "rays=8", "again"]
    for missing in ("runs/seed=4", "nowhere"):
        with pytest.raises(BenchbotError, match=f"{missing} is not a result"):
            result_sets.read([missing, "old"], catalog=catalog)


def test_the_robots_and_the_failures_of_a_set_are_counted_by_name(
    folder: Path, make_run: MakeRun, save: Save, catalog: Catalog
) -> None:
    save("new/3.json", make_run(0.0, variant=2, seed=5))
    crashed = make_run(variant=2, seed=6)
    crashed["provenance"]["failure"] = {"class": "collision", "why": "A wall."}
    save("new/4.json", {key: value for key, value in crashed.items() if key != "results"})

    new, old = result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog)

    assert (new.robots, new.failures) == (["r"], {"collision": 1})
    assert (old.robots, old.failures) == ([], {})


def change(document: dict[str, Any], *keys: str | int, value: object) -> None:
    inner: Any = document
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (["task_details", "name"], "scd:passive:ground_truth", "The task differs"),
        (["method", "name"], "other", "The method differs: omq and other"),
        (["method", "version"], "0.9", "The version of the method differs"),
        (["coverage", "missing_counts"], "leave-out", "The way in which missing results count differs"),
        (["rows", 0, "ground_truths", 0, "sha256"], "0" * 64, "different ground truths of flat:1"),
    ],
)
def test_what_was_not_scored_alike_is_not_compared(
    keys: list[str | int], value: object, words: str, folder: Path, catalog: Catalog
) -> None:
    new, old = result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog)
    change(old.document, *keys, value=value)
    for item in (new, old):
        (folder / f"{item.name}.json").write_text(json.dumps(item.document))

    with pytest.raises(BenchbotError, match="'new' and 'old' cannot be compared") as raised:
        result_sets.read([str(folder / "new.json"), str(folder / "old.json")], catalog=catalog)
    assert words in raised.value.why


def test_scores_of_episodes_of_two_versions_are_not_compared(folder: Path, catalog: Catalog) -> None:
    for item in result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog):
        sha256 = ("0" if item.name == "new" else "1") * 64
        episode = {"list": "point_goal:flat:1", "sha256": sha256, "number": 4, "id": "point_goal/flat_1/004"}
        for row in item.document["rows"]:
            row["provenance"] = {"selection": {"episode": episode}}
        (folder / f"{item.name}.json").write_text(json.dumps(item.document))

    with pytest.raises(BenchbotError, match="'new' and 'old' cannot be compared") as raised:
        result_sets.read([str(folder / "new.json"), str(folder / "old.json")], catalog=catalog)
    assert "different versions of the episodes point_goal:flat:1" in raised.value.why


@pytest.mark.parametrize("version", ["0.1", "99.0"])
def test_scores_of_another_version_than_the_installed_one_are_refused(
    version: str, folder: Path, catalog: Catalog
) -> None:
    sets = result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog)
    for item in sets:
        item.document["method"]["version"] = version

    with pytest.raises(BenchbotError, match="another version of the method 'omq'"):
        result_sets.evaluator_of(sets, catalog)


def test_what_was_left_out_is_no_row(folder: Path, make_result: Make, save: Save, catalog: Catalog) -> None:
    save("new/3.json", make_result(0.0, variant=3))  # of which there is no ground truth
    counted, left_out = (
        result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog, missing=missing)[0]
        for missing in ("zero", "leave-out")
    )

    assert [row["scores"] for row in counted.rows][-1] == {}
    assert (len(counted.rows), len(left_out.rows)) == (3, 2)


@pytest.mark.parametrize("value", [0.9, float("nan")])
def test_scores_that_do_not_follow_from_their_rows_are_refused(value: float, folder: Path, catalog: Catalog) -> None:
    sets = result_sets.read([str(folder / "new"), str(folder / "old")], catalog=catalog)
    sets[1].document["scores"]["OMQ"] = value

    with pytest.raises(BenchbotError, match="The scores of 'old' do not follow from its rows"):
        result_sets.evaluator_of(sets, catalog)
