"""Bad input, by mistake or to do harm: each is told by file and place, and the other results are scored."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.command_line import BOTTLE, CommandLine, Here

Spoil = Callable[[dict[str, Any]], str]


def changed(key: str, value: Any) -> Spoil:
    """Return what sets a key of the first object."""

    def spoil(document: dict[str, Any]) -> str:
        document["results"]["objects"][0][key] = value
        return json.dumps(document)

    return spoil


def replaced(**keys: Any) -> Spoil:
    """Return what sets keys of the document."""
    return lambda document: json.dumps(document | keys)


BAD: dict[str, tuple[Spoil, str]] = {
    "truncated": (lambda document: json.dumps(document)[:-40], "not valid JSON: "),
    "nan": (changed("centroid", [0, float("nan"), 0]), "not finite, at /results/objects/0/centroid/1"),
    "inf": (changed("label_probs", [float("inf"), 0]), "not finite, at /results/objects/0/label_probs/0"),
    "depth": (
        lambda document: json.dumps(document)[:-1] + ', "deep": ' + "[" * 500 + "]" * 500 + "}",
        "nested deeper than 100 levels, at /deep/0/0",
    ),
    "negative extent": (changed("extent", [1, -1, 1]), "results.objects[0].extent[1]: must be from 0"),
    "wrong length": (changed("label_probs", [1]), "results.objects[0].label_probs: 1 numbers, class_list has 2"),
    "box of two": (changed("centroid", [1, 2]), "results.objects[0].centroid: 2 numbers, must be 3"),
    "text": (changed("extent", ["1", 1, 1]), "results.objects[0].extent[0]: must be a number, not text"),
    "no objects": (replaced(results={"class_list": ["bottle"]}), "results.objects: is missing"),
    "unknown version": (replaced(version=7), "a result of version 7; this BenchBot reads version 1"),
    "unknown format": (replaced(task_details={"name": "sample:passive", "results_format": "map"}), "different tasks"),
    "no environment": (replaced(environment_details=[]), "/environment_details"),
    "two environments": (
        replaced(environment_details=[{"name": "arena", "variant": 1}, {"name": "flat", "variant": 1}]),
        "Its scenes are of different environments: arena, flat",
    ),
}


@pytest.mark.parametrize("name", sorted(BAD.keys() - {"unknown format"}))
def test_a_bad_result_is_told_by_file_and_place_and_the_others_are_scored(
    result_folder: CommandLine, here: Here, name: str
) -> None:
    spoil, place = BAD[name]
    (result_folder.folder / "bad.json").write_text(
        spoil(json.loads((result_folder.folder / "perfect.json").read_text()))
    )

    done = here("eval", "perfect.json", "bad.json", "--ground-truth", "truth.json")

    assert done.returncode == 0, done.stderr
    assert done.stdout == "OMQ 0.5000\n"
    assert "1 of 2 scored" in done.stderr
    (line,) = (line for line in done.stderr.splitlines() if "missing:" in line)
    assert "(bad.json)" in line
    assert place in done.stderr


def test_mixed_tasks_are_told_with_their_files(result_folder: CommandLine, here: Here) -> None:
    spoil, _ = BAD["unknown format"]
    (result_folder.folder / "other.json").write_text(
        spoil(json.loads((result_folder.folder / "perfect.json").read_text()))
    )

    done = here("eval", "perfect.json", "other.json", "--ground-truth", "truth.json")

    assert done.returncode == 2
    assert "of 'sample:passive' (object_map): perfect.json" in done.stderr
    assert "of 'sample:passive' (map): other.json" in done.stderr
    assert not (result_folder.folder / "scores.json").exists()


def test_archives_that_would_do_harm_are_told_and_what_is_sound_in_them_is_scored(
    result_folder: CommandLine, here: Here
) -> None:
    sound = (result_folder.folder / "perfect.json").read_text()
    with zipfile.ZipFile(result_folder.folder / "bad.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("sound.json", sound)
        archive.writestr("../climbing.json", sound)
        archive.writestr("bomb.json", b" " * (32 * 2**20))
    before = sorted(result_folder.home.parent.rglob("*"))

    done = here("eval", "bad.zip", "--ground-truth", "truth.json", "-o", "out.json")

    assert done.returncode == 0, done.stderr
    assert done.stdout == "OMQ 0.3333\n"
    assert "(bad.zip:../climbing.json): Its name leads out of the archive" in done.stderr
    assert "(bad.zip:bomb.json): It is compressed more than 500-fold" in done.stderr
    made = {path.name for path in set(result_folder.home.parent.rglob("*")) - set(before)}
    assert made == {"out.json"}


def test_two_results_of_one_episode_are_told_with_both_files(result_folder: CommandLine, here: Here) -> None:
    provenance = {
        "benchbot": "1",
        "plugins": {},
        "selection": {"task": "t", "robot": "r", "environment": "arena:1", "seed": 5},
        "steps": 1,
        "simulated_time_s": 1.0,
        "failure": None,
        "observation_digest": "0",
    }
    for name in ("perfect", "empty"):
        path = result_folder.folder / f"{name}.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"provenance": provenance}))
    (result_folder.folder / "copy.json").write_bytes((result_folder.folder / "perfect.json").read_bytes())

    contradictory = here("eval", "perfect.json", "empty.json", "--ground-truth", "truth.json")
    same = here("eval", "perfect.json", "copy.json", "--ground-truth", "truth.json")

    assert contradictory.returncode == 2
    assert "perfect.json and empty.json are all of arena:1, seed 5, and differ" in contradictory.stderr
    assert same.stdout == "OMQ 1.0000\n"
    assert "left out: copy.json: It is the same result as perfect.json, and counts once." in same.stderr


@pytest.mark.slow
def test_fifty_thousand_objects_are_scored_in_bounded_time_and_memory(result_folder: CommandLine) -> None:
    document = json.loads((result_folder.folder / "perfect.json").read_text())
    far = [{"label_probs": [0.5, 0.5], "centroid": [9 + n, 0, 0], "extent": [1, 1, 1]} for n in range(49_999)]
    document["results"]["objects"] = [{"label_probs": [1, 0], **BOTTLE}, *far]
    (result_folder.folder / "huge.json").write_text(json.dumps(document))

    # The command line ends a process that takes two minutes; this takes seconds.
    done = result_folder("eval", "huge.json", "--ground-truth", "truth.json", "--explain", "why.json")

    assert done.returncode == 0, done.stderr
    scores = json.loads((result_folder.folder / "scores.json").read_text())["scores"]
    assert scores["OMQ"] == pytest.approx(1 / (1 + 49_999 / 2))
    why = json.loads((result_folder.folder / "why.json").read_text())
    assert len(why["results"][0]["objects"]) == 50_000


def test_a_folder_of_results_is_scored_and_explained(result_folder: CommandLine, here: Here, tmp_path: Path) -> None:
    folder = result_folder.folder / "runs" / "1"
    folder.mkdir(parents=True)
    for name in ("perfect", "broken"):
        (result_folder.folder / f"{name}.json").rename(folder / f"{name}.json")

    out, why = folder / "scores.json", folder / "why.json"
    words = ("eval", "runs", "--ground-truth", "truth.json", "-o", str(out), "--explain", str(why), "--json")
    first = here(*words, "--missing", "leave-out")
    second = here(*words, "--missing", "zero")

    assert first.returncode == second.returncode == 0, first.stderr + second.stderr
    assert json.loads(first.stdout)["scores"]["OMQ"] == 1.0
    assert "1 of 2 scored; the missing are left out" in first.stderr
    assert json.loads(second.stdout)["scores"]["OMQ"] == 0.5
    assert f"Explanation, with ground truth: {why}" in second.stderr
    assert json.loads(why.read_text())["results"][0]["objects"][0]["verdict"] == "match"
    assert "What went wrong" not in second.stderr


def test_what_went_wrong_is_told_on_the_terminal(result_folder: CommandLine) -> None:
    result = json.loads((result_folder.folder / "perfect.json").read_text())
    result["results"]["objects"] = []
    (result_folder.folder / "empty.json").write_text(json.dumps(result))

    done = result_folder("eval", "empty.json", "--ground-truth", "truth.json", "--explain", "why.json")

    assert done.returncode == 0, done.stderr
    assert done.stdout == "OMQ 0.0000\n"
    assert "  missed         1  +1.00\n  hint: The map is empty.\n" in done.stderr
