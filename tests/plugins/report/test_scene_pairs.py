"""Two sets side by side, scene by scene."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from benchbot.core import plugin_manager
from benchbot.plugins.report import channel_differences
from benchbot.plugins.report.result_sets import ResultSet
from benchbot.plugins.report.scene_pairs import scene_pairs
from tests.command_line import BOTTLE, CommandLine, Here

TRUTH = ("--ground-truth", "truth.json")
FAR = {"centroid": [5, 5, 0.5], "extent": [1, 1, 1]}
FOUND = {
    "all": [{"label_probs": [1, 0], **BOTTLE}],
    "some": [{"label_probs": [0.6, 0.4], **BOTTLE}],
    "too_many": [{"label_probs": [1, 0], **BOTTLE}, {"label_probs": [1, 0], **FAR}],
    "none": [],
}
SCORES = st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=3, max_size=7)


def result_set(name: str, score: float, *scenes: str) -> ResultSet:
    rows = [
        {"environment": scene, "scores": {"OMQ": score + number / 100}, "source": "none", "provenance": None}
        for number, scene in enumerate(scenes)
    ]
    return ResultSet(name, {"rows": rows, "coverage": {"missing": []}})


def table(scores: dict[str, tuple[float, float]]) -> dict[str, Any]:
    evaluator = plugin_manager.load().record("evaluators", "omq")
    pairs = {
        solution: (result_set("one", a, "x:1", "y:1"), result_set("other", b, "x:1", "y:1"))
        for solution, (a, b) in scores.items()
    }
    return scene_pairs(("one", "other"), pairs, evaluator, "OMQ")


@given(scores=SCORES)
def test_ranks_are_those_of_scipy_and_sides_may_be_exchanged(scores: list[tuple[int, int]]) -> None:
    named = {f"s{number}": (a / 20, b / 20) for number, (a, b) in enumerate(scores)}
    found, turned = table(named), table({name: (b, a) for name, (a, b) in named.items()})

    assert [row["difference"] for row in found["rows"]] == [-row["difference"] for row in turned["rows"]]
    assert found["mean_absolute_difference"] == turned["mean_absolute_difference"]
    a, b = zip(*scores, strict=True)
    if len(set(a)) == 1 or len(set(b)) == 1:
        assert found["ranks"]["kendall_tau"] is None
    else:
        expected = stats.kendalltau(a, b)
        assert found["ranks"]["kendall_tau"] == pytest.approx(expected.statistic)
        assert found["ranks"]["spearman_rho"] == pytest.approx(stats.spearmanr(a, b).statistic)
        assert turned["ranks"]["kendall_tau"] == pytest.approx(expected.statistic)


def test_two_solutions_have_no_rank_correlation() -> None:
    assert table({"s1": (0.1, 0.2), "s2": (0.3, 0.4)})["ranks"] is None


@pytest.fixture
def two_worlds(result_folder: CommandLine) -> CommandLine:
    """Four solutions in the folders `sim` and `real`, of which one finds less in the real one."""
    template = json.loads((result_folder.folder / "perfect.json").read_text())
    for world in ("sim", "real"):
        for name, objects in FOUND.items():
            folder = result_folder.folder / world / name
            folder.mkdir(parents=True)
            found = FOUND["some"] if (world, name) == ("real", "too_many") else objects
            results = {**template["results"], "objects": found}
            (folder / "result.json").write_text(json.dumps({**template, "results": results}))
    return result_folder


@pytest.mark.usefixtures("two_worlds")
def test_the_sim_to_real_table_of_several_solutions(here: Here) -> None:
    done = here("compare", "sim", "real", "--paired-by", "scene", *TRUTH)

    assert done.returncode == 0, done.stderr
    rows = {line.split()[0]: line.split()[1:] for line in done.stdout.splitlines()[:4]}
    assert rows["all"] == ["arena:1", "1.0000", "1.0000", "+0.0000", "1", "and", "1"]
    assert rows["none"][1:3] == ["0.0000", "0.0000"]
    assert float(rows["too_many"][3]) != 0
    assert "Order of 4 solutions over 1 scenes: Kendall's tau" in done.stdout

    document = json.loads(here("compare", "sim", "real", "--paired-by", "scene", *TRUTH, "--json").stdout)
    assert [row["solution"] for row in document["rows"]] == ["all", "none", "some", "too_many"]
    assert document["ranks"]["kendall_tau"] < 1
    assert document["channels"] == []


def test_one_solution_is_a_table_without_ranks(two_worlds: CommandLine, here: Here) -> None:
    done = here("compare", "sim=sim/all", "real=real/none", "--paired-by", "scene", *TRUTH)

    assert done.stdout.splitlines()[0].split() == ["arena:1", "1.0000", "0.0000", "+1.0000", "1", "and", "1"]
    assert "Mean absolute difference of OMQ: 1.0000" in done.stdout
    assert "Order" not in done.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sim", "real", "sim"], "puts two sets side by side"),
        (["sim/all", "real/all"], "2 sets are called 'all'"),
        (["sim", "real", "--score", "OMG"], "Did you mean 'OMQ'?"),
        (["sim", "none"], "There is no such"),
    ],
)
@pytest.mark.usefixtures("two_worlds")
def test_what_cannot_be_put_side_by_side_is_told(words: list[str], message: str, here: Here) -> None:
    done = here("compare", *words, "--paired-by", "scene", *TRUTH)
    assert done.returncode == 2, done.stdout
    assert message in done.stderr


def test_replays_among_driven_results_are_said(two_worlds: CommandLine, here: Here) -> None:
    path = two_worlds.folder / "real" / "all" / "result.json"
    document = json.loads(path.read_text())
    replay = {"arena:1": {"robot": "r", "sha256": "0" * 64, "steps": 3, "from": "run"}}
    provenance = {
        "benchbot": "0.1.0",
        "plugins": {},
        "selection": {"task": "t", "robot": "replay", "environment": "arena:1", "seed": 4},
        "failure": None,
        "steps": 3,
        "simulated_time_s": 0.0,
        "observation_digest": "",
        "replay": replay,
    }
    path.write_text(json.dumps({**document, "provenance": provenance}))

    done = here("compare", "sim=sim/all", "real=real/all", "--paired-by", "scene", *TRUTH)
    assert "Replays of recordings, nothing was driven: sim 0 of 1; real 1 of 1." in done.stderr
    plain = here("compare", "sim=sim/all", "real=real/all", *TRUTH)
    assert "Replays of recordings, nothing was driven: sim 0 of 1; real 1 of 1." in plain.stderr

    mixed = two_worlds.folder / "mixed"
    mixed.mkdir()
    shutil.copy(path, mixed / "replayed.json")
    shutil.copy(two_worlds.folder / "sim" / "none" / "result.json", mixed / "driven.json")
    done = here("eval", "mixed", *TRUTH, "-o", "scores.json")
    assert "Driven and replayed results are scored together, 1 of 2 are of recordings: arena:1, seed 4" in done.stderr


def seen(depth_m: float, x: float, yaw_deg: float, brightness: int = 100) -> dict[str, Any]:
    depth = np.full((3, 4), depth_m, np.float32)
    depth[0, 0] = np.inf
    pose = {"translation_xyz": np.array([x, 0, 0]), "rotation_rpy": np.array([0, 0, np.radians(yaw_deg)])}
    return {
        "image_rgb": np.full((3, 4, 3), brightness, np.uint8),
        "image_depth": depth,
        "laser": {"scans": np.array([[depth_m, 0.0], [np.nan, 0.1]]), "range_min": 0.0, "range_max": 9.0},
        "poses": {"base_link": pose},
    }


def test_differences_of_channels_are_means_over_what_both_saw() -> None:
    found = channel_differences.between(
        [seen(1.0, 0, 179), seen(2.0, 1, 0)], [seen(1.5, 0.1, -179, 90), seen(2.5, 1, 0)]
    )

    assert found.steps == (2, 2)
    values = {item["channel"]: (item["mean_absolute"], item["unit"]) for item in found.as_list()}
    assert values["image_depth"] == (pytest.approx(0.5), "m")
    assert values["laser"] == (pytest.approx(0.5), "m")
    assert values["brightness"] == (pytest.approx(5.0), "of 255")
    assert values["position"] == (pytest.approx(0.05), "m")
    assert values["heading"] == (pytest.approx(1.0), "deg")


def test_pictures_of_other_sizes_are_compared_in_brightness_only() -> None:
    other = {**seen(1.0, 0, 0), "image_depth": np.ones((6, 8), np.float32)}
    found = channel_differences.between([seen(1.0, 0, 0), seen(1.0, 0, 0)], [other])

    assert found.steps == (2, 1)
    assert "image_depth" not in {item["channel"] for item in found.as_list()}


def test_without_recordings_beside_the_results_there_are_no_differences(tmp_path: Path) -> None:
    assert channel_differences.recording_of(plugin_manager.load(), str(tmp_path / "result.json")) is None
