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


def test_what_was_taken_for_what_is_a_table_of_the_worst_classes() -> None:
    confusion = [
        {"truth": "cup", "objects": 3, "missed": 1, "estimated": {"cup": 0.5, "bottle": 1.5}},
        {"truth": "bed", "objects": 1, "missed": 0, "estimated": {"bed": 1.0}},  # right: left out
        {"truth": None, "objects": 2, "missed": 0, "estimated": {"bottle": 0.5, "a class with a long name": 1.5}},
    ]
    entries = [{"environment": "flat:1", "diagnosis": {"confusion": confusion}}]

    assert scoring.diagnosis({"results": entries}, "OMQ") == [
        "Classes of flat:1: true ones down, what estimates give them across:",
        "           bottle  a class w…  cup  other  missed",
        "  cup         1.5           .  0.5      .       1",
        "  nothing     0.5         1.5    .      .       .",
    ]


def test_reasons_endings_and_drift_are_told_in_lines() -> None:
    groups = [{"label": "below 1 m", "objects": 5, "found": 4, "quality": 0.625}]
    ending = {"kind": "never_saw", "place": [1.0, -2.5], "why": "The goal was never in sight."}
    drift = [{"length_m": 5.0, "stretches": 3, "error_m": 0.125, "error_deg": 1.5}]
    told = {"breakdown": [{"by": "nearest_view", "groups": groups}], "ending": ending, "drift": drift}

    assert scoring.diagnosis({"results": [{"environment": "flat:1", "diagnosis": told}]}, "SPL") == [
        "Quality in flat:1 by nearest view (found of all):",
        "  below 1 m                  0.62      4/5",
        "flat:1 ended at (1.00, -2.50): never saw. The goal was never in sight.",
        "Drift in flat:1, over stretches of the true way:",
        "      5 m    0.1250 m     1.50 deg       3 x",
    ]
