"""What can be chosen: every task, robot and environment, with the reasons why one does not go with what is chosen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, islice, permutations

from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.request import RunRequest
from benchbot.core.selection import ImpossibleError, select

MOST_ENVIRONMENTS = 500
"""A task of several scenes can take place in any order of variants. So many are offered; a shell takes them all."""


@dataclass(frozen=True)
class Choice:
    """Something to choose, and every reason against it; it is possible when there is none."""

    name: str
    reasons: tuple[BenchbotError, ...] = ()

    @property
    def why_not(self) -> str:
        """The first reason in a line, empty where there is none."""
        return " ".join(f"{reason.title} {reason.why}".split()) if (reason := next(iter(self.reasons), None)) else ""


class RememberingCatalog(Catalog):
    """A catalog that checks a declaration once, however often it is asked for."""

    def __init__(self, catalog: Catalog) -> None:
        super().__init__(catalog.plugins)
        self._checked: dict[tuple[str, str], Declaration | BenchbotError] = {}

    def get(self, kind: str, name: str) -> Declaration:
        """Return a validated declaration; raises BenchbotError as the first time."""
        found = self._checked.get((kind, name))
        if found is None:
            try:
                found = super().get(kind, name)
            except BenchbotError as error:
                found = error
            self._checked[kind, name] = found
        if isinstance(found, BenchbotError):
            raise found
        return found


class Possibilities:
    """Answers what can be run, one choice after the other: the task, then the robot, then the environment."""

    def __init__(self, catalog: Catalog) -> None:
        self.catalog = RememberingCatalog(catalog)
        self._known: dict[tuple[str, str, str], tuple[BenchbotError, ...]] = {}

    def tasks(self) -> list[Choice]:
        """Return all tasks; one is possible when some robot can do it in some environment."""
        return [Choice(task, self._against_task(task)) for task in self.catalog.names("tasks")]

    def robots(self, task: str) -> list[Choice]:
        """Return all robots; one is possible when it can do the task in some environment."""
        return [Choice(robot, self._against_robot(task, robot)) for robot in self.catalog.names("robots")]

    def environments(self, task: str, robot: str) -> list[Choice]:
        """Return all environments, of as many scenes as the task has."""
        return [Choice(name, self.against(task, robot, name)) for name in self.environment_names(task)]

    def environment_names(self, task: str) -> list[str]:
        """Return `NAME:VARIANT`, or `NAME:VARIANT:VARIANT` for a task of two scenes, and so on."""
        names = self.catalog.names("environments")
        try:
            count = self.catalog.get("tasks", task).data.get("scene_count", 1)
        except BenchbotError:
            count = 1
        return names if count == 1 else list(islice(_several(names, count), MOST_ENVIRONMENTS))

    def against(self, task: str, robot: str, environment: str) -> tuple[BenchbotError, ...]:
        """Return every reason why a combination is impossible."""
        key = (task, robot, environment)
        if key not in self._known:
            self._known[key] = self._asked(*key)
        return self._known[key]

    def _asked(self, task: str, robot: str, environment: str) -> tuple[BenchbotError, ...]:
        try:
            select(self.catalog, RunRequest(task=task, robot=robot, environment=environment))
        except ImpossibleError as error:
            return error.reasons
        except BenchbotError as error:
            return (error,)
        return ()

    def _against_robot(self, task: str, robot: str) -> tuple[BenchbotError, ...]:
        return _least(self.against(task, robot, name) for name in self.environment_names(task))

    def _against_task(self, task: str) -> tuple[BenchbotError, ...]:
        return _least(self._against_robot(task, robot) for robot in self.catalog.names("robots"))


def _several(names: Sequence[str], count: int) -> Iterator[str]:
    for place, group in groupby(names, lambda name: name.split(":")[0]):
        variants = [name.split(":")[1] for name in group]
        yield from (":".join([place, *scenes]) for scenes in permutations(variants, count))


def _least(all_reasons: Iterator[tuple[BenchbotError, ...]]) -> tuple[BenchbotError, ...]:
    """Return no reason when something is possible, else those of what is nearest to it."""
    nearest: tuple[BenchbotError, ...] | None = None
    for reasons in all_reasons:
        if not reasons:
            return ()
        if nearest is None or len(reasons) < len(nearest):
            nearest = reasons
    return nearest or (
        BenchbotError("There is nothing to run it with.", "No robot or environment is installed.", "Install some."),
    )
