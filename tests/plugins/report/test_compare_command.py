import json
import math
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from tests.command_line import CommandLine, Here

TRUTH = ("--ground-truth", "truth.json")


@pytest.fixture
def sets(result_folder: CommandLine) -> CommandLine:
    """`good` and `bad`: scores documents of eight places each, beside the results of arena:1."""
    for name, shift in (("good", 0.1), ("bad", 0.0)):
        rows: list[dict[str, Any]] = [
            {
                "source": f"{place}.json",
                "environment": f"place{place}:1",
                "seed": 0,
                "episode": None,
                "repeat": None,
                "scores": {"OMQ": 0.3 + 0.05 * place + shift * (1 + 0.1 * place)},
                "ground_truths": [],
                "failure": None,
                "provenance": None,
            }
            for place in range(8)
        ]
        document = {
            "version": 1,
            "method": {"name": "omq", "version": "1.0", "headline": "OMQ"},
            "task_details": {"name": "semantic_slam:passive:ground_truth"},
            "environment_details": [],
            "scores": {"OMQ": sum(row["scores"]["OMQ"] for row in rows) / len(rows)},
            "rows": rows,
            "coverage": {"expected": 8, "scored": 8, "missing": [], "skipped": []},
        }
        (result_folder.folder / f"{name}.json").write_text(json.dumps(document))
    return result_folder


@pytest.mark.usefixtures("sets")
def test_two_sets_are_compared(here: Here) -> None:
    done = here("compare", "good.json", "bad.json")

    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split()[:2] == ["good", "0.6100"]
    assert lines[2].split()[:4] == ["good", "-", "bad", "+0.1350"]
    assert lines[-1].startswith("good scores higher than bad by 0.135 OMQ (95 % interval 0.11")
    assert lines[-1].endswith("paired permutation test over 8 pairs of results in 8 places, p = 0.00781).")
    assert done.stderr == "\n"


@pytest.mark.usefixtures("sets")
def test_the_document_keeps_to_its_schema(here: Here) -> None:
    done = here("compare", "after=good.json", "before=bad.json", "--json")

    document = json.loads(done.stdout)
    assert schema.problems(document, "comparison", Path("comparison.json")) == []
    assert [item["name"] for item in document["sets"]] == ["after", "before"]
    # The differences are 0.10, 0.11, … 0.17; Student's t at 7 degrees of freedom is 2.3646 and 0.8960.
    detectable = (2.3646 + 0.8960) * 0.01 * math.sqrt(6 / 8)
    assert document["comparisons"][0]["minimum_detectable"] == pytest.approx(detectable, abs=1e-6)


def test_other_middleware_and_broken_robots_are_told(sets: CommandLine, here: Here) -> None:
    for name, middleware, despite in (("good", "rmw_fastrtps_cpp", ["e-stop"]), ("bad", "rmw_zenoh_cpp", [])):
        document = json.loads((sets.folder / f"{name}.json").read_text())
        driver = {"middleware": middleware, "domain": 3, "clocks": {"/odom": {"median_s": 0.1}}}
        document["rows"][0]["provenance"] = {"robot": {"findings": [], "despite": despite, "driver": driver}}
        (sets.folder / f"{name}.json").write_text(json.dumps(document))

    told = here("compare", "good.json", "bad.json").stderr.splitlines()

    assert "The robot's middleware differs: rmw_fastrtps_cpp (good); rmw_zenoh_cpp (bad)." in told
    assert "good: 1 of 8 results despite a broken robot (e-stop)." in told
    assert not any("domain" in line or "clocks" in line for line in told)


def test_results_are_scored_and_few_places_are_said_to_be_few(result_folder: CommandLine, here: Here) -> None:
    with zipfile.ZipFile(result_folder.folder / "old.zip", "w") as archive:
        archive.write(result_folder.folder / "empty.json", "1.json")

    done = here("compare", "perfect.json", "old.zip", *TRUTH)

    assert done.returncode == 0, done.stderr
    assert "1 pair of results in 1 place cannot tell perfect and old apart" in done.stdout
    assert "6 places or more can." in done.stdout
    assert "--over environments" in done.stderr


def test_what_does_not_take_part_is_named(sets: CommandLine, here: Here) -> None:
    document = json.loads((sets.folder / "bad.json").read_text())
    del document["rows"][0]
    document["scores"]["OMQ"] = sum(row["scores"]["OMQ"] for row in document["rows"]) / 7
    (sets.folder / "bad.json").write_text(json.dumps(document))

    assert "Only in good, left out: place0:1, seed 0" in here("compare", "good.json", "bad.json").stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["good.json"], "nothing to compare with"),
        (["good.json", "good.json"], "2 sets are called 'good'."),
        (["good.json", "perfect.json", *TRUTH], "The task differs"),
        (["good.json", "none.json"], "There is no such file."),
        (["good.json", "truth.json"], "truth.json"),
        (["good.json", "bad.json", "--score", "OMG"], "Did you mean 'OMQ'?"),
        (["good.json", "bad.json", "--over", "seeds"], "seeds"),
        ([], "Missing argument"),
    ],
)
@pytest.mark.usefixtures("sets")
def test_what_cannot_be_compared_is_told(words: list[str], message: str, here: Here) -> None:
    done = here("compare", *words)

    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_the_command_writes_page_table_and_figure(sets: CommandLine, here: Here) -> None:
    done = here("compare", "new_one=good.json", "old=bad.json", "-o", "table.tex", "-o", "figure.svg", "-o", "all.json")

    assert done.returncode == 0, done.stderr
    table = (sets.folder / "table.tex").read_text()
    assert r"Environment & new\_one & old & new\_one $-$ old \\" in table
    assert r"place0:1 & 0.400 & 0.300 & +0.100 \\" in table
    assert re.search(r"all & 0\.610 & 0\.475 & \+0\.135 \[\+0\.\d{3}, \+0\.\d{3}\]", table)
    assert table.count(r"\midrule") == 2
    assert (sets.folder / "figure.svg").read_text().startswith("<?xml")
    assert (sets.folder / "all.json").exists()


@pytest.mark.usefixtures("sets")
def test_what_cannot_be_written_is_refused_before_anything_is_scored(here: Here) -> None:
    told = here("compare", "good.json", "bad.json", "-o", "table.docx")
    assert told.returncode == 2
    assert "table.tex for the paper's table" in told.stderr
    told = here("compare", "good.json", "bad.json", "--paired-by", "scene", "-o", "table.tex")
    assert "Scene by scene there is no table" in told.stderr
    told = here("report", "a=good.json", "--format", "csv")
    assert "Sets side by side make a page" in told.stderr


def test_what_went_wrong_is_told_of_results_and_not_of_scores(result_folder: CommandLine, here: Here) -> None:
    (result_folder.folder / "other.json").write_bytes((result_folder.folder / "perfect.json").read_bytes())
    document = json.loads((result_folder.folder / "perfect.json").read_text())
    missed = len(document["results"]["objects"])
    document["results"]["objects"] = []
    (result_folder.folder / "empty.json").write_text(json.dumps(document))

    told = json.loads(here("compare", "perfect.json", "empty.json", *TRUTH, "--explain", "--json").stdout)

    assert schema.problems(told, "comparison", Path("comparison.json")) == []
    assert told["errors"]["perfect"] == []
    assert told["errors"]["empty"] == [{"kind": "missed", "count": missed, "gain": 1.0}]
    told_lines = here("compare", "perfect.json", "empty.json", *TRUTH, "--explain").stdout.splitlines()
    assert ["missed", "-", "-", str(missed), "1.00"] in [line.split() for line in told_lines]


@pytest.mark.usefixtures("sets")
def test_scores_do_not_say_what_went_wrong(here: Here) -> None:
    assert "Give the results instead of their scores" in here("compare", "good.json", "bad.json", "--explain").stderr
