"""Scores as people read them."""

from typing import Any

from benchbot.cli.kit import scoring


def document(*rows: dict[str, Any], **keys: Any) -> dict[str, Any]:
    coverage = {"expected": len(rows), "scored": len(rows), "missing": [], "skipped": []}
    method = {"name": "omq", "version": "1.0", "headline": "OMQ"}
    return {"method": method, "scores": {"other": 1.0, "OMQ": 0.625}, "rows": list(rows), "coverage": coverage} | keys


def row(environment: str, **keys: Any) -> dict[str, Any]:
    return {"environment": environment, "seed": None, "scores": {"OMQ": 0.5, "other": 1.0}} | keys


def test_rows_of_one_environment_are_told_apart_by_their_numbers() -> None:
    rows = [row("flat:1", seed=3), row("flat:1", seed=4, repeat=2), row("flat:2", seed=3)]

    lines = scoring.table(document(*rows))

    assert [line.partition("  ")[0] for line in lines[1:]] == [
        "flat:1 seed 3",
        "flat:1 seed 4 repeat 2",
        "flat:2",
        "all",
    ]
    assert lines[0].split() == ["OMQ", "other"]


def test_the_interval_stands_beside_the_score() -> None:
    statistics = {"method": "bootstrap-t over places", "clusters": 7, "draws": 9, "seed": 0, "note": None}
    intervals = {"OMQ": {"low": 0.512, "high": 0.708, "level": 0.95}}

    text = "\n".join(scoring.table(document(row("a:1"), row("b:1"), intervals=intervals, statistics=statistics)))

    assert text.splitlines()[-1] == "OMQ 0.62 [0.51, 0.71] (95 % interval, bootstrap-t over places: 7)"


def test_why_there_is_no_interval_is_said_where_there_might_be_one() -> None:
    statistics = {"method": None, "clusters": 2, "draws": 0, "seed": None, "note": "Too few."}
    keys: dict[str, Any] = {"intervals": {"OMQ": None}, "statistics": statistics}

    assert scoring.table(document(row("a:1"), row("b:1"), **keys))[-1].endswith("Too few.")
    assert "Too few." not in "\n".join(scoring.table(document(row("a:1"), **keys)))


def test_a_headline_that_no_result_has_is_a_dash() -> None:
    nothing = document(row("a:1"))
    nothing["scores"] = {}

    assert scoring.headline(nothing) == "OMQ -"


def test_failures_warnings_and_what_is_missing_are_told() -> None:
    item = {"source": None, "environment": "flat:2", "seed": 3, "reason": "There is none.", "failure": None}
    coverage = {
        "expected": 2,
        "scored": 1,
        "missing_counts": "leave-out",
        "failures": {"agent": 1, "timeout": 2},
        "warnings": ["Odd."],
        "missing": [item],
        "skipped": [{"source": "a.json", "reason": "It is not wanted."}],
    }

    assert scoring.table(document(row("flat:1"), coverage=coverage))[-5:] == [
        "1 of 2 scored; the missing are left out",
        "  failed episodes: 1 agent, 2 timeout",
        "  warning: Odd.",
        "  missing: flat:2 seed 3: There is none.",
        "  left out: a.json: It is not wanted.",
    ]


def test_what_went_wrong_is_told_with_what_it_costs() -> None:
    errors = [{"kind": "class", "count": 9, "gain": 0.312}, {"kind": "missed", "count": 12, "gain": 0.0}]
    entries = [{"environment": "flat:1", "diagnosis": {"errors": errors}}, {"environment": "flat:2"}]

    assert scoring.diagnosis({"results": entries}, "OMQ") == [
        "What went wrong in flat:1, and the OMQ that it costs:",
        "  class          9  +0.31",
        "  missed        12  +0.00",
    ]
