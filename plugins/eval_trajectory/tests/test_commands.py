"""Trajectories from the command line, in real processes: run, scored, written as files, compared."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchbot.cli.app import main
from benchbot.core.declarations import schema
from benchbot_eval_trajectory.files import FileFormat, text_of
from plugins.eval_trajectory.tests.ways import estimate_of, moved, wander
from tests.garbage import searched_as_before

COMMAND = [sys.executable, "-m", "benchbot"]
Finished = subprocess.CompletedProcess[str]
Here = Callable[..., Finished]


def benchbot(folder: Path, *words: str, cache: Path | None = None) -> Finished:
    cache = cache or folder / "cache"
    variables = {"BENCHBOT_STATE_DIR": str(folder / "state"), "BENCHBOT_CACHE_DIR": str(cache)}
    return subprocess.run(
        [*COMMAND, *words], cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )


@pytest.fixture
def here(folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Here]:
    """Runs `benchbot` in the folder, in this process: commands that start no other."""
    monkeypatch.chdir(folder)

    def run(*words: str) -> Finished:
        with pytest.raises(SystemExit) as ended:
            main(words)
        out, err = capfd.readouterr()
        return Finished(words, int(ended.value.code or 0), out, err)

    with searched_as_before():
        yield run


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with results of dead reckoning in the sample arena, and with files of made-up trajectories."""
    folder = tmp_path_factory.mktemp("trajectory")
    for kind, task in (
        ("passive", "trajectory:passive:dead_reckoning"),
        ("active", "trajectory:active:dead_reckoning:laser"),
    ):
        done = benchbot(
            folder,
            *("submit", "--task", task, "--robot", "sample_robot", "--env", "arena:1"),
            *("--example", "dead_reckoning", "--args", "--steps 15", "--results-location", f"{kind}.json"),
        )
        assert done.returncode == 0, done.stderr
    truth = wander()
    for file_format in FileFormat:
        (folder / f"truth.{file_format}").write_text(text_of(truth, file_format))
        (folder / f"estimate.{file_format}").write_text(text_of(estimate_of(truth), file_format))
        (folder / f"large.{file_format}").write_text(text_of(moved(truth, (0, 0, 1), (1, 2, 3), 2.0), file_format))
    return folder


@pytest.mark.parametrize("kind", ["passive", "active"])
def test_dead_reckoning_drifts_and_its_error_is_scored(folder: Path, here: Here, kind: str) -> None:
    document = json.loads((folder / f"{kind}.json").read_text())
    schema.check(document, "result", folder / f"{kind}.json")
    done = here("eval", f"{kind}.json", "--require", "ATE_RMSE_m<0.5", "--require", "completeness>=1")

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ATE_RMSE_m 0.")
    scores = json.loads((folder / "scores.json").read_text())["scores"]
    assert 0.001 < scores["ATE_RMSE_m"] <= scores["ATE_map_RMSE_m"]
    assert scores["path_length_m"] == document["track"][0]["path_length_m"]


def test_an_error_that_is_too_large_ends_with_4(folder: Path, here: Here) -> None:
    done = here("eval", "passive.json", "--require", "ATE_RMSE_m<0.0001")

    assert done.returncode == 4


def test_a_result_without_a_track_is_named_and_the_others_are_scored(folder: Path, here: Here) -> None:
    document = json.loads((folder / "passive.json").read_text())
    del document["track"]
    document["provenance"]["selection"]["seed"] = 1
    (folder / "bare.json").write_text(json.dumps(document))
    done = here("eval", "bare.json", "passive.json", "-o", "two.json")

    assert done.returncode == 0, done.stderr
    assert "bare.json" in done.stderr
    assert "does not say where the robot went" in done.stderr
    scores = json.loads((folder / "two.json").read_text())
    assert scores["scores"] == {**scores["rows"][0]["scores"], "completeness": 0.5}
    assert done.stdout.endswith(" (mean of 1 of 2)\n")
    assert "path_length_m: mean of 1 of 2" in done.stderr
    assert "completeness" not in scores["coverage"]["means_of"]


def test_files_of_a_result_give_the_same_errors_as_the_result(folder: Path, here: Here) -> None:
    for name, words in (("ours", ()), ("real", ("--truth",))):
        done = here("trajectory", "convert", "active.json", f"{name}.tum", *words)
        assert done.returncode == 0, done.stderr
    done = here("trajectory", "evaluate", "ours.tum", "real.tum", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["errors"]

    done = here("eval", "active.json", "--json", "-o", "active_scores.json")
    scores = json.loads(done.stdout)["scores"]
    for name, key, score in (
        ("ATE_m", "rmse", "ATE_RMSE_m"),
        ("ATE_m", "median", "ATE_median_m"),
        ("RPE_m", "rmse", "RPE_1m_m"),
        ("RPE_frame_deg", "rmse", "RPE_frame_deg"),
    ):
        assert found[name][key] == pytest.approx(scores[score], abs=1e-9)


@pytest.mark.parametrize("file_format", ["tum", "kitti"])
def test_files_are_compared(folder: Path, here: Here, file_format: str) -> None:
    done = here("trajectory", "evaluate", f"estimate.{file_format}", f"truth.{file_format}")

    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == [
        "ATE_m",
        "RPE_m",
        "RPE_deg",
        "RPE_frame_m",
        "RPE_frame_deg",
    ]
    assert "200 pairs of poses, alignment se3" in done.stderr
    assert "Unmatched" not in done.stderr


@pytest.mark.parametrize(("rule", "poses", "unmatched"), [("evo", 80, 0), ("tum", 40, 40)])
def test_poses_without_a_counterpart_are_said(folder: Path, here: Here, rule: str, poses: int, unmatched: int) -> None:
    """Each pose of the estimate is there twice, 2 ms apart, while the truth has the first 40, and others."""
    lines = [line for line in (folder / "truth.tum").read_text().splitlines() if not line.startswith("#")]
    twice = [line for line in lines[:40] for _ in range(2)]
    words = [line.split(maxsplit=1) for line in twice]
    shifted = [f"{float(time_s) + 0.002 * (place % 2)} {rest}" for place, (time_s, rest) in enumerate(words)]
    (folder / "twice.tum").write_text("\n".join(shifted) + "\n")

    done = here("trajectory", "evaluate", "twice.tum", "truth.tum", "--association", rule)

    assert done.returncode == 0, done.stderr
    assert f"{poses} pairs of poses" in done.stderr
    assert (f"Unmatched: {unmatched} of 80 poses of the estimate" in done.stderr) == (unmatched > 0)
    assert "Unmatched: 160 of 200 poses of the ground truth" in done.stderr


def test_a_scale_is_found_and_said(folder: Path, here: Here) -> None:
    words = ("large.tum", "truth.tum", "--align", "sim3", "--require", "ATE_RMSE_m<1e-6", "--require", "ATE_max_m<1e-6")
    done = here("trajectory", "evaluate", *words)

    assert done.returncode == 0, done.stderr
    assert "scale 0.5" in done.stderr


def test_a_way_that_is_too_short_has_no_relative_errors(folder: Path, here: Here) -> None:
    done = here("trajectory", "evaluate", "estimate.tum", "truth.tum", "--length", "1000")

    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[1].split() == ["RPE_m", *"-----"]


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (("evaluate", "estimate.tum", "truth.kitti"), 2, "Only one of the two trajectories has times"),
        (("evaluate", "estimate.tum", "none.tum"), 2, "No such file"),
        (("evaluate", "short.kitti", "truth.kitti"), 2, "The estimate has 3, the ground truth 200"),
        (("evaluate", "late.tum", "truth.tum"), 2, "none are within 0.01 s"),
        (("evaluate", "estimate.tum", "truth.tum", "--require", "ATE_RMSE_m<0"), 4, "ATE_RMSE_m < 0 is required"),
        (("evaluate", "estimate.tum", "truth.tum", "--require", "ATE<1"), 2, "The scores: ATE_RMSE_m"),
        (("evaluate", "estimate.tum", "truth.tum", "--align", "se2"), 2, "'se2'"),
        (("convert", "truth.kitti", "out.tum"), 2, "no times"),
        (("convert", "truth.tum", "out.tum", "--truth"), 2, "holds one trajectory"),
        (("convert", "claim.json", "out.tum"), 2, "not a valid trajectory"),
    ],
)
def test_what_cannot_be_compared_is_said(folder: Path, here: Here, words: tuple[str, ...], code: int, why: str) -> None:
    (folder / "short.kitti").write_text("".join((folder / "truth.kitti").read_text().splitlines(keepends=True)[:3]))
    (folder / "late.tum").write_text("1 0 0 0 0 0 0 1\n")
    claim = {**json.loads((folder / "passive.json").read_text()), "results": {"objects": []}}
    (folder / "claim.json").write_text(json.dumps(claim))
    done = here("trajectory", *words)

    assert done.returncode == code
    assert why in done.stderr
    assert not (folder / "out.tum").exists()


def test_files_are_converted(folder: Path, here: Here) -> None:
    done = here("trajectory", "convert", "truth.tum", "again.kitti", "--format", "kitti")

    assert done.returncode == 0, done.stderr
    words = ("again.kitti", "truth.kitti", "--align", "none", "--require", "ATE_max_m<=0")
    assert here("trajectory", "evaluate", *words).returncode == 0


@pytest.mark.slow
@pytest.mark.xdist_group("main job")
def test_dead_reckoning_drifts_in_the_ray_traced_room(tmp_path: Path, kernel_cache: Path) -> None:
    done = benchbot(
        tmp_path,
        *("submit", "--task", "trajectory:active:dead_reckoning:laser", "--robot", "carter_lowres"),
        *("--env", "miniroom:1", "--example", "dead_reckoning", "--args", "--steps 12"),
        *("--evaluate-with", "trajectory", "--require", "completeness>=1", "--results-location", "result.json"),
        cache=kernel_cache,
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ATE_RMSE_m 0.")
