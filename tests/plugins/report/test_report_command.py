import csv
import json
import os
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.command_line import CommandLine, Here

TRUTH = ("--ground-truth", "truth.json")


def test_a_page_is_made_of_a_result(result_folder: CommandLine, here: Here) -> None:
    done = here("report", "perfect.json", *TRUTH)

    assert (done.returncode, done.stdout) == (0, "report.html\n"), done.stderr
    html = (result_folder.folder / "report.html").read_text("utf-8")
    assert html.startswith("<!doctype html>")
    assert "arena:1" in html
    assert (result_folder.folder / "report.html").stat().st_mode & 0o777 == 0o666 & ~_umask()


def test_several_forms_are_made_at_once_as_their_names_end(result_folder: CommandLine, here: Here) -> None:
    names = ["out/a.html", "out/a.csv", "out/a.tex", "out/a.md", "out/a.xml"]

    done = here("report", "perfect.json", "broken.json", *TRUTH, *(word for name in names for word in ("-o", name)))

    assert (done.returncode, done.stdout.split()) == (0, names), done.stderr
    suites = ET.fromstring((result_folder.folder / "out/a.xml").read_bytes())
    assert (suites.get("tests"), suites.get("failures")) == ("2", "1")
    rows = list(csv.DictReader((result_folder.folder / "out/a.csv").open()))
    assert {row["status"] for row in rows} == {"scored", "missing"}
    assert r"\toprule" in (result_folder.folder / "out/a.tex").read_text()
    assert "**OMQ 0.500**" in (result_folder.folder / "out/a.md").read_text()


def test_a_format_without_a_file_goes_to_stdout(result_folder: CommandLine, here: Here) -> None:
    done = here("report", "perfect.json", *TRUTH, "--format", "md", "--name", "Mine")
    assert (done.returncode, done.stdout.splitlines()[0]) == (0, "# Mine"), done.stderr
    assert not (result_folder.folder / "report.html").exists()

    done = here("report", "perfect.json", *TRUTH, "--format", "csv", "-o", "table.txt")
    assert (done.returncode, done.stdout) == (0, "table.txt\n")
    assert (result_folder.folder / "table.txt").read_text().startswith("environment,")


def test_the_missing_are_left_out_when_that_is_wanted(result_folder: CommandLine, here: Here) -> None:
    done = here("report", "perfect.json", "broken.json", *TRUTH, "--format", "md", "--missing", "leave-out")

    assert "**OMQ 1.000**" in done.stdout
    assert "1 of 2 results scored; 1 missing, left out" in done.stdout


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["missing.json"], "missing.json"),
        (["perfect.json"], "no ground truth of the environment 'arena:1'"),
        (["perfect.json", *TRUTH, "-o", "report.pdf"], "not known what to write into report.pdf"),
        (["perfect.json", *TRUTH, "--frames", "."], "There are no frames in ."),
        (["perfect.json", "empty.json", *TRUTH, "--frames", "seen"], "not known to belong to one result"),
        (["perfect.json", *TRUTH, "--required-envs", "arena:1", "--required-envs-batch", "b"], "named twice"),
        (["perfect.json", *TRUTH, "-o", "truth.json/report.html"], "Cannot write truth.json/report.html"),
    ],
)
def test_what_cannot_be_reported_is_told(result_folder: CommandLine, here: Here, words: list[str], why: str) -> None:
    (result_folder.folder / "seen").mkdir()
    (result_folder.folder / "seen" / "00000.jpg").touch()

    done = here("report", *words)

    assert done.returncode in (2, 3)
    assert why in done.stderr
    assert done.stdout == ""
    assert not (result_folder.folder / "report.html").exists()


def test_frames_that_were_recorded_are_shown(result_folder: CommandLine, here: Here) -> None:
    run = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1")
    done = result_folder(
        "submit", *run, "--example", "hello_passive", "--record", "frames=run/frames", "-r", "run/result.json"
    )
    assert done.returncode == 0, done.stderr

    for words in (["run/result.json"], ["run"], ["run/result.json", "--frames", "run/frames"]):
        done = here("report", *words, *TRUTH)
        assert done.returncode == 0, done.stderr
        html = (result_folder.folder / "report.html").read_text("utf-8")
        assert html.count("What the camera saw at place") == 3
        assert "hello_passive" in html
    track = json.loads((result_folder.folder / "run/result.json").read_text())["track"]
    assert f"{track[0]['path_length_m']:.1f} m" in html


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_folder_of_results_is_one_report(result_folder: CommandLine, here: Here) -> None:
    for name in ("perfect", "empty"):
        folder = result_folder.folder / "batch" / name
        folder.mkdir(parents=True)
        document = json.loads((result_folder.folder / f"{name}.json").read_text())
        document["environment_details"][0]["name"] = f"arena_{name}"
        Path(folder / "result.json").write_text(json.dumps(document))
        truth = json.loads((result_folder.folder / "truth.json").read_text())
        truth["environment"]["name"] = f"arena_{name}"
        (result_folder.folder / f"truth_{name}.json").write_text(json.dumps(truth))
    truths = ("--ground-truth", "truth_perfect.json", "--ground-truth", "truth_empty.json")

    done = here("report", "batch", *truths, "--format", "md")

    assert done.returncode == 0, done.stderr
    assert "| arena_empty:1 | 0.000 |" in done.stdout
    assert "| arena_perfect:1 | 1.000 |" in done.stdout


def test_what_is_a_sample_of_many_can_be_said(result_folder: CommandLine, here: Here) -> None:
    for variant in range(6):
        document = json.loads((result_folder.folder / "perfect.json").read_text())
        document["environment_details"][0]["variant"] = variant
        (result_folder.folder / "set").mkdir(exist_ok=True)
        (result_folder.folder / "set" / f"{variant}.json").write_text(json.dumps(document))
        truth = json.loads((result_folder.folder / "truth.json").read_text())
        truth["environment"]["variant"] = variant
        (result_folder.folder / "truths").mkdir(exist_ok=True)
        (result_folder.folder / "truths" / f"{variant}.json").write_text(json.dumps(truth))
    for variant in range(3):
        empty = json.loads((result_folder.folder / "empty.json").read_text())
        empty["environment_details"][0]["variant"] = variant
        (result_folder.folder / "set" / f"{variant}.json").write_text(json.dumps(empty))

    words = ("report", "set", "--ground-truth", "truths", "--format", "md")
    over_places, over_environments = here(*words), here(*words, "--over", "environments")

    assert "**OMQ 0.500**" in over_places.stdout, over_places.stderr
    assert "**OMQ 0.500 [" in over_environments.stdout


@pytest.mark.parametrize("option", ["--ground-truth", "--required-envs", "--over", "--missing", "--method"])
def test_an_option_of_scoring_is_explained_alike_wherever_it_is(here: Here, option: str) -> None:
    said = set()
    for command in ("eval", "report", "compare"):
        text = " ".join(here(command, "--help").stdout.split())
        if f" {option} " in text:
            # Up to the next option.
            said.add(re.split(r" (?=-{1,2}[a-z])", text[text.index(f" {option} ") + 1 :])[0])

    assert len(said) == 1


def test_named_sets_make_a_page_side_by_side(result_folder: CommandLine, here: Here) -> None:
    done = here("report", "new=perfect.json", "old=broken.json", *TRUTH)

    assert (done.returncode, done.stdout) == (2, ""), done.stderr  # of the broken one nothing can be scored
    (result_folder.folder / "other.json").write_bytes((result_folder.folder / "perfect.json").read_bytes())
    done = here("report", "new=perfect.json", "old=other.json", *TRUTH, "-o", "both.html", "-o", "both.tex")

    assert (done.returncode, done.stdout.split()) == (0, ["both.html", "both.tex"]), done.stderr
    assert "<title>new, old: OMQ compared</title>" in (result_folder.folder / "both.html").read_text("utf-8")
    assert r"Environment & new & old & new $-$ old" in (result_folder.folder / "both.tex").read_text()
