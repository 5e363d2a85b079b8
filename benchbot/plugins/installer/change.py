"""Changing the environment: look, ask, change, check, and go back to what was when anything fails."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from benchbot.core import trust
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.installer import addons
from benchbot.plugins.installer.checking import check
from benchbot.plugins.installer.distributions import Distribution, found_in, normal
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.exclusive import exclusive
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installers import Installer, Order, Pin, choose, pinned
from benchbot.plugins.installer.journal import Journal
from benchbot.plugins.installer.plan import Action, Change, Plan
from benchbot.plugins.installer.running import Runner
from benchbot.plugins.installer.sources import Folder, Line, Workshop
from benchbot.plugins.installer.staging import Staged, changes, describe, refuse_overwriting


class Person(Protocol):
    """Who has asked for the change, and is told and asked about it."""

    def note(self, text: str) -> None:
        """Be told how it goes on."""

    def may_build(self, source: str) -> bool:
        """Say whether the code of a source may run to build it."""

    def agrees(self, plan: Plan) -> bool:
        """See the plan, and say whether code that was never allowed may come."""


@dataclass(frozen=True)
class Wish:
    """What was asked for. `upgrade` and `remove` hold normal names; `alone` leaves out what a distribution needs."""

    sources: Sequence[str] = ()
    upgrade: frozenset[str] = frozenset()
    remove: Sequence[str] = ()
    indexes: Indexes = field(default_factory=Indexes)
    require_hashes: bool = False
    alone: bool = False
    may_build: bool = False
    dry_run: bool = False


@dataclass(frozen=True)
class Site:
    """An environment that is held, so that nobody else changes it."""

    environment: Environment
    runner: Runner
    installer: Installer
    journal: Journal

    @property
    def installed(self) -> dict[str, Distribution]:
        """What is installed, by name."""
        return found_in(self.environment.sites)


@contextmanager
def held(environment: Environment, installer: str | None, what: str, note: Callable[[str], None]) -> Iterator[Site]:
    """Hold the environment while something is done with it; first undo what a process that is gone has left behind."""
    with exclusive(environment, what, note) as lock:
        runner = Runner(lock)
        journal = Journal(environment)
        left = journal.left_over()
        if left is not None:
            note(f"'{left}' was broken off; putting everything back to what it was before.")
            journal.undo()
        addons.recover()
        yield Site(environment, runner, choose(installer, environment, runner), journal)


def change(site: Site, wish: Wish, what: str, person: Person) -> Plan:
    """Do what is wished, all of it or nothing, and return what it was.

    Raises BenchbotError when it cannot be done; whatever ends it, the environment is then what it was before.
    """
    with tempfile.TemporaryDirectory(prefix="benchbot-install-") as temporary:
        folder = Path(temporary)
        person.note("Looking what would change …" if wish.sources else "Looking …")
        taken = _take(site, wish, folder, person)
        lines = [item for item in taken if isinstance(item, Line)]
        folders = [item for item in taken if isinstance(item, Folder)]
        staged = _stage(site, wish, lines, folder)
        origins = {line.name: line.origin for line in lines if line.origin is not None}
        distributions = staged.distributions if staged.pins else {}
        going, leaving = _leaving(site, wish)
        refuse_overwriting(distributions, site.installed, site.environment)
        joining = [(item, addons.change_of(item)) for item in folders]
        plan = Plan(
            [
                *changes(distributions, site.installed, origins),
                *(found for _, found in joining if found is not None),
                *leaving,
            ]
        )
        if not plan.changes or wish.dry_run:
            return plan
        if not person.agrees(plan):
            raise _refused(plan)
        for allowed in plan.unsure:
            trust.give(allowed.mark, f"{allowed.name} {allowed.new}")
        with addons.placing([item for item, found in joining if found is not None], trusted=wish.may_build):
            if distributions or going:
                _apply(site, staged, distributions, going, origins, wish, what, person)
        for gone in leaving:
            if gone.kind == "add-on":
                addons.remove(gone.name)
        return plan


def _take(site: Site, wish: Wish, folder: Path, person: Person) -> list[Line | Folder]:
    workshop = Workshop(
        folder, site.installer, wish.indexes, site.runner, lambda source: wish.may_build or person.may_build(source)
    )
    return [workshop.take(text) for text in wish.sources]


def _stage(site: Site, wish: Wish, lines: Sequence[Line], folder: Path) -> Staged:
    """Find out which distributions would come, and unpack them apart; those that are here as they are do not."""
    unpacked = folder / "unpacked"
    if not lines:
        return Staged([], unpacked)
    order = Order(
        [line.text for line in lines],
        upgrade=wish.upgrade,
        fixed=_fixed(site, lines),
        require_hashes=wish.require_hashes,
        alone=wish.alone,
        may_build=wish.may_build,
        indexes=wish.indexes,
    )
    resolved = {pin.name: pin for pin in site.installer.resolve(order)}
    for line in lines:
        # A wheel that is named counts even where its version is installed: its content may be another.
        if line.wheel is not None:
            version = line.wheel.name.split("-")[1]
            resolved[line.name] = Pin(line.name, version, line.text)
        elif line.name in resolved and "--hash=" in line.text and pinned(line.text):
            resolved[line.name] = Pin(line.name, resolved[line.name].version, line.text)
    if not resolved:
        return Staged([], unpacked)
    pins = list(resolved.values())
    site.installer.unpack(_exactly(pins, wish), unpacked)
    staged = Staged(pins, unpacked)
    same = {
        line.name
        for line in lines
        if line.wheel is not None and _is_here(site.installed.get(line.name), staged.distributions[line.name])
    }
    for name in same:
        _forget(staged.distributions[name])
    return Staged([pin for pin in pins if pin.name not in same], unpacked)


def _fixed(site: Site, lines: Sequence[Line]) -> list[str]:
    """Return what stays as it is: BenchBot itself, and folders of sources that somebody works in."""
    asked = {line.name for line in lines}
    return [
        f"{one.name}=={one.version}"
        for one in site.installed.values()
        if one.name == "benchbot" or (one.is_editable and one.name not in asked)
    ]


def _exactly(pins: Sequence[Pin], wish: Wish) -> Order:
    return Order([pin.line for pin in pins], may_build=wish.may_build, indexes=wish.indexes)


def _is_here(installed: Distribution | None, staged: Distribution) -> bool:
    return installed is not None and not installed.is_editable and installed.content() == staged.content()


def _forget(distribution: Distribution) -> None:
    for path in {*map(distribution.file, distribution.files), *distribution.info.iterdir()}:
        path.unlink(missing_ok=True)
    distribution.info.rmdir()


def _leaving(site: Site, wish: Wish) -> tuple[list[Distribution], list[Change]]:
    """Return the distributions to remove, and what is said of them and of add-ons; raises BenchbotError for others."""
    from benchbot.plugins.v2 import addons as v2_addons

    installed = site.installed
    going, leaving = [], []
    for name in wish.remove:
        distribution = installed.get(normal(name))
        if name in v2_addons.installed():
            digest = addons.digest_of(name) or ""
            leaving.append(Change(name, Action.REMOVE, "add-on", digest[:12], None, origin=addons.origin_of(name)))
        elif distribution is None or normal(name) == "benchbot" or not distribution.is_plugin:
            raise _not_removable(name, installed)
        else:
            going.append(distribution)
            old = distribution.version
            leaving.append(
                Change(distribution.name, Action.REMOVE, "plug-in", old, None, origin=describe(distribution.origin))
            )
    names = {distribution.name for distribution in going}
    for other in installed.values() if names else ():
        needed = sorted(names & set(other.requires())) if other.name not in names else []
        if needed:
            raise BenchbotError(
                f"{needed[0]} cannot be uninstalled alone.",
                f"{other.name} needs it.",
                f"Uninstall both: benchbot uninstall {needed[0]} {other.name}",
            )
    return going, leaving


def _not_removable(name: str, installed: Mapping[str, Distribution]) -> BenchbotError:
    from benchbot.plugins.v2 import addons as v2_addons

    plugins = [one.name for one in installed.values() if one.is_plugin and one.name != "benchbot"]
    known = sorted([*plugins, *v2_addons.installed()])
    if normal(name) == "benchbot":
        why, fix = "BenchBot does not remove itself.", "Remove the whole environment, or: pip uninstall benchbot"
    elif normal(name) in installed:
        why, fix = "It is installed, but no plug-in of BenchBot.", f"If you do not need it: pip uninstall {name}"
    else:
        why = f"Installed: {', '.join(known) or 'none'}.{did_you_mean(name, known)}"
        fix = "List them with: benchbot plugins list"
    return BenchbotError(f"{name} cannot be uninstalled.", why, fix)


def _apply(
    site: Site,
    staged: Staged,
    distributions: Mapping[str, Distribution],
    going: Sequence[Distribution],
    origins: Mapping[str, dict[str, Any]],
    wish: Wish,
    what: str,
    person: Person,
) -> None:
    replaced = [site.installed[name] for name in distributions if name in site.installed]
    site.journal.open(what, [*replaced, *going], list(distributions.values()))
    try:
        if going:
            person.note(f"Uninstalling {', '.join(one.name for one in going)} …")
            site.installer.remove([one.name for one in going])
        if distributions:
            person.note(f"Installing {', '.join(distributions)} …")
            site.installer.install(_exactly(staged.pins, wish))
            _verify(site, distributions)
            for name in distributions:
                site.installed[name].rewrite_origin(origins.get(name))
            plugins = [one.metadata.name for one in distributions.values() if one.is_plugin]
            if plugins:
                person.note(f"Checking {', '.join(plugins)} …")
            check(plugins)
    except BaseException:
        person.note("Putting everything back to what it was …")
        site.journal.undo()
        raise
    site.journal.close()


def _verify(site: Site, distributions: Mapping[str, Distribution]) -> None:
    """Raise BenchbotError unless what is installed is, byte for byte, what was looked at."""
    installed = site.installed
    for name, distribution in distributions.items():
        if name not in installed or installed[name].content() != distribution.content():
            raise BenchbotError(
                f"What was installed as {name} is not what was looked at.",
                "Its files have changed between the two.",
                "Run the command again; if it happens twice, the index is not to be trusted.",
            )


def _refused(plan: Plan) -> BenchbotError:
    names = ", ".join(change.name for change in plan.unsure)
    return BenchbotError(
        "Nothing was installed: you have not allowed the code that would come.",
        f"It would run with all your rights: {names}.",
        "Look at where it comes from; if you trust it, give --trust. It is remembered until the code changes.",
    )
