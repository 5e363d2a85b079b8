"""The moving baselines, where they once stood still: the benchmark says what they reach everywhere."""

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.bench_baselines import DEAD_RECKONING, PLACES, WANDER, Baseline, Row, measure

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("renderer")]


@pytest.mark.parametrize("baseline", [WANDER, DEAD_RECKONING], ids=lambda baseline: baseline.name)
def test_a_baseline_moves_where_it_once_stood(
    baseline: Baseline, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    row = measure("apartment:3", replace(baseline, steps=16))
    assert row.path_length_m > 6
    assert row.coverage > 0.1
    assert not row.collided


def test_too_little_is_told() -> None:
    row = Row("apartment:3", "wander", 0, 100, 0, False, 0.0, 0.05)
    assert row.missed(WANDER)
    assert not replace(row, path_length_m=60.0, coverage=0.5).missed(WANDER)
    assert replace(row, path_length_m=60.0, coverage=0.5, collided=True).missed(WANDER)
    assert len(PLACES) == 25
