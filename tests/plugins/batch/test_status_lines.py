from dataclasses import replace

import pytest

from benchbot.plugins.batch import status_lines
from benchbot.plugins.batch.status import BatchStatus, RunningEpisode, Score

STATUS = BatchStatus(
    folder="/data/night",
    hash="ab" * 32,
    episodes=60,
    finished=12,
    failures={"agent": 1, "platform": 2},
    retried=3,
    running=(RunningEpisode("carter_miniroom-1_seed3-0123abcd", "local-1", 41.6), RunningEpisode("x", "y", None)),
    workers=2,
    idle=(),
    paused=None,
    mean_s=30.0,
    rate_per_hour=240.0,
    left_s=720.0,
    score=Score("OMQ", 0.4123, 9, 0.31, 0.5),
)


def test_the_line_says_what_matters() -> None:
    assert status_lines.line(STATUS) == (
        "12/60 episodes · 1 failed (agent) · 2 failed (platform) · 2 running on 2 workers · 240/h · 12 min left · "
        "OMQ 0.412 [0.31, 0.50] of 9"
    )


def test_a_pause_and_idle_workers_are_said() -> None:
    line = status_lines.line(replace(STATUS, paused="the disk is full", idle=("local-2",), score=None))
    assert "PAUSED: the disk is full" in line
    assert "1 idle" in line


def test_the_page_says_everything() -> None:
    page = "\n".join(status_lines.page(STATUS))
    assert "Finished     12 of 60" in page
    assert "carter_miniroom-1_seed3-0123abcd on local-1, for 42 s" in page
    assert "Pending      46" in page
    assert "Left         12 min" in page


def test_before_anything_is_finished_nothing_is_promised() -> None:
    page = "\n".join(status_lines.page(replace(STATUS, finished=0, failures={}, mean_s=None, left_s=None, workers=-1)))
    assert "Left         not known yet" in page
    assert "Workers      not known" in page
    assert "Failures     none" in page


def test_what_a_detached_batch_was_made_into_is_named() -> None:
    page = "\n".join(status_lines.page(replace(STATUS, conclusion={"files": {"scores": "/data/night/scores.json"}})))
    assert "Scores       /data/night/scores.json" in page
    assert "Not scored   Nothing to score." in status_lines.page(
        replace(STATUS, conclusion={"problem": "Nothing to score."})
    )


@pytest.mark.parametrize(("seconds", "text"), [(0.4, "0 s"), (99, "99 s"), (120, "2 min"), (9000, "2.5 h")])
def test_times_are_said_as_people_do(seconds: float, text: str) -> None:
    assert status_lines.duration(seconds) == text


@pytest.mark.parametrize(("rate", "told"), [(0.25, "0.2/h"), (11_800.4, "11800/h")])
def test_a_rate_is_written_without_an_exponent(rate: float, told: str) -> None:
    assert f"· {told}" in status_lines.line(replace(STATUS, rate_per_hour=rate))
