"""A certificate says what its scores say: how far off they are, and whether solutions are ranked alike."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.findings import Finding, Level
from benchbot.plugins.certification import report
from benchbot.plugins.certification.certificate import Certificate, Row, kendall_tau

FINE = (Finding(Level.OK, "clean start", "at the start pose"),)
MIRRORED = Finding(Level.BROKEN, "golden room: image_rgb", "The picture is mirrored left to right", "Flip it.")
SCORES = st.lists(st.floats(0, 1), min_size=2, max_size=6, unique=True)


def certificate(rows: Sequence[Row], findings: tuple[Finding, ...] = FINE) -> Certificate:
    return Certificate(
        "sim_new", "new_robot", "sim_taichi", "mapping", "OMQ", {"benchbot": "0.1"}, findings, tuple(rows)
    )


def rows(**scores: tuple[float | None, float | None]) -> list[Row]:
    return [Row(solution, "miniroom:1", here, there) for solution, (here, there) in scores.items()]


def test_scores_that_agree_are_comparable_and_the_sentence_says_how_well() -> None:
    agreed = certificate(rows(mapper=(0.89, 0.9), sparse=(0.52, 0.5)))
    assert agreed.problems == []
    assert agreed.within == pytest.approx(0.02)
    assert agreed.statement == (
        "sim_new gives the OMQ of sim_taichi within ±0.020 in 1 room, and ranks 2 solutions with Kendall's tau 1.00."
    )
    assert (
        agreed.badge == "![BenchBot: OMQ ±0.020](https://img.shields.io/badge/BenchBot-OMQ%20%C2%B10.020-brightgreen)"
    )


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (certificate(rows(mapper=(0.107, 0.887))), "a score differs by 0.780, more than 0.05"),
        (
            certificate(rows(mapper=(0.52, 0.5), sparse=(0.49, 0.51), near=(0.5, 0.49))),
            "solutions are ranked differently",
        ),
        (certificate(rows(mapper=(0.9, 0.9), sparse=(None, 0.5))), "1 of 2 scores are missing"),
        (certificate(rows(mapper=(None, 0.9))), "nothing was scored in both simulators"),
        (certificate(rows(mapper=(0.9, 0.9)), (*FINE, MIRRORED)), "1 of 2 properties of the conformance kit do not"),
        (certificate(rows(mapper=(0.9, 0.9)), ()), "the conformance kit has checked nothing"),
    ],
)
def test_whatever_is_in_the_way_of_comparing_is_named(found: Certificate, words: str) -> None:
    assert any(words in problem for problem in found.problems)
    assert words in found.statement
    assert "not comparable" in found.badge
    assert found.as_dict()["comparable"] is False


@given(SCORES)
def test_the_same_ranks_have_a_tau_of_one_and_reversed_ones_of_minus_one(scores: list[float]) -> None:
    alike = [Row(str(number), "room:1", score, score**3 + score) for number, score in enumerate(scores)]
    against = [Row(str(number), "room:1", score, -score) for number, score in enumerate(scores)]
    # Of the smallest floats the cube is lost, so that two may tie.
    if len({row.reference for row in alike}) == len(scores):
        assert kendall_tau(alike) == pytest.approx(1)
    assert kendall_tau(against) == pytest.approx(-1)


def test_one_solution_and_equal_ones_have_no_rank() -> None:
    assert kendall_tau(rows(mapper=(0.5, 0.5))) is None
    assert kendall_tau(rows(mapper=(0.5, 0.5), sparse=(0.5, 0.5))) is None


def test_the_files_hold_all_of_it(tmp_path: Path) -> None:
    found = certificate([*rows(mapper=(0.107, 0.887)), Row("<b>", "miniroom:1", None, 0.5)], (*FINE, MIRRORED))
    page, data, badge = report.write(found, tmp_path / "new")
    text = page.read_text("utf-8")
    for told in ("0.107", "0.887", "-0.780", "The picture is mirrored left to right", "Flip it.", "&lt;b&gt;"):
        assert told in text
    assert not re.search(r"<script|https?://(?!img\.shields\.io)", text)
    document = json.loads(data.read_text("utf-8"))
    assert document["within"] == pytest.approx(0.78)
    assert document["scores"][0]["difference"] == pytest.approx(-0.78)
    assert badge.read_text("utf-8") == f"{found.badge}\n"
