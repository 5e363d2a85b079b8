"""The catalog: every declaration that installed plug-ins offer, in pools by kind and name."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.light_records import DeclarationFolder
from benchbot.core.plugin_manager import Plugins, Provided, conflict
from benchbot.core.resources import YAML_SUFFIXES, declaration_files

KINDS: dict[str, str] = {
    "tasks": "task",
    "robots": "robot",
    "environments": "environment",
    "formats": "format",
    "examples": "example",
    "batches": "batch",
    "episodes": "episodes",
}
"""Pools of declarations, and the schema of each: YAML files, but for episodes, which are JSON.

Ground truths have their own way: `Catalog.ground_truth_files`.
"""

MEMBER_MARK = "@"
"""The mark between the name of a fleet's declaration and that of the robot in it: `turtlebot4@tb03`."""

_NAMING_KEYS = {"environments": ("name", "variant"), "episodes": ("task", "environment")}


@dataclass(frozen=True)
class Declaration:
    """One declared thing: its data as written, its file, and the distribution or the folder that it came from."""

    kind: str
    name: str
    path: Path
    distribution: str
    data: dict[str, Any] = field(hash=False)
    folder: DeclarationFolder | None = None


class Catalog:
    """Pools of declarations. Names are read at first use of a pool, a declaration is validated when it is taken."""

    def __init__(self, plugins: Plugins) -> None:
        self.plugins = plugins
        self.broken: list[BenchbotError] = []
        """Declarations that cannot be read; each is left out of its pool and does not take the others down."""
        self._pools: dict[str, dict[str, Declaration]] = {}

    def names(self, kind: str) -> list[str]:
        """Return the sorted names of a pool; environments as `name:variant`, episodes as `task:name:variant`."""
        return sorted(self.pool(kind))

    def pool(self, kind: str) -> dict[str, Declaration]:
        """Return a pool by name, not yet validated; raises BenchbotError when a name is declared twice."""
        if kind not in self._pools:
            self._pools[kind] = self._read_pool(kind)
        return self._pools[kind]

    def find(self, kind: str, name: str) -> Declaration | None:
        """Return a declaration, not yet validated; None for an unknown name.

        The real robot `NAME@NAMESPACE` is the one in that namespace of all that NAME declares. An environment of a set
        is made when it has not been; raises BenchbotError when that fails.
        """
        pool = self.pool(kind)
        if kind == "environments" and name not in pool:
            return self._made(name)
        base, _, namespace = name.partition(MEMBER_MARK)
        if name in pool or kind != "robots" or not namespace or base not in pool:
            return pool.get(name)
        is_simulated = pool[base].data.get("type") in self.plugins.pool("simulators")
        return None if is_simulated else _member(pool[base], namespace, {"namespace": namespace})

    def get(self, kind: str, name: str) -> Declaration:
        """Return a validated declaration; raises BenchbotError for an unknown name and for code that is not trusted."""
        declaration = self.find(kind, name)
        if declaration is None:
            raise self.unknown(kind, name)
        schema.check(declaration.data, KINDS[kind], declaration.path)
        if declaration.folder is not None and declaration.data.get("functions"):
            declaration.folder.require_trust()
            # Now, not at the end of an episode, is the time to find a function that is not there.
            declaration.folder.functions(declaration.path, declaration.data["functions"])
        return declaration

    def unknown(self, kind: str, name: str) -> BenchbotError:
        """Return the error for a name that a pool does not hold."""
        noun = KINDS[kind]
        known = self.names(kind)
        made = self.made_environments if kind == "environments" else []
        return BenchbotError(
            f"'{name}' is not a known {noun}.",
            f"Known: {', '.join([*known, *made]) or 'none'}.{did_you_mean(name, known)}{self.plugins.broken_hint()}"
            + "".join(f" Unreadable: {error.title}" for error in self.broken),
            f"List them with: benchbot list {kind}",
        )

    def environments(self, text: str) -> list[Declaration]:
        """Return the scenes of an environment string `name:variant[:variant…]`."""
        name, *variants = text.split(":")
        if not name or not variants or not all(variants):
            known = self.names("environments")
            raise BenchbotError(
                f"'{text}' does not name an environment.",
                "An environment is written name:variant, or name:variant:variant for more scenes."
                f"{did_you_mean(text, known)}",
                "List them with: benchbot list environments",
            )
        return [self.get("environments", f"{name}:{variant}") for variant in variants]

    @property
    def made_environments(self) -> list[str]:
        """The environments that are made when they are first asked for: the first and the last name of each set."""
        sets = [provided.value for provided in self.plugins.pool("environment_sets").values()]
        return [f"{found.name}_1:1 to {found.name}_{found.size}:1" for found in sets]

    def unmade(self, name: str) -> tuple[str, int] | None:
        """Return the set and the number of an environment that is to be made yet, None where no set says so."""
        provided, number = self._set_of(name)
        if provided is None or provided.value.is_made is None or provided.value.is_made(number):
            return None
        return provided.value.name, number

    def made_ground_truth_files(self, name: str) -> tuple[Path, ...]:
        """Return the ground-truth files of an environment of a set, none of another; see `ground_truth_files`."""
        provided, number = self._set_of(name)
        folder = provided.value.make(number) / "ground_truths" if provided else None
        return tuple(declaration_files([folder], (".json",))) if folder else ()

    @cached_property
    def ground_truth_files(self) -> tuple[Path, ...]:
        """The declared ground-truth files. For evaluation and a run's host: nothing else may open them."""
        sources = (provided.value for provided in self.plugins.sources("ground_truths"))
        return tuple(declaration_files(sources, (".json",)))

    def _set_of(self, name: str) -> tuple[Provided | None, int]:
        """Return the set that an environment is of, and its number there."""
        base, _, digits = name.removesuffix(":1").rpartition("_")
        provided = self.plugins.pool("environment_sets").get(base)
        number = int(digits) if digits.isdecimal() and name == f"{base}_{int(digits)}:1" else 0
        return (provided, number) if provided and 1 <= number <= provided.value.size else (None, 0)

    def _made(self, name: str) -> Declaration | None:
        provided, number = self._set_of(name)
        if provided is None:
            return None
        (path,) = declaration_files([provided.value.make(number) / "environments"])
        found = Declaration("environments", name, path, provided.distribution, schema.read(path))
        return self._pools["environments"].setdefault(name, found)

    def _read_pool(self, kind: str) -> dict[str, Declaration]:
        pool: dict[str, Declaration] = {}
        suffixes = (".json",) if kind == "episodes" else YAML_SUFFIXES
        for source in self.plugins.sources(kind):
            for path in declaration_files([source.value], suffixes):
                try:
                    data = schema.read(path)
                    name = name_of(kind, data, path)
                except BenchbotError as error:
                    self.broken.append(error)
                    continue
                for found in _fleet(Declaration(kind, name, path, source.distribution, data, source.folder)):
                    if found.name in pool:
                        if source.folder is not None and source.folder.stands_in:
                            continue
                        first = pool[found.name]
                        raise conflict(kind, found.name, Provided(first, first.distribution, first.folder), source)
                    of_a_set = self._set_of(found.name)[0] if kind == "environments" else None
                    if of_a_set is not None:
                        raise conflict(kind, found.name, of_a_set, source)
                    pool[found.name] = found
        return pool


def _fleet(declaration: Declaration) -> Iterator[Declaration]:
    """Yield what a file declares: of a robot with the key `fleet`, each member of that, else the one thing."""
    fleet = declaration.data.get("fleet") if declaration.kind == "robots" else None
    # What is not a fleet by the schema is told as such when the robot is taken.
    if not isinstance(fleet, dict) or not fleet or not all(isinstance(settings, dict) for settings in fleet.values()):
        yield declaration
        return
    for member, settings in fleet.items():
        yield _member(declaration, str(member), settings)


def _member(robot: Declaration, member: str, driver: Mapping[str, Any]) -> Declaration:
    """Return one robot of a fleet: the common declaration, with its own settings of the driver."""
    name = f"{robot.name}{MEMBER_MARK}{member}"
    data = {**robot.data, "name": name, "driver": _merged(robot.data.get("driver", {}), driver)}
    return replace(robot, name=name, data=data)


def _merged(common: Any, own: Any) -> Any:
    """Return settings with one's own put into the common ones: mappings key by key, all else as a whole."""
    if not (isinstance(common, Mapping) and isinstance(own, Mapping)):
        return own
    return {**common, **{key: _merged(common.get(key), value) for key, value in own.items()}}


def name_of(kind: str, data: dict[str, Any], path: Path) -> str:
    """Return a declaration's name in its pool; raises BenchbotError when the file gives none."""
    keys = _NAMING_KEYS.get(kind, ("name",))
    missing = [key for key in keys if not isinstance(data.get(key), str | int) or data[key] == ""]
    if missing:
        raise BenchbotError(
            f"{path} has no {missing[0]}.",
            f"Every declaration of {kind} needs: {', '.join(keys)}.",
            f"Add a line '{missing[0]}: …' to the file.",
        )
    return ":".join(str(data[key]) for key in keys)
