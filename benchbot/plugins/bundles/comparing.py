"""Two results of the same run, one from a bundle and one made anew: are they the same, and what differs first?"""

from collections.abc import Iterator, Mapping
from typing import Any

_OF_THE_MACHINE = ("benchbot", "plugins", "assets", "solution", "machine", "restarts")
"""What of provenance may differ between two runs that are identical: where, by which software and how it was run."""


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Return what is not the same in two results, first what comes first in a run; empty for identical ones."""
    said, found = _outcome(before), _outcome(after)
    if said == found:
        return []
    return [*_of_the_way(before, after), *_of_the_end(before, after), *_elsewhere(said, found)]


def _outcome(document: Mapping[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in document.items() if key != "provenance"}
    provenance = document.get("provenance") or {}
    # An older result has no log of its actions; what it saw is in its digest.
    kept.pop("actions", None)
    return {**kept, "provenance": {key: provenance[key] for key in provenance if key not in _OF_THE_MACHINE}}


def _of_the_way(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    """Yield where the two runs part: by what was seen, or by what the solution did."""
    said, found = before["provenance"]["observation_digest"], after["provenance"]["observation_digest"]
    first, second = _rows(before), _rows(after)
    if said == found:
        return
    for number, ((scene, one), (_, other)) in enumerate(zip(first, second, strict=False)):
        if one[1:] != other[1:]:
            told = f"{_action(other)} instead of {_action(one)}"
            yield f"The solution acts otherwise, first before observation {number} ({scene}): {told}."
            return
        if one[0] != other[0]:
            yield f"Something else is seen, first at observation {number} ({scene}, after {_action(one)})."
            return
    if first and second and len(first) != len(second):
        yield f"There are {len(second)} observations instead of {len(first)}; as long as there are both, they agree."
    else:
        yield "Something else is seen: the digests of the observations differ."


def _of_the_end(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    said, found = _failure(before), _failure(after)
    if said != found:
        yield f"It ended otherwise: {found} instead of {said}."
    pointer = _first(before.get("results"), after.get("results"), "/results")
    if pointer is not None:
        yield f"The results differ, first at {pointer}."


def _elsewhere(said: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[str]:
    pointer = _first(
        {key: value for key, value in said.items() if key != "results"},
        {key: value for key, value in found.items() if key != "results"},
        "",
    )
    if pointer is not None:
        yield f"The documents differ, first at {pointer}."


def _first(one: Any, other: Any, pointer: str) -> str | None:
    """Return where two JSON values differ first, as a pointer with both of them."""
    left = [(one, other, pointer)]
    while left:
        one, other, pointer = left.pop()
        if isinstance(one, dict) and isinstance(other, dict):
            keys = sorted({*one, *other}, reverse=True)
            left += [(one.get(key, _NOTHING), other.get(key, _NOTHING), f"{pointer}/{key}") for key in keys]
        elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
            pairs = enumerate(zip(one, other, strict=True))
            left += [(a, b, f"{pointer}/{number}") for number, (a, b) in pairs][::-1]
        elif one != other or type(one) is not type(other):
            return f"{pointer} ({_shown(other)} instead of {_shown(one)})"
    return None


_NOTHING = object()


def _shown(value: Any) -> str:
    if value is _NOTHING:
        return "nothing"
    if isinstance(value, list):
        return f"{len(value)} items"
    return "a mapping" if isinstance(value, dict) else f"{value!r:.40}"


def _rows(document: Mapping[str, Any]) -> list[tuple[str, list[Any]]]:
    return [(scene["scene"], row) for scene in document.get("actions") or () for row in scene["rows"]]


def _action(row: list[Any]) -> str:
    if len(row) < 2:
        return "none"
    values = ", ".join(str(value) for value in (row[2].values() if len(row) > 2 else ()))
    return f"{row[1]}({values})"


def _failure(document: Mapping[str, Any]) -> str:
    failure = document["provenance"]["failure"]
    return "well" if failure is None else f"{failure['class']} ({failure['why']})"
