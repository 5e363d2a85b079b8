from collections.abc import Mapping
from typing import Any, cast

import pytest

from benchbot.core.errors import FailureClass
from benchbot.evaluation.result_document import DEPTH_LIMIT, ResultDocument, listed
from benchbot.plugin import Result
from tests.made_results import MakeRun


def read_from(source: str, document: Mapping[str, Any]) -> ResultDocument:
    return ResultDocument(source, cast(Result, document))


def test_a_result_is_told_from_others_by_its_numbers_and_its_settings(make_run: MakeRun) -> None:
    plain = read_from("a.json", make_run(seed=3))
    changed = read_from(
        "b.json", make_run(seed=3, repeat=1, episode={"number": 2}, settings={"lighting.time": "21:30"})
    )

    assert plain.condition == {"seed": 3, "episode": None, "repeat": None}
    assert plain.about == "flat:1, seed 3"
    assert changed.condition == {"seed": 3, "episode": 2, "repeat": 1, "settings": {"lighting.time": "21:30"}}
    assert changed.about == "flat:1, seed 3, episode 2, repeat 1, lighting.time=21:30"


def test_a_result_without_provenance_says_none_of_them(make_run: MakeRun) -> None:
    document = make_run(seed=3)
    del document["provenance"]
    result = read_from("a.json", document)

    assert result.condition == {"seed": None, "episode": None, "repeat": None}
    assert (result.about, result.failure, result.failure_why) == ("flat:1", None, "")


def test_a_failure_has_a_class_and_a_reason(failed_episode: dict[str, Any]) -> None:
    result = read_from("a.json", failed_episode)

    assert (result.failure, result.failure_why) == (FailureClass.AGENT, "It exited with status 1.")


@pytest.mark.parametrize("wrapped", ["lists", "mappings", "both"])
def test_a_document_may_have_as_many_levels_as_json_is_written_with(wrapped: str) -> None:
    def nested(levels: int) -> Any:
        value: Any = []
        for level in range(levels - 1):
            value = [value] if wrapped == "lists" or (wrapped == "both" and level % 2) else {"in": value}
        return value

    deepest, too_deep = ({"results": nested(levels)} for levels in (DEPTH_LIMIT - 1, DEPTH_LIMIT))

    assert read_from("a.json", deepest).flaw() is None
    flaw = read_from("a.json", too_deep).flaw()
    assert flaw is not None
    assert flaw.startswith("It is nested deeper than 100 levels, at /results/")


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, ""), (1, "a"), (5, "a, b, c, d, e"), (6, "a, b, c, d, e and 1 more"), (12, "a, b, c, d, e and 7 more")],
)
def test_a_list_names_five_and_counts_the_others(count: int, text: str) -> None:
    assert listed("abcdefghijkl"[:count]) == text
    assert listed("abcdefghijkl"[:count], "; ") == text.replace(",", ";")
