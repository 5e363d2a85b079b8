"""The conformance of methods of evaluation."""

import json
import math
import random
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.records import Document, Evaluator
from benchbot.plugins.authoring.conformance.properties import Wrong, look

SLACK = 1e-9


@dataclass(frozen=True)
class Example:
    """A result, and the ground truths that it is scored against."""

    result: Document
    ground_truths: Sequence[Document] = ()


def check_evaluator(
    evaluator: Evaluator | str,
    *,
    perfect: Example,
    empty: Example | None = None,
    others: Sequence[Example] = (),
    unordered: Sequence[str] = (),
) -> list[Finding]:
    """Return what a method does and does not as its hook asks.

    `perfect` is an example that cannot be scored higher, `empty` one of a solution that found nothing, `others` are
    any. `unordered` names lists in `results`, such as `objects`, whose order means nothing.
    """
    method = _installed(evaluator) if isinstance(evaluator, str) else evaluator
    scored = {"perfect": perfect, **{f"example {number}": example for number, example in enumerate(others, 1)}}
    findings = [look("declaration", partial(_declares_itself, method))]
    findings += [look(f"scores: {name}", partial(_scores_well, method, example)) for name, example in scored.items()]
    findings.append(look("scores: declared", partial(_gives_what_it_declares, method, list(scored.values()))))
    findings.append(look("scores: perfect is best", partial(_best, method, perfect, others)))
    if empty is not None:
        findings.append(look("scores: empty", partial(_scores_or_refuses, method, empty)))
    for key in unordered:
        findings.append(look(f"order of {key}", partial(_forgets_order, method, list(scored.values()), key)))
    findings.append(look("combine: order", partial(_combines_in_any_order, method, list(scored.values()))))
    findings.append(look("combine: missing", partial(_counts_missing, method, perfect)))
    findings.append(look("combine: one", partial(_combines_one, method, perfect)))
    if method.explain is not None:
        findings.append(look("explanation", partial(_explains, method, perfect)))
    return findings


def _declares_itself(method: Evaluator) -> str:
    if not method.name or not method.version:
        raise Wrong("It has no name or no version.", "Give both; change the version whenever the numbers change.")
    if not method.result_formats:
        raise Wrong("It reads no result format.", "Name those that it can score in result_formats.")
    for name in ("result_formats", "ground_truth_formats"):
        if not isinstance(getattr(method, name), frozenset):
            raise Wrong(f"{name} is a {type(getattr(method, name)).__name__}.", "Give a frozenset of names of formats.")
    for name, score in method.scores.items():
        if score.least is not None and score.greatest is not None and not score.least < score.greatest:
            raise Wrong(f"{name} is between {score.least} and {score.greatest}.", "Give the least value first.")
    return f"{method.name} {method.version}, of {', '.join(sorted(method.result_formats))}"


def _scores_well(method: Evaluator, example: Example) -> str:
    before = deepcopy(example)
    values = _evaluated(method, example)
    if example != before:
        raise Wrong("It altered the result or its ground truth.", "Copy what you change: others read them after you.")
    if _evaluated(method, example) != values:
        raise Wrong(
            "The same result has other scores the second time.", "Seed what is random in a method of evaluation."
        )
    if method.headline and method.headline not in values:
        raise Wrong(
            f"Its headline '{method.headline}' is not among its scores ({', '.join(values)}).",
            "Name the score that stands for a result.",
        )
    headline = method.headline or next(iter(values))
    return f"{headline} {values[headline]:.4g}"


def _gives_what_it_declares(method: Evaluator, examples: Sequence[Example]) -> str:
    given = {name for example in examples for name in _evaluated(method, example)}
    never = set(method.scores) - given
    if never:
        raise Wrong(
            f"No example has the declared {', '.join(sorted(never))}.",
            "Give an example that has it, or mend the name in `scores`.",
            Level.WARNING,
        )
    unread = given - set(method.scores)
    if unread:
        raise Wrong(
            f"Nobody knows how to read {', '.join(sorted(unread))}.",
            "Say it in `scores`: which way is better, and between which bounds.",
            Level.WARNING,
        )
    return ", ".join(sorted(given))


def _best(method: Evaluator, perfect: Example, others: Sequence[Example]) -> str:
    values = _evaluated(method, perfect)
    name = method.headline or next(iter(values))
    score = method.score(name)
    if score.lower_is_better is None:
        raise Wrong(
            f"It does not say whether less of '{name}' is better.",
            f"Declare it: scores={{'{name}': Score(lower_is_better=False, least=0.0, greatest=1.0)}}",
        )
    best = score.least if score.lower_is_better else score.greatest
    if best is not None and abs(values[name] - best) > SLACK:
        raise Wrong(f"{name} of a perfect result is {values[name]!r}.", f"Score it with the best there is: {best}.")
    sign = -1 if score.lower_is_better else 1
    for number, example in enumerate(others, 1):
        other = _evaluated(method, example)[name]
        if sign * other > sign * values[name] + SLACK:
            raise Wrong(
                f"{name} of example {number} is {other!r}, better than {values[name]!r} of the perfect one.",
                "Score what is perfect highest, or give a perfect example.",
            )
    return f"{name} {values[name]:.4g}"


def _scores_or_refuses(method: Evaluator, empty: Example) -> str:
    try:
        values = _evaluated(method, empty)
    except BenchbotError as error:
        return f"refused: {error.title}"
    headline = method.headline or next(iter(values))
    return f"{headline} {values[headline]:.4g}"


def _forgets_order(method: Evaluator, examples: Sequence[Example], key: str) -> str:
    tried = 0
    for example in examples:
        entries = (example.result.get("results") or {}).get(key, [])
        for seed in range(3 if len(entries) > 1 else 0):
            shuffled = deepcopy(example)
            random.Random(seed).shuffle(shuffled.result["results"][key])  # noqa: S311
            _same_scores(_evaluated(method, example), _evaluated(method, shuffled), f"{key} in another order")
            tried += 1
    if not tried:
        raise Wrong(f"No example has two entries in '{key}'.", "Give one that has.")
    return f"{tried} other orders"


def _combines_in_any_order(method: Evaluator, examples: Sequence[Example]) -> str:
    rows = [*(_evaluated(method, example) for example in examples), {}][:4]
    first = _combined(method, rows)
    for order in permutations(rows):
        _same_scores(first, _combined(method, list(order)), "results in another order")
    return f"of {len(rows)} results"


def _counts_missing(method: Evaluator, perfect: Example) -> str:
    values = _evaluated(method, perfect)
    name = method.headline or next(iter(values))
    alone, beside = _combined(method, [values]), _combined(method, [values, {}])
    _combined(method, [{}])
    if name not in beside:
        raise Wrong(f"The summary beside a missing result lacks '{name}'.", "Give the same scores as without one.")
    lower = method.score(name).lower_is_better
    if lower is False and beside[name] > alone[name] + SLACK:
        raise Wrong(f"A missing result makes {name} better.", "Count a missing result (an empty dict) as a failure.")
    return f"{name} {alone[name]:.4g} alone, {beside[name]:.4g} beside a missing one"


def _combines_one(method: Evaluator, perfect: Example) -> str:
    values = _evaluated(method, perfect)
    before = dict(values)
    combined = _combined(method, [values])
    if values != before:
        raise Wrong("combine altered the scores that it was given.", "Return new ones.")
    name = method.headline or next(iter(values))
    if name not in combined:
        raise Wrong(f"The summary lacks the headline '{name}'.", "Give it in the summary, too.")
    if abs(combined[name] - values[name]) > SLACK:
        raise Wrong(
            f"{name} is {values[name]!r} of one result and {combined[name]!r} of the summary of it alone.",
            "Let the summary of one result be its score.",
        )
    return f"{name} {combined[name]:.4g}"


def _explains(method: Evaluator, perfect: Example) -> str:
    explain = method.explain
    if explain is None:
        return "none"
    before = deepcopy(perfect)
    document = explain(perfect.result, perfect.ground_truths)
    if perfect != before:
        raise Wrong("explain altered the result or its ground truth.", "Copy what you change.")
    _is_json(document, "The explanation")
    return ", ".join(document) or "says nothing"


def _evaluated(method: Evaluator, example: Example) -> dict[str, float]:
    return _checked(method, method.evaluate(example.result, example.ground_truths), "evaluate")


def _combined(method: Evaluator, rows: Sequence[dict[str, float]]) -> dict[str, float]:
    return _checked(method, method.combine(rows), "combine")


def _checked(method: Evaluator, values: Any, what: str) -> dict[str, float]:
    if not isinstance(values, dict) or not values:
        raise Wrong(f"{what} returned {values!r}.", "Return a dict of scores by name.")
    for name, value in values.items():
        if not isinstance(name, str) or isinstance(value, bool) or not isinstance(value, int | float):
            raise Wrong(
                f"{what} returned {name!r}: {value!r}, a {type(value).__name__}.", "Return float(value) for each score."
            )
        if not math.isfinite(value):
            raise Wrong(f"{what} returned {name} = {value}.", "Raise BenchbotError where there is no number to give.")
        score = method.score(name)
        if (score.least is not None and value < score.least - SLACK) or (
            score.greatest is not None and value > score.greatest + SLACK
        ):
            raise Wrong(
                f"{what} returned {name} = {value:g}, outside its range of {score.least} to {score.greatest}.",
                "Mend the score, or what `scores` declares of it.",
            )
    _is_json(values, what)
    return values


def _same_scores(first: Mapping[str, float], second: Mapping[str, float], when: str) -> None:
    for name, value in first.items():
        if name not in second or not math.isclose(value, second[name], rel_tol=1e-9, abs_tol=1e-9):
            raise Wrong(
                f"{name} is {value!r}, and {second.get(name)!r} with {when}.", "Let the order make no difference."
            )


def _is_json(document: Any, what: str) -> None:
    try:
        json.dumps(document, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Wrong(f"{what} is not JSON: {error}.", "Convert numpy values with float() and tolist().") from error


def _installed(name: str) -> Evaluator:
    from benchbot.core.plugin_manager import load

    method: Evaluator = load().record("evaluators", name)
    return method
