"""Preflight: what would fail an episode is found before the first one, all of it at once, each with the fix."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import wait
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog, Declaration
    from benchbot.core.records import WorkOrder
    from benchbot.submission.modes import SolutionSpec

P = ParamSpec("P")


@dataclass(frozen=True)
class Submission:
    """A solution that is to be run in a mode; `options` are the mode's own."""

    spec: "SolutionSpec"
    mode: str
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Intent:
    """What a command is about to start.

    `record` names recorders and where each writes; `folders` are written to as well, and need `free_bytes` of room.
    `executor` runs workers by an `order`; None is this process.
    """

    scenes: "Sequence[Declaration]" = ()
    submissions: Sequence[Submission] = ()
    method: str | None = None
    record: Mapping[str, Path] = field(default_factory=dict)
    folders: Sequence[Path] = ()
    free_bytes: int = 50 * 2**20
    executor: str | None = None
    order: "WorkOrder | None" = None


def scenes_of(catalog: "Catalog", environments: Iterable[str]) -> "list[Declaration]":
    """Return the scenes of environments, each once; an environment that is not known is for `select` to tell.

    Those of sets are made by all processors. It tells how far it is, and whatever asks for these scenes later has them
    at once.
    """
    from benchbot.cli.kit.making import making
    from benchbot.cli.kit.status_line import working
    from benchbot.core import long_work

    found: dict[str, Declaration] = {}
    texts = list(environments)
    unmade = {text: place for text in texts if (place := catalog.unmade(text)) is not None}
    with working("Making environments"), making(unmade) as under_way:
        for text in long_work.counted("Making environments", texts):
            if text in under_way:
                wait([under_way[text]])
            with suppress(BenchbotError):
                found |= {scene.name: scene for scene in catalog.environments(text)}
    return list(found.values())


class Preflight:
    """The errors that a command has met before anything was started, to be raised together."""

    def __init__(self, what: str) -> None:
        self._what = what
        self.errors: list[BenchbotError] = []

    def take(self, function: Callable[P, Any], *arguments: P.args, **options: P.kwargs) -> Any:
        """Return what a function returns; None when it raises a BenchbotError, which is kept."""
        from benchbot.core.selection import ImpossibleError

        try:
            return function(*arguments, **options)
        except BenchbotError as error:
            self.errors += error.reasons if isinstance(error, ImpossibleError) else [error]
            return None

    def prove(self, catalog: "Catalog", intent: Intent, *, tell_all: bool = False) -> None:
        """Make the checks of all plug-ins; warn, say what was proven if asked to, and raise BenchbotError if it is not.

        The error names all that is wrong, what was taken before among it.
        """
        from benchbot.core.findings import Level
        from benchbot.core.selection import all_of

        for check in catalog.plugins.pool("checks").values():
            for finding in self.take(lambda find: list(find(catalog, intent)), check.value.find) or ():
                if finding.level is Level.BROKEN:
                    self.errors.append(BenchbotError(finding.subject, finding.detail, finding.fix))
                else:
                    console.findings([finding], tell_all=tell_all)
        if self.errors:
            raise all_of(self._what, list({(error.title, error.why): error for error in self.errors}.values()))
