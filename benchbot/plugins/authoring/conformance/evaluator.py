"""The conformance of methods of evaluation."""

import json
import math
import random
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations
from typing import Any

from benchbot.core.budget import Spent
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.records import Evaluator
from benchbot.plugins.authoring.conformance.bench import find_record
from benchbot.plugins.authoring.conformance.properties import Violation, check_properties

TOLERANCE = 1e-9


@dataclass(frozen=True)
class Example:
    """A result, and the ground truths that it is scored against."""

    result: Any
    ground_truths: Sequence[Any] = ()


def check_evaluator(
    evaluator: Evaluator | str,
    *,
    perfect: Example,
    empty: Example | None = None,
    others: Sequence[Example] = (),
    unordered: Sequence[str] = (),
) -> list[Finding]:
    """Return findings on whether a method of evaluation does as its hook asks.

    `perfect` is an example that cannot be scored higher, `empty` one of a solution that found nothing, `others` are any
    other examples. `unordered` names lists in `results`, such as `objects`, whose order means nothing.
    """
    method = find_record("evaluators", evaluator)
    scored = {"perfect": perfect, **{f"example {number}": example for number, example in enumerate(others, 1)}}
    examples = list(scored.values())
    properties = {
        "declaration": partial(_is_declared_well, method),
        **{f"scores: {name}": partial(_scores_well, method, example) for name, example in scored.items()},
        "scores: declared": partial(_gives_what_it_declares, method, examples),
        "scores: perfect is best": partial(_scores_perfect_best, method, perfect, others),
    }
    properties["scores: all attempts"] = partial(_counts_all_attempts, method, examples)
    if empty is not None:
        properties["scores: empty"] = partial(_scores_or_refuses, method, empty)
    properties |= {f"order of {key}": partial(_ignores_order, method, examples, key) for key in unordered}
    properties |= {
        "combine: order": partial(_combines_in_any_order, method, examples),
        "combine: missing": partial(_counts_missing, method, perfect),
        "combine: one": partial(_combines_one, method, perfect),
    }
    if method.explain is not None:
        properties["explanation"] = partial(_explains, method, perfect)
    return check_properties(properties)


def _is_declared_well(method: Evaluator) -> str:
    if not method.name or not method.version:
        raise Violation("It has no name or no version.", "Give both; change the version whenever the numbers change.")
    if not method.result_formats:
        raise Violation("It reads no result format.", "Name those that it can score in result_formats.")
    for name in ("result_formats", "ground_truth_formats"):
        kind = type(getattr(method, name))
        if not issubclass(kind, frozenset):
            raise Violation(f"{name} is a {kind.__name__}.", "Give a frozenset of names of formats.")
    for name, score in method.scores.items():
        if score.least is not None and score.greatest is not None and not score.least < score.greatest:
            raise Violation(f"{name} is between {score.least} and {score.greatest}.", "Give the least value first.")
    return f"{method.name} {method.version}, of {', '.join(sorted(method.result_formats))}"


def _scores_well(method: Evaluator, example: Example) -> str:
    fix = "Copy what you change: others read them after you."
    with _unaltered(example, "It altered the result or its ground truth.", fix):
        values = _evaluate(method, example)
    if _evaluate(method, example) != values:
        raise Violation(
            "The same result has other scores the second time.", "Seed what is random in a method of evaluation."
        )
    if method.headline and method.headline not in values:
        raise Violation(
            f"Its headline '{method.headline}' is not among its scores ({', '.join(values)}).",
            "Name the score that stands for a result.",
        )
    return _headline_score(method, values)


def _gives_what_it_declares(method: Evaluator, examples: Sequence[Example]) -> str:
    given = {name for example in examples for name in _evaluate(method, example)}
    never = set(method.scores) - given
    if never:
        raise Violation(
            f"No example has the declared {', '.join(sorted(never))}.",
            "Give an example that has it, or mend the name in `scores`.",
            Level.WARNING,
        )
    undeclared = given - set(method.scores)
    if undeclared:
        raise Violation(
            f"Nobody knows how to read {', '.join(sorted(undeclared))}.",
            "Say it in `scores`: which way is better, and between which bounds.",
            Level.WARNING,
        )
    return ", ".join(sorted(given))


def _scores_perfect_best(method: Evaluator, perfect: Example, others: Sequence[Example]) -> str:
    values = _evaluate(method, perfect)
    name = _headline(method, values)
    score = method.score(name)
    if score.lower_is_better is None:
        raise Violation(
            f"It does not say whether less of '{name}' is better.",
            f"Declare it: scores={{'{name}': Score(lower_is_better=False, least=0.0, greatest=1.0)}}",
        )
    best = score.least if score.lower_is_better else score.greatest
    if best is not None and abs(values[name] - best) > TOLERANCE:
        raise Violation(f"{name} of a perfect result is {values[name]!r}.", f"Score it with the best there is: {best}.")
    sign = -1 if score.lower_is_better else 1
    for number, example in enumerate(others, 1):
        other = _evaluate(method, example)[name]
        if sign * other > sign * values[name] + TOLERANCE:
            raise Violation(
                f"{name} of example {number} is {other!r}, better than {values[name]!r} of the perfect one.",
                "Score what is perfect highest, or give a perfect example.",
            )
    return _headline_score(method, values)


def _counts_all_attempts(method: Evaluator, examples: Sequence[Example]) -> str:
    """Collisions before the last attempt must count where a method counts collisions at all."""
    counted = 0
    for example in (one for one in examples if "collisions" in _evaluate(method, one)):
        spent = replace(Spent.of(example.result), restarts=2, collisions=7)
        told = {**(example.result.get("provenance") or {}), "restarts": 2, "spent": spent.repeatable()}
        try:
            values = _evaluate(method, replace(example, result={**example.result, "provenance": told}))
        except BenchbotError:
            continue
        if values.get("collisions") != 7:
            raise Violation(
                f"It gives {values.get('collisions')!r} collisions to an episode of 3 attempts with 7 collisions.",
                "Count those of all attempts: benchbot.plugin.Spent.of(result).collisions; "
                "a track is that of the last attempt.",
            )
        counted += 1
    return f"collisions of {counted} examples" if counted else "it counts no collisions"


def _scores_or_refuses(method: Evaluator, empty: Example) -> str:
    try:
        values = _evaluate(method, empty)
    except BenchbotError as error:
        return f"refused: {error.title}"
    return _headline_score(method, values)


def _ignores_order(method: Evaluator, examples: Sequence[Example], key: str) -> str:
    tried = 0
    for example in examples:
        entries = (example.result.get("results") or {}).get(key, [])
        for seed in range(3 if len(entries) > 1 else 0):
            shuffled = deepcopy(example)
            random.Random(seed).shuffle(shuffled.result["results"][key])  # noqa: S311
            _require_same(_evaluate(method, example), _evaluate(method, shuffled), f"{key} in another order")
            tried += 1
    if not tried:
        raise Violation(f"No example has two entries in '{key}'.", "Give one that has.")
    return f"{tried} other orders"


def _combines_in_any_order(method: Evaluator, examples: Sequence[Example]) -> str:
    rows = [*(_evaluate(method, example) for example in examples), {}][:4]
    first = _combine(method, rows)
    for order in permutations(rows):
        _require_same(first, _combine(method, list(order)), "results in another order")
    return f"of {len(rows)} results"


def _counts_missing(method: Evaluator, perfect: Example) -> str:
    values = _evaluate(method, perfect)
    name = _headline(method, values)
    alone, beside = _combine(method, [values]), _combine(method, [values, {}])
    _combine(method, [{}])
    if name not in beside:
        raise Violation(f"The summary beside a missing result lacks '{name}'.", "Give the same scores as without one.")
    if method.score(name).lower_is_better is False and beside[name] > alone[name] + TOLERANCE:
        fix = "Count a missing result (an empty dict) as a failure."
        raise Violation(f"A missing result makes {name} better.", fix)
    return f"{name} {alone[name]:.4g} alone, {beside[name]:.4g} beside a missing one"


def _combines_one(method: Evaluator, perfect: Example) -> str:
    values = _evaluate(method, perfect)
    with _unaltered(values, "combine altered the scores that it was given.", "Return new ones."):
        combined = _combine(method, [values])
    name = _headline(method, values)
    if name not in combined:
        raise Violation(f"The summary lacks the headline '{name}'.", "Give it in the summary, too.")
    if abs(combined[name] - values[name]) > TOLERANCE:
        raise Violation(
            f"{name} is {values[name]!r} of one result and {combined[name]!r} of the summary of it alone.",
            "Let the summary of one result be its score.",
        )
    return f"{name} {combined[name]:.4g}"


def _explains(method: Evaluator, perfect: Example) -> str:
    if method.explain is None:
        return "none"
    with _unaltered(perfect, "explain altered the result or its ground truth.", "Copy what you change."):
        document = method.explain(perfect.result, perfect.ground_truths)
    _require_json(document, "The explanation")
    return ", ".join(document) or "says nothing"


def _headline(method: Evaluator, values: Mapping[str, float]) -> str:
    return method.headline or next(iter(values))


def _headline_score(method: Evaluator, values: Mapping[str, float]) -> str:
    name = _headline(method, values)
    return f"{name} {values[name]:.4g}"


def _evaluate(method: Evaluator, example: Example) -> dict[str, float]:
    return _checked(method, method.evaluate(example.result, example.ground_truths), "evaluate")


def _combine(method: Evaluator, rows: Sequence[dict[str, float]]) -> dict[str, float]:
    return _checked(method, method.combine(rows), "combine")


def _checked(method: Evaluator, values: Any, function: str) -> dict[str, float]:
    """Return what a function of the method returned; raises `Violation` where that is not a mapping of sound scores."""
    if not isinstance(values, dict) or not values:
        raise Violation(f"{function} returned {values!r}.", "Return a dict of scores by name.")
    for name, value in values.items():
        if not isinstance(name, str) or isinstance(value, bool) or not isinstance(value, int | float):
            raise Violation(
                f"{function} returned {name!r}: {value!r}, a {type(value).__name__}.",
                "Return float(value) for each score.",
            )
        if not math.isfinite(value):
            fix = "Raise BenchbotError where there is no number to give."
            raise Violation(f"{function} returned {name} = {value}.", fix)
        score = method.score(name)
        if (score.least is not None and value < score.least - TOLERANCE) or (
            score.greatest is not None and value > score.greatest + TOLERANCE
        ):
            raise Violation(
                f"{function} returned {name} = {value:g}, outside its range of {score.least} to {score.greatest}.",
                "Mend the score, or what `scores` declares of it.",
            )
    _require_json(values, function)
    return values


@contextmanager
def _unaltered(value: object, detail: str, fix: str) -> Iterator[None]:
    """Raise `Violation` when the block changes a value."""
    before = deepcopy(value)
    yield
    if value != before:
        raise Violation(detail, fix)


def _require_same(first: Mapping[str, float], second: Mapping[str, float], when: str) -> None:
    for name, value in first.items():
        if name not in second or not math.isclose(value, second[name], rel_tol=TOLERANCE, abs_tol=TOLERANCE):
            raise Violation(
                f"{name} is {value!r}, and {second.get(name)!r} with {when}.", "Let the order make no difference."
            )


def _require_json(document: Any, name: str) -> None:
    try:
        json.dumps(document, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Violation(f"{name} is not JSON: {error}.", "Convert numpy values with float() and tolist().") from error
