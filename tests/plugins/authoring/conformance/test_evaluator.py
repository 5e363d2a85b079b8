"""A small method of evaluation conforms; each variant of it that breaks one promise is found out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator, Score
from benchbot.plugin import Spent
from benchbot.testing import Example, check_evaluator
from tests.plugins.authoring.conformance.reading import all_is_well, broken, warned

Document = dict[str, Any]


def recall(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    wanted = set(ground_truths[0]["names"])
    return {"recall": len(wanted & set(result["results"]["names"])) / len(wanted)}


def mean(scores: Sequence[dict[str, float]]) -> dict[str, float]:
    return {"recall": sum(row.get("recall", 0.0) for row in scores) / len(scores)}


SOUND = Evaluator(
    "recall",
    "1",
    "recall",
    frozenset({"names"}),
    frozenset({"names_ground_truth"}),
    recall,
    mean,
    scores={"recall": Score(lower_is_better=False, least=0.0, greatest=1.0)},
)
TRUTH = [{"names": ["cup", "bowl"]}]


def example(*names: str) -> Example:
    return Example({"results": {"names": list(names)}}, TRUTH)


def check(method: Evaluator) -> Any:
    return check_evaluator(
        method, perfect=example("cup", "bowl"), empty=example(), others=[example("cup", "tv")], unordered=["names"]
    )


def test_a_sound_method_conforms() -> None:
    assert all_is_well(check(SOUND))


def spoils(result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
    result["results"]["names"].sort()
    return recall(result, ground_truths)


counter = iter(range(1000))


def wavers(result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
    return {"recall": recall(result, ground_truths)["recall"] / (1 + next(counter) * 1e-3)}


def prefers_the_first(result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
    return {"recall": float(result["results"]["names"][:1] == ["cup"])}


def fails_on_nothing(result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
    return recall(result, ground_truths) if result["results"]["names"][0] else {}


def refuses_nothing(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    if not result["results"]["names"]:
        raise BenchbotError("There is nothing to score.", "The result is empty.", "Find something.")
    return recall(result, ground_truths)


def counts_the_last_attempt(result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
    return {**recall(result, ground_truths), "collisions": float(len(result.get("track", ())))}


def counts_all_attempts(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    return {**recall(result, ground_truths), "collisions": float(Spent.of(result).collisions)}


def giving(value: Any) -> Callable[..., Any]:
    return lambda *_: {"recall": value}


@pytest.mark.parametrize(
    ("changes", "subject", "words"),
    [
        ({"version": ""}, "declaration", "no name or no version"),
        ({"result_formats": frozenset()}, "declaration", "reads no result format"),
        ({"result_formats": ["names"]}, "declaration", "Give a frozenset"),
        ({"scores": {"recall": Score(False, 1.0, 0.0)}}, "declaration", "least value first"),
        ({"headline": "precision"}, "scores: perfect", "'precision' is not among its scores"),
        ({"evaluate": spoils}, "scores: perfect", "altered the result"),
        ({"evaluate": wavers}, "scores: perfect", "other scores the second time"),
        ({"evaluate": giving(np.float32(1))}, "scores: perfect", "a float32"),
        ({"evaluate": giving(float("nan"))}, "scores: perfect", "recall = nan"),
        ({"evaluate": giving(2.0)}, "scores: perfect", "outside its range of 0.0 to 1.0"),
        ({"evaluate": giving(True)}, "scores: perfect", "a bool"),
        ({"evaluate": lambda *_: None}, "scores: perfect", "returned None"),
        ({"evaluate": giving(0.5)}, "scores: perfect is best", "Score it with the best there is: 1.0"),
        (
            {"evaluate": lambda result, truths: {"recall": 1 - recall(result, truths)["recall"]}, "scores": {
                "recall": Score(lower_is_better=False)
            }},
            "scores: perfect is best",
            "better than 0.0 of the perfect one",
        ),
        ({"scores": {}}, "scores: perfect is best", "does not say whether less"),
        ({"evaluate": counts_the_last_attempt}, "scores: all attempts", "3 attempts with 7 collisions"),
        ({"evaluate": fails_on_nothing}, "scores: empty", "IndexError"),
        ({"evaluate": prefers_the_first}, "order of names", "names in another order"),
        ({"combine": lambda rows: {"recall": rows[0].get("recall", 0.0)}}, "combine: order", "in another order"),
        ({"combine": lambda rows: {"recall": rows[0]["recall"]}}, "combine: missing", "KeyError"),
        (
            {"combine": lambda rows: {"recall": sum(row.get("recall", 1.0) for row in rows) / (len(rows) + 1)}},
            "combine: missing",
            "makes recall better",
        ),
        ({"combine": lambda rows: {"other": 1.0}}, "combine: one", "lacks the headline"),
        ({"combine": lambda rows: {"recall": mean(rows)["recall"] / 2}}, "combine: one", "of the summary of it alone"),
        ({"combine": lambda rows: rows[0].update(recall=0.0) or {"recall": 1.0}}, "combine: one", "altered the scores"),
        ({"explain": lambda *_: {"objects": {1, 2}}}, "explanation", "is not JSON"),
        ({"explain": spoils}, "explanation", "explain altered"),
    ],
)  # fmt: skip
def test_a_broken_promise_is_found_out(changes: dict[str, Any], subject: str, words: str) -> None:
    assert words in broken(check(replace(SOUND, **changes)))[subject]


def test_collisions_of_all_attempts_conform() -> None:
    findings = {finding.subject: finding.detail for finding in check(replace(SOUND, evaluate=counts_all_attempts))}
    assert findings["scores: all attempts"] == "collisions of 2 examples"


def test_an_empty_result_may_be_refused_in_order() -> None:
    assert broken(check(replace(SOUND, evaluate=refuses_nothing))) == {}


def test_scores_that_nobody_can_read_are_a_warning() -> None:
    more = replace(SOUND, evaluate=lambda result, truths: recall(result, truths) | {"count": 2.0})
    assert "Nobody knows how to read count" in warned(check(more))["scores: declared"]
    fewer = replace(SOUND, scores={**SOUND.scores, "precision": Score()})
    assert "No example has the declared precision" in warned(check(fewer))["scores: declared"]


def test_an_order_that_was_never_tried_is_not_taken_for_checked() -> None:
    findings = check_evaluator(SOUND, perfect=example("cup", "bowl"), unordered=["objects"])
    assert "No example has two entries in 'objects'" in broken(findings)["order of objects"]
