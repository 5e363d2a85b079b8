"""Whatever BenchBot writes beside a result is not taken for one: the folder has the result's score."""

import json
import shutil
import zipfile
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine, Here

FINDS_THE_BOTTLE = """\
import json, time
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.reset()
benchbot.step("move_next")
bottle = {"label_probs": [1, 0], "centroid": [0, 0, 0.5], "extent": [1, 1, 1]}
results = {"objects": [bottle], "class_list": ["bottle", "background"]}
with open(benchbot.result_filename, "w") as file:
    json.dump({**benchbot.empty_results(), "results": results}, file)
"""
"""Scores 1, so that any other file that counts lowers the score."""
TRUTH = ("--ground-truth", "truth.json")
FORMS = ("html", "csv", "tex", "md", "xml")
RECORDERS = plugin_manager.load().pool("recorders")


@pytest.fixture
def work(result_folder: CommandLine) -> CommandLine:
    """The folder `runs`, empty, in which a solution, and ground truth beside it, are at hand."""
    for name in ("perfect", "empty", "broken"):
        (result_folder.folder / f"{name}.json").unlink()
    (result_folder.folder / "runs").mkdir()
    return result_folder


def submit(work: CommandLine, *words: str) -> None:
    solution = work.script("solution.py", FINDS_THE_BOTTLE)
    done = work("submit", "--native", solution, *SELECTION, *words)
    assert done.returncode == 0, done.stderr


def has_the_true_score(here: Here, path: str, results: int = 1) -> None:
    """Assert what eval, report and compare say of a folder, whose own files are left aside in a line."""
    done = here("eval", path, *TRUTH, "-o", "elsewhere.json")
    assert done.stdout == "OMQ 1.0000\n", done.stderr
    assert "of BenchBot's own left aside" in done.stderr
    assert "missing" not in done.stderr
    forms = [word for form in ("csv", "tex", "xml") for word in ("-o", f"table.{form}")]
    assert here("report", path, *TRUTH, *forms).returncode == 0
    assert Path("table.csv").read_text().count(",OMQ,1.0,") == results
    assert f"all &{' 1.000 &' * 5} {results} " in Path("table.tex").read_text()
    assert f'tests="{results}" failures="0" errors="0"' in Path("table.xml").read_text()
    done = here("compare", f"a={path}", f"b={path}", *TRUTH, "--over", "environments", "--json")
    assert [item["score"] for item in json.loads(done.stdout)["sets"]] == [1.0, 1.0]


def test_recordings_of_every_kind_beside_results(work: CommandLine, here: Here) -> None:
    work.variables["BENCHBOT_PLUGINS"] += "".join(f",{recorder.distribution}" for recorder in RECORDERS.values())
    beside = [word for name in RECORDERS for word in ("--record", name)]
    elsewhere = [word for name in RECORDERS for word in ("--record", f"{name}=runs/seed_1/{name}")]
    submit(work, "-r", "runs/result.json", *beside)
    submit(work, "-r", "runs/seed_1/result.json", "--seed", "1", *elsewhere)
    for name in RECORDERS:
        for folder in (work.folder / "runs" / "result-recordings" / name, work.folder / "runs" / "seed_1" / name):
            assert (folder / "recording.json").is_file()
    has_the_true_score(here, "runs", 2)

    for name in RECORDERS:  # as by --record NAME=runs/seed_1
        shutil.copytree(work.folder / "runs" / "seed_1" / name, work.folder / "runs" / "seed_1", dirs_exist_ok=True)
    has_the_true_score(here, "runs", 2)


def test_everything_that_is_made_of_results(work: CommandLine, here: Here) -> None:
    submit(work, "-r", "runs/result.json")
    result = "runs/result.json"
    for words in (
        ("eval", result, *TRUTH, "-o", "runs/any_name.json", "--explain", "runs/why.json"),
        ("eval", result, *TRUTH, "-o", "runs/scores.json"),
        ("report", result, *TRUTH, *(word for form in FORMS for word in ("-o", f"runs/report.{form}"))),
        ("bundle", result, "--solution", "solution.py", "--evaluate-with", "omq", *TRUTH, "-o", "runs/bundle.zip"),
    ):
        done = here(*words)
        assert done.returncode == 0, done.stderr
    done = here("compare", f"a={result}", f"b={result}", *TRUTH, "--over", "environments", "--json")
    (work.folder / "runs" / "comparison.json").write_text(done.stdout)
    with zipfile.ZipFile(work.folder / "runs" / "bundle.zip") as bundle:
        bundle.extractall(work.folder / "runs" / "unpacked")
    shutil.copy(work.folder / "truth.json", work.folder / "runs" / "truth.json")

    done = here("eval", "runs", *TRUTH)

    assert done.stdout == "OMQ 1.0000\n", done.stderr
    assert "1 of 1 scored" in done.stderr
    assert "counts once" in done.stderr


def test_a_batch_and_what_is_made_at_its_end(work: CommandLine, here: Here) -> None:
    solution = work.script("solution.py", FINDS_THE_BOTTLE)
    where = ("--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1", "--seeds", "0..2")
    words = ("--record", "steps,frames", "--zip", "--jobs", "1", "-o", "runs/night")
    done = work("batch", "--native", solution, *where, *words)
    assert done.returncode == 0, done.stderr
    for form in FORMS:
        assert here("report", "runs/night", *TRUTH, "-o", f"runs/night/report.{form}").returncode == 0
    assert here("eval", "runs/night", *TRUTH, "-o", "runs/night/scores.json").returncode == 0

    for path in ("runs/night", "runs"):
        has_the_true_score(here, path, 3)

    shutil.rmtree(next((work.folder / "runs" / "night" / "episodes").iterdir()))
    shutil.rmtree(work.folder / "runs" / "night" / "results")
    done = here("eval", "runs/night", *TRUTH)
    assert done.stdout == "OMQ 0.6667\n"
    assert "2 of 3 scored" in done.stderr
    assert "Its batch has not finished this episode." in done.stderr


def test_a_folder_of_recordings_named_beside_its_result_is_no_result_and_said(work: CommandLine, here: Here) -> None:
    submit(work, "-r", "runs/result.json", "--record", "steps")

    done = here("eval", "runs/result.json", "runs/result-recordings", *TRUTH)

    assert done.stdout == "OMQ 1.0000\n", done.stderr
    assert "warning: There is no result in runs/result-recordings." in done.stderr
    assert here("eval", "runs/result-recordings", *TRUTH).returncode == 2
