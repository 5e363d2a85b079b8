"""A batch on the ray-traced robot: its simulator stays warm, and nobody can tell from the results."""

import json
import re
from pathlib import Path

import pytest

from tests.ray_tracing import benchbot

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("main job")]

WHAT = ("--task", "semantic_slam:passive:ground_truth", "--robot", "carter_lowres", "--env", "miniroom:1")


def without_hashes(path: Path) -> str:
    """Return a result without the hash of a snapshot, and of plug-ins, whose sources may be edited while tests run."""
    document = json.loads(path.read_text("utf-8"))
    document["provenance"]["solution"].pop("snapshot", None)
    return re.sub(r'"sha256": "\w+"', "", json.dumps(document))


def test_a_warm_simulator_gives_the_bytes_of_a_cold_one(tmp_path: Path, kernel_cache: Path) -> None:
    benchbot(
        tmp_path,
        *("batch", *WHAT, "--seeds", "0..1", "--example", "hello_passive", "--jobs", "1"),
        *("--evaluate-with", "omq", "--zip", "--output-location", "batch"),
        cache=kernel_cache,
    )
    benchbot(
        tmp_path,
        *("submit", *WHAT, "--seed", "1", "--example", "hello_passive", "--results-location", "cold.json"),
        cache=kernel_cache,
    )

    (warm,) = (tmp_path / "batch" / "episodes").glob("*seed1*/result.json")
    assert without_hashes(warm) == without_hashes(tmp_path / "cold.json")
    logs = [json.loads(path.read_text().splitlines()[-1]) for path in (tmp_path / "batch" / "events").glob("local-*")]
    assert [log["finished"] for log in logs] == [2]
    scores = json.loads((tmp_path / "batch" / "scores.json").read_text())
    assert scores["coverage"]["scored"] == 2
    assert (tmp_path / "batch" / "report.html").stat().st_size > 10_000
    assert (tmp_path / "batch" / "results.zip").is_file()
