"""The plug-in manager: what is installed, loading it, and keeping broken plug-ins from harming the others."""

import os
import pkgutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import pluggy

from benchbot.core import entry_points, hookspecs, resources
from benchbot.core.errors import BenchbotError, did_you_mean

if TYPE_CHECKING:
    from benchbot.plugins.v2.addons import Addon

GROUP = "benchbot"


@dataclass(frozen=True)
class PluginInfo:
    """What the metadata of an installed plug-in says; reading it imports nothing."""

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
    """A record or a declaration's source, with the distribution (or the folder of v2's add-ons) that it came from."""

    value: Any
    distribution: str
    addon: "Addon | None" = None


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


class Plugins:
    """The loaded plug-ins: their records by pool and name, and the sources of their declarations."""

    def __init__(self, infos: Sequence[PluginInfo], addons: "Sequence[Addon]" = ()) -> None:
        self.broken: list[BrokenPlugin] = []
        self._addons = addons
        self._infos: dict[str, PluginInfo] = {}
        self._manager = pluggy.PluginManager(hookspecs.PROJECT)
        self._manager.add_hookspecs(hookspecs)
        for info in infos:
            self._register(info)

    def _register(self, info: PluginInfo) -> None:
        name = f"{info.distribution}:{info.name}"
        try:
            plugin = pkgutil.resolve_name(info.module)
            self._manager.register(plugin, name)
            self._manager.check_pending()
        # A third party's import may fail in any way at all; it is reported and must not take the others down.
        except (Exception, SystemExit) as error:  # noqa: BLE001
            if self._manager.has_plugin(name):
                self._manager.unregister(name=name)
            self._report(info, error)
        else:
            self._infos[name] = info

    def sources(self, kind: str) -> list[Provided]:
        """Return the files and folders that plug-ins and v2's add-ons declare for a kind (`tasks`, `robots`, …)."""
        folders = ((addon, folder) for addon in self._addons for folder in addon.sources(kind))
        return [*self._call(kind), *(Provided(folder, str(addon.root), addon) for addon, folder in folders)]

    def pool(self, kind: str) -> dict[str, Provided]:
        """Return the records of a kind (`simulators`, `evaluators`, …) by name.

        Raises BenchbotError when two distributions provide the same name; it names both.
        """
        record_type: Any = hookspecs.KINDS[kind]
        pool: dict[str, Provided] = {}
        for provided in [*self._call(kind), *self._records_of_addons(kind)]:
            record: Any = provided.value
            if not isinstance(record, record_type):
                raise BenchbotError(
                    f"The plug-in '{provided.distribution}' yields something that is not a {record_type.__name__}.",
                    f"Its hook benchbot_{kind} yielded {record!r}.",
                    f"Report this to the author of '{provided.distribution}', or uninstall it: "
                    f"benchbot uninstall {provided.distribution}",
                )
            if record.name in pool:
                raise conflict(kind, record.name, pool[record.name].distribution, provided.distribution)
            pool[record.name] = provided
        return pool

    def record(self, kind: str, name: str) -> Any:
        """Return one record by name; raises BenchbotError for an unknown one, and for code that is not trusted."""
        pool = self.pool(kind)
        if name not in pool:
            raise self.unknown(kind, name)
        _require_trust(pool[name].addon)
        return pool[name].value

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
        if not self.broken:
            return ""
        causes = "; ".join(f"{item.info.distribution} ({item.cause})" for item in self.broken)
        return f" Plug-ins that failed to load: {causes}."

    def _call(self, kind: str) -> Iterator[Provided]:
        caller = getattr(self._manager.hook, f"benchbot_{kind}")
        for implementation in caller.get_hookimpls():
            info = self._infos[implementation.plugin_name]
            try:
                values = list(implementation.function())
            # As at import: one plug-in's mistake is reported, and the others go on.
            except Exception as error:  # noqa: BLE001
                self._report(info, error)
            else:
                yield from (Provided(value, info.distribution) for value in values)

    def _records_of_addons(self, kind: str) -> Iterator[Provided]:
        if kind != "evaluators" or not self._addons:
            return
        from benchbot.plugins.v2 import methods

        for addon in self._addons:
            for found in methods.evaluators(addon):
                if isinstance(found, BenchbotError):
                    self._note(
                        BrokenPlugin(PluginInfo(addon.name, "", str(addon.root), ""), f"{found.title} {found.why}")
                    )
                else:
                    yield Provided(found, str(addon.root), addon)

    def _report(self, info: PluginInfo, error: BaseException) -> None:
        self._note(BrokenPlugin(info, f"{type(error).__name__}: {error}"))

    def _note(self, broken: BrokenPlugin) -> None:
        if broken not in self.broken:
            self.broken.append(broken)


def conflict(kind: str, name: str, first: str, second: str) -> BenchbotError:
    """Return the error for one name provided twice."""
    if first == second:
        why = f"'{first}' provides it twice."
        fix = f"Report this to the author of '{first}'."
    else:
        why = f"Both '{first}' and '{second}' provide it, and BenchBot never picks one silently."
        fix = f"Keep one of them: {_removal(second)}   or: {_removal(first)}"
    return BenchbotError(f"Two {kind.replace('_', ' ')} are called '{name}'.", why, fix)


def _removal(origin: str) -> str:
    addons = f"{resources.installed_addons()}{os.sep}"
    if origin.startswith(addons):
        return f"benchbot uninstall {origin.removeprefix(addons)}"
    return f"leave out --addons {origin}" if os.sep in origin else f"benchbot uninstall {origin}"


def _require_trust(addon: "Addon | None") -> None:
    if addon is not None:
        from benchbot.plugins.v2 import trust

        trust.require(addon)


@cache
def load() -> Plugins:
    """Load all installed plug-ins and add-ons of v2, those that `BENCHBOT_ADDONS` names included, once per process."""
    if "BENCHBOT_ADDONS" not in os.environ and not resources.installed_addons().is_dir():
        return Plugins(installed())
    from benchbot.plugins.v2 import addons

    return Plugins(installed(), addons.from_environment())
