"""Compares results with those of the same run on this machine: documents, scores and software."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from benchbot.core import overrides, plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import software
from benchbot.core.randomness import commitment, is_secret
from benchbot.core.request import AUTO, Limits, RunRequest
from benchbot.core.selection import Selection, device_here, select

_MACHINE_KEYS = ("benchbot", "plugins", "assets", "solution", "machine")
"""Keys of provenance that may differ between identical runs: they say where, and by which software it was run."""


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Return the differences of two results, the first in a run first; empty for identical ones."""
    stated, found = _without_machine(before), _without_machine(after)
    if stated == found:
        return []
    failures = [_failure(before), _failure(after)]
    device = other_device(before["provenance"], after["provenance"])
    pointers = [
        ("The results differ", _first(before.get("results"), after.get("results"), "/results")),
        ("The documents differ", _first({**stated, "results": None}, {**found, "results": None}, "")),
    ]
    return [
        *([device] if device else []),
        *_run_differences(before, after),
        *([f"It ended otherwise: {failures[1]} instead of {failures[0]}."] if failures[0] != failures[1] else []),
        *(f"{text}, first at {pointer}." for text, pointer in pointers if pointer is not None),
    ]


def _without_machine(document: Mapping[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in document.items() if key != "provenance"}
    provenance = document.get("provenance") or {}
    # An older result has no log of its actions; its digest covers its observations.
    kept.pop("actions", None)
    return {**kept, "provenance": {key: provenance[key] for key in provenance if key not in _MACHINE_KEYS}}


def _run_differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    """Yield the first difference of two runs, in an observation or an action."""
    if before["provenance"]["observation_digest"] == after["provenance"]["observation_digest"]:
        return
    first, second = _action_rows(before), _action_rows(after)
    for number, ((scene, one), (_, other)) in enumerate(zip(first, second, strict=False)):
        if one[1:] != other[1:]:
            actions = f"{action_text(other[1:])} instead of {action_text(one[1:])}"
            yield f"The solution acts otherwise, first before observation {number} ({scene}): {actions}."
            return
        if one[0] != other[0]:
            yield f"Something else is seen, first at observation {number} ({scene}, after {action_text(one[1:])})."
            return
    if first and second and len(first) != len(second):
        yield f"There are {len(second)} observations instead of {len(first)}; as long as there are both, they agree."
    else:
        yield "Something else is seen: the digests of the observations differ."


def _first(one: Any, other: Any, pointer: str) -> str | None:
    """Return the JSON pointer of the first difference of two values, with both values; None for equal ones."""
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


def _action_rows(document: Mapping[str, Any]) -> list[tuple[str, list[Any]]]:
    return [(scene["scene"], row) for scene in document.get("actions") or () for row in scene["rows"]]


def action_text(taken: Sequence[Any]) -> str:
    """Return an action of the log, `[name, arguments]` or less, as text: `move_distance(0.5)`."""
    if not taken:
        return "none"
    values = ", ".join(str(value) for value in (taken[1].values() if len(taken) > 1 else ()))
    return f"{taken[0]}({values})"


def _failure(document: Mapping[str, Any]) -> str:
    failure = document["provenance"]["failure"]
    return "well" if failure is None else f"{failure['class']} ({failure['why']})"


def score_contradictions(stated: Mapping[str, Any], found: Mapping[str, Any], tolerance: float = 0.0) -> list[str]:
    """Return the differences of more than `tolerance` between two scores documents of the same results."""
    method, here = stated["method"], found["method"]
    if method["name"] != here["name"]:
        return [f"The scores are of the method '{method['name']}', here they are of '{here['name']}'."]
    said, scored = ({_row_label(row): row for row in document["rows"]} for document in (stated, found))
    problems = [f"{label}: it is among the scores, but not among the results." for label in said if label not in scored]
    problems += [f"{label}: the scores do not mention it." for label in scored if label not in said]
    for label in (label for label in said if label in scored):
        problems += [
            f"{label}: {text}" for text in unequal_scores(said[label]["scores"], scored[label]["scores"], tolerance)
        ]
    return problems + [f"all: {text}" for text in unequal_scores(stated["scores"], found["scores"], tolerance)]


def unequal_scores(stated: Mapping[str, float], found: Mapping[str, float], tolerance: float = 0.0) -> list[str]:
    """Return the scores that differ by more than `tolerance`, as text: `OMQ is 0.5, not 0.7`."""
    texts = []
    for name in dict.fromkeys([*stated, *found]):
        if name not in stated or name not in found:
            texts.append(f"{name} is only among the scores {'stated' if name in stated else 'found'}")
        elif not math.isclose(stated[name], found[name], rel_tol=1e-12, abs_tol=max(tolerance, 1e-12)):
            texts.append(f"{name} is {found[name]:.6g}, not {stated[name]:.6g}")
    return texts


def _row_label(row: Mapping[str, Any]) -> str:
    """Return a label that tells a row of scores from the others: `miniroom:1, seed 3`."""
    said = [f"{key} {row[key]}" for key in ("seed", "episode", "repeat") if row.get(key) is not None]
    return ", ".join(filter(None, [str(row["environment"]), *said, overrides.label(row.get("settings") or {})]))


@dataclass(frozen=True)
class SoftwareDifference:
    """A plug-in or asset pack that is not the one a result ran on: version (not of packs) and content, or None."""

    name: str
    recorded: Mapping[str, Any] | None
    installed: Mapping[str, Any] | None

    @property
    def version(self) -> str | None:
        """The version that the result ran on."""
        return None if self.recorded is None else self.recorded.get("version")

    @property
    def installed_version(self) -> str | None:
        """The version that is installed."""
        return None if self.installed is None else self.installed.get("version")

    def __str__(self) -> str:
        said = "did not use it" if self.recorded is None else f"is of {_pin_text(self.recorded)}"
        here = "it is not installed" if self.installed is None else f"here it is {_pin_text(self.installed)}"
        return f"{self.name}: the result {said}, {here}"


def reselect(provenance: Mapping[str, Any], catalog: Catalog, limits: Limits | None = None) -> Selection:
    """Return the selection that a result's provenance names; `limits` replace the task's.

    Raises BenchbotError when it is not possible here, when the result is of a real robot, and when the list of its
    episode has changed.
    """
    chosen = provenance["selection"]
    episode = chosen.get("episode")
    _check_disclosed(chosen)
    selection = select(
        catalog,
        RunRequest(
            task=str(chosen["task"]),
            robot=str(chosen["robot"]),
            environment=str(chosen["environment"]),
            seed=int(chosen["seed"]),
            episode=None if episode is None else int(episode["number"]),
            settings=chosen.get("settings") or {},
            secret=str(chosen.get("secret", "")),
        ),
    )
    selection = _on_its_device(selection, provenance, catalog)
    if selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers"):
        raise BenchbotError(
            f"The result is of a real robot ('{selection.robot.name}').",
            "The world does not repeat itself: the same actions do not show the same again.",
            "Look at its recording, if there is one; results of simulated robots can be repeated.",
        )
    here = None if selection.episode is None else selection.episode.provenance()
    if here != episode:
        raise BenchbotError(
            "The list of episodes is not the one that the result is of.",
            f"The result is of {_episode_text(episode)}, here there is {_episode_text(here)}.",
            "Install the versions that its provenance names.",
        )
    return selection if limits is None else replace(selection, limits=limits)


def _on_its_device(selection: Selection, provenance: Mapping[str, Any], catalog: Catalog) -> Selection:
    """Return a selection that is simulated on the kind of device of the result, where there is one here."""
    there = replace(selection, device=device_kind(provenance) or AUTO)
    try:
        device_here(catalog, there)
    except BenchbotError:
        return selection
    return there


def device_kind(provenance: Mapping[str, Any]) -> str | None:
    """Return the kind of device that a result was simulated on, such as `cuda`; None where it does not say."""
    device = provenance.get("machine", {}).get("device")
    return None if device is None else str(device).partition(":")[0]


def other_device(before: Mapping[str, Any], after: Mapping[str, Any]) -> str | None:
    """Return on which device each of two provenances was simulated, as a sentence; None when they are the same."""
    stated, found = (each.get("machine", {}).get("device") for each in (before, after))
    if stated == found or stated is None or found is None:
        return None
    return f"It was simulated on {found} instead of {stated}, whose pictures are not the same to the byte."


def _check_disclosed(chosen: Mapping[str, Any]) -> None:
    """Raise BenchbotError when a result's seed and secret are not there, or not those that the run was committed to."""
    secret, seed, committed = chosen.get("secret", ""), chosen.get("seed"), chosen.get("commitment")
    if seed is None or (committed is not None and not secret):
        raise BenchbotError(
            f"The {'seed' if seed is None else 'secret'} of the run is not disclosed in the result.",
            "All that was random was drawn from it, so that nothing can be repeated without it.",
            "Ask whoever ran it for the result as the back end has kept it.",
        )
    if secret and (not is_secret(str(secret)) or commitment(str(secret), int(seed)) != committed):
        raise BenchbotError(
            "The result's secret or seed is not the one that the run was committed to.",
            f"The commitment is {committed}, and that of the secret and seed in the result is another one.",
            "The result was changed: ask whoever ran it for the one that the back end has kept.",
        )


def software_differences(provenance: Mapping[str, Any], selection: Selection) -> list[SoftwareDifference]:
    """Return the differences between the software that would run a selection here and that of a result, by name."""
    recorded, here = _pins(provenance), _pins(software(selection))
    names = sorted(name for name in {*recorded, *here} if recorded.get(name) != here.get(name))
    return [SoftwareDifference(name, recorded.get(name), here.get(name)) for name in names]


def missing_software(provenance: Mapping[str, Any]) -> list[SoftwareDifference]:
    """Return the distributions that a result ran on and that are not installed here; folders have no release."""
    return [
        SoftwareDifference(name, used, None)
        for name, used in sorted(provenance["plugins"].items())
        if used["version"][:1].isdigit() and not _is_installed(name)
    ]


def _is_installed(distribution: str) -> bool:
    try:
        version(distribution)
    except (PackageNotFoundError, ValueError):
        return False
    return True


def _pins(used: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    packs = {f"asset pack {name}": pinned for name, pinned in used.get("assets", {}).items()}
    return {**used["plugins"], **packs}


def _pin_text(pinned: Mapping[str, Any]) -> str:
    return " ".join(filter(None, [str(pinned.get("version", "")), f"(content {str(pinned['sha256'])[:8]})"]))


def _episode_text(chosen: Mapping[str, Any] | None) -> str:
    return "none" if chosen is None else f"{chosen['list']} (content {str(chosen['sha256'])[:8]})"
