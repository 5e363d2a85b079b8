"""The plug-in manager: what is installed, loading it, and keeping broken plug-ins from harming the others."""

import os
import pkgutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from traceback import extract_tb
from typing import Any

import pluggy

from benchbot.core import entry_points, hookspecs
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.hookspecs import KINDS
from benchbot.core.light_records import DeclarationFolder
from benchbot.core.records import API_VERSION

GROUP = "benchbot"


@dataclass(frozen=True)
class PluginInfo:
    """An installed plug-in by its metadata; reading that imports nothing."""

    name: str
    module: str
    distribution: str
    version: str


@dataclass(frozen=True)
class BrokenPlugin:
    """A plug-in that could not be loaded, and why."""

    info: PluginInfo
    cause: str


@dataclass(frozen=True)
class Provided:
    """A record or a declaration, with its distribution, or with the folder of no distribution that it came from."""

    value: Any
    distribution: str
    folder: DeclarationFolder | None = None


def installed(group: str = GROUP) -> list[PluginInfo]:
    """Return the installed plug-ins of an entry-point group, sorted by name, from metadata only.

    `BENCHBOT_PLUGINS=a,b` restricts them to the named distributions (beside benchbot's own), for reproducible runs.
    """
    wanted = os.environ.get("BENCHBOT_PLUGINS")
    names = None if wanted is None else {*filter(None, wanted.split(",")), "benchbot"}
    found: dict[tuple[str, str], PluginInfo] = {}
    for point in entry_points.find(group):
        if names is None or point.distribution in names:
            info = PluginInfo(point.name, point.value, point.distribution, point.version)
            # The first on sys.path is the one that Python would import; an older copy behind it is shadowed.
            found.setdefault((info.distribution, info.name), info)
    return sorted(found.values(), key=lambda info: (info.name, info.distribution))


CALLED = (
    *("create", "warm", "device", "diagnose", "evaluate", "combine", "explain"),
    *("read", "launch", "attach", "find", "folders", "installed", "take_options", "make", "is_made"),
)
"""Fields of records that are called, of all kinds of them."""


class Plugins:
    """The loaded plug-ins: their records by pool and name, and the sources of their declarations."""

    def __init__(self, infos: Sequence[PluginInfo]) -> None:
        self.broken: list[BrokenPlugin] = []
        self._infos: dict[str, PluginInfo] = {}
        self._manager = pluggy.PluginManager(GROUP)
        self._manager.add_hookspecs(hookspecs)
        for info in infos:
            self._register(info)

    def _register(self, info: PluginInfo) -> None:
        name = f"{info.distribution}:{info.name}"
        try:
            plugin = pkgutil.resolve_name(info.module + ":" * (":" not in info.module))  # else it hides why it fails
            _check_api(plugin)
            self._manager.register(plugin, name)
            self._manager.check_pending()
        # A third party's import may fail in any way at all; it is reported and must not take the others down.
        except (Exception, SystemExit) as error:  # noqa: BLE001
            if self._manager.has_plugin(name):
                self._manager.unregister(name=name)
            self._note(info, cause_of(error))
        else:
            self._infos[name] = info

    @cached_property
    def folders(self) -> tuple[DeclarationFolder, ...]:
        """The folders of declarations in use that no distribution has brought."""
        return tuple(
            folder for source in self.pool("declaration_sources").values() for folder in source.value.folders()
        )

    def sources(self, kind: str) -> list[Provided]:
        """Return the files and folders that plug-ins, and folders of no distribution, declare for a kind (`tasks`)."""
        paths = ((folder, path) for folder in self.folders for path in folder.sources(kind))
        return [*self._call(kind), *(Provided(path, str(folder.root), folder) for folder, path in paths)]

    def pool(self, kind: str) -> dict[str, Provided]:
        """Return the records of a kind (`simulators`, `evaluators`, …) by name.

        Raises BenchbotError when two distributions provide the same name; it names both.
        """
        record_type: Any = KINDS[kind]
        pool: dict[str, Provided] = {}
        for provided in [*self._call(kind), *(self._evaluators_of_folders() if kind == "evaluators" else ())]:
            record: Any = provided.value
            if not isinstance(record, record_type):
                raise BenchbotError(
                    f"The plug-in '{provided.distribution}' yields something that is not a {record_type.__name__}.",
                    f"Its hook benchbot_{kind} yielded {record!r}.",
                    f"Report this to the author of '{provided.distribution}', or uninstall it: "
                    f"benchbot uninstall {provided.distribution}",
                )
            if (named := _named_as_text(record)) is not None:
                place = getattr(record, named)
                raise BenchbotError(
                    f"The {record_type.__name__} '{record.name}' of '{provided.distribution}' cannot be used.",
                    f"Its hook benchbot_{kind} gives {named}={place!r}, which is text and cannot be called.",
                    f'Write in that hook: {named}=target("{place}"), with target from benchbot.plugin.',
                )
            if record.name in pool:
                raise conflict(kind, record.name, pool[record.name], provided)
            pool[record.name] = provided
        return pool

    def record(self, kind: str, name: str) -> Any:
        """Return one record by name; raises BenchbotError for an unknown one, and for code that is not trusted."""
        pool = self.pool(kind)
        if name not in pool:
            raise self.unknown(kind, name)
        provided = pool[name]
        if provided.folder is not None:
            provided.folder.require_trust()
        return provided.value

    def unknown(self, kind: str, name: str) -> BenchbotError:
        """Return the error for a name that a pool does not hold; it lists what is installed."""
        pool = self.pool(kind)
        noun = kind.rstrip("s").replace("_", " ")
        return BenchbotError(
            f"'{name}' is not an installed {noun}.",
            f"Installed: {', '.join(sorted(pool)) or 'none'}.{did_you_mean(name, list(pool))}{self.broken_hint()}",
            f"Install the plug-in that provides it, for example: benchbot install benchbot-{name.replace('_', '-')}",
        )

    def broken_hint(self) -> str:
        """Return a sentence about plug-ins that failed to load, or an empty string."""
        causes = "; ".join(f"{item.info.distribution} ({item.cause})" for item in self.broken)
        return f" Plug-ins that failed to load: {causes}." if causes else ""

    def _call(self, kind: str) -> Iterator[Provided]:
        caller = getattr(self._manager.hook, f"benchbot_{kind}")
        for implementation in caller.get_hookimpls():
            info = self._infos[implementation.plugin_name]
            try:
                values = list(implementation.function())
            # As at import: one plug-in's mistake is reported, and the others go on.
            except Exception as error:  # noqa: BLE001
                self._note(info, cause_of(error))
            else:
                yield from (Provided(value, info.distribution) for value in values)

    def _evaluators_of_folders(self) -> Iterator[Provided]:
        for folder in self.folders:
            for found in folder.evaluators():
                if isinstance(found, BenchbotError):
                    info = PluginInfo(folder.name, "", str(folder.root), "")
                    self._note(info, f"{found.title} {found.why}")
                else:
                    yield Provided(found, str(folder.root), folder)

    def _note(self, info: PluginInfo, cause: str) -> None:
        broken = BrokenPlugin(info, cause)
        if broken not in self.broken:
            self.broken.append(broken)


def cause_of(error: BaseException) -> str:
    """Return why a plug-in cannot be used, and where; of an import that is not public, what to import instead."""
    if isinstance(error, BenchbotError):
        return f"{error.title}: {error.fix}"
    frames = [frame for frame in extract_tb(error.__traceback__) if not frame.filename.startswith("<")][-1:]
    text = f"{type(error).__name__}: {error}{''.join(f' ({frame.filename}:{frame.lineno})' for frame in frames)}"
    if isinstance(error, ImportError) and (error.name or "").startswith("benchbot."):
        text += ". Plug-ins import from benchbot.plugin, and no other module of BenchBot's inside"
    return text


def _check_api(plugin: Any) -> None:
    """Raise BenchbotError for a plug-in that says it was made for another major version of `benchbot.plugin`."""
    major, _ = API_VERSION
    made_for = getattr(plugin, "PLUGIN_API", major)
    if made_for != major:
        newer = "upgrade BenchBot" if isinstance(made_for, int) and made_for > major else "upgrade the plug-in"
        raise BenchbotError(
            f"It was made for version {made_for} of benchbot.plugin, and this BenchBot has version {major}",
            "What it imports may be gone, or mean something else.",
            f"{newer[0].upper()}{newer[1:]}, or install a version of the plug-in that was made for this BenchBot.",
        )


def _named_as_text(record: Any) -> str | None:
    """Return the field of a record that should be called and is text, None for none; a `Command` names its target."""
    return next((name for name in CALLED if isinstance(getattr(record, name, None), str)), None)


def conflict(kind: str, name: str, first: Provided, second: Provided) -> BenchbotError:
    """Return the error for one name provided twice."""
    if first.distribution == second.distribution:
        why = f"'{first.distribution}' provides it twice."
        fix = f"Report this to the author of '{first.distribution}'."
    else:
        both = f"Both '{first.distribution}' and '{second.distribution}' provide it"
        why = f"{both}, and BenchBot never picks one silently."
        fix = f"Keep one of them: {_removal(second)}   or: {_removal(first)}"
    return BenchbotError(f"Two {kind.replace('_', ' ')} are called '{name}'.", why, fix)


def _removal(origin: Provided) -> str:
    return f"benchbot uninstall {origin.distribution}" if origin.folder is None else origin.folder.removal()


@cache
def load() -> Plugins:
    """Load all installed plug-ins, once per process."""
    return Plugins(installed())
