"""Solutions as an axis of a batch: `NAME=COMMAND` texts, and one plan of the plans of all of them."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError
from benchbot.core.selection import ImpossibleError, all_of
from benchbot.plugins.batch.plan import Plan, plan_hash
from benchbot.plugins.batch.request import SOLUTIONS, Wanted

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.source_files import SourceFiles

_NAME = re.compile(r"\w[\w.-]{0,39}")
_LABEL_LENGTH = 100


def each(wanted: Wanted) -> dict[str | None, Wanted]:
    """Return what is wanted with each solution, by its name; None is the only one of a batch without names.

    A command begins with what it is, unless it is native: `example:NAME`, `sandbox:COMMAND`, `containerised:FOLDER`.
    Raises BenchbotError for a text that names no solution, and for another solution beside named ones.
    """
    given = wanted.get("solutions")
    if given is None:
        return {None: wanted}
    others = [f"--{key}" for key in SOLUTIONS if wanted.get(key) is not None]
    if others:
        raise BenchbotError(
            "It is not clear what to submit.",
            f"--solution and {others[0]} were given.",
            f"Name that one as well: --solution NAME=COMMAND, where COMMAND may be {SOLUTIONS[-1]}:…",
        )
    rest = {key: value for key, value in wanted.items() if key != "solutions"}
    return {name: {**rest, **_solution(command)} for name, command in _named(given).items()}


def plan(
    wanted: Mapping[str | None, Wanted], catalog: "Catalog", folder: "Path"
) -> "tuple[Plan, dict[str | None, SourceFiles]]":
    """Return the plan of a batch, and the files of each solution by its name; raises BenchbotError as `matrix.make`."""
    from benchbot.plugins.batch import matrix, solution_options
    from benchbot.plugins.batch.request import request_of

    plans: dict[str | None, Plan] = {}
    files: dict[str | None, SourceFiles] = {}
    errors: dict[tuple[str, str], BenchbotError] = {}
    for name, one in wanted.items():
        try:
            request = replace(request_of(one), hold=solution_options.hold_of(catalog, one))
            plans[name], files[name] = matrix.make(request, catalog, folder)
        except BenchbotError as error:
            for reason in error.reasons if isinstance(error, ImpossibleError) else [error]:
                errors.setdefault((reason.title, reason.why), reason)
    if errors:
        raise all_of("This batch", list(errors.values()))
    return plans[None] if None in plans else combined({str(name): each for name, each in plans.items()}), files


def combined(plans: Mapping[str, Plan]) -> Plan:
    """Return one plan, in which the same episode of all solutions comes together, so that pairs are whole early."""
    episodes = []
    by_key: dict[str, str] = {}
    for group in zip(*(one.episodes for one in plans.values()), strict=True):
        for name, episode in zip(plans, group, strict=True):
            other = by_key.setdefault(episode.key, name)
            if other != name:
                raise BenchbotError(
                    f"The solutions '{other}' and '{name}' are the same.",
                    "Command, files and all else that determines their results are equal.",
                    "Leave one of them out; to see how results differ from run to run: --repeats N",
                )
            label = f"{name}_{episode.label}"[:_LABEL_LENGTH]
            episodes.append(replace(episode, label=label, solution=name))
    first = next(iter(plans.values()))
    solutions = {name: one.solution for name, one in plans.items()}
    return replace(first, hash=plan_hash(tuple(episodes)), episodes=tuple(episodes), solutions=solutions)


def _named(given: Mapping[str, str] | Sequence[str]) -> dict[str, str]:
    pairs = list(given.items()) if isinstance(given, Mapping) else [text.partition("=")[::2] for text in given]
    found: dict[str, str] = {}
    for name, command in pairs:
        if not _NAME.fullmatch(name) or not command.strip() or name in found:
            raise BenchbotError(
                f"--solution {name}={command} names no solution.",
                f"The name '{name}' is given twice."
                if name in found
                else "A solution is a name (letters, digits, '.', '-', '_'), an equals sign and a command.",
                "Write it like this: --solution 'ours=python ours.py' --solution base=example:hello_passive",
            )
        found[name] = command
    return found


def _solution(command: str) -> Wanted:
    kind, separator, rest = command.partition(":")
    return {kind: rest.strip()} if separator and kind in SOLUTIONS else {"native": command}
