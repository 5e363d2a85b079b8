"""Changing the environment: plan, ask, install, check, and restore the previous state if anything fails."""

import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer
from packaging.utils import canonicalize_name

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.installer import addons
from benchbot.plugins.installer.distributions import Distribution, found_in, origin_text, unused_without
from benchbot.plugins.installer.environment import Environment, current, locked
from benchbot.plugins.installer.indexes import Indexes, without_credentials
from benchbot.plugins.installer.installers import Installer, Requirements, choose
from benchbot.plugins.installer.journal import Journal
from benchbot.plugins.installer.plan import Action, Change, Plan, change_of, refuse_overwriting, unpacked
from benchbot.plugins.installer.post_install_check import check
from benchbot.plugins.installer.sources import AddonFolder, RequirementLine, SourcePreparer, addon_name
from benchbot.plugins.installer.subprocesses import Runner
from benchbot.plugins.v2 import addons as v2_addons
from benchbot.plugins.v2 import migration, official, trust


@dataclass(frozen=True)
class Prompt:
    """Asks for consent where stdin and stderr are a terminal; `trust` consents to everything."""

    trust: bool

    def may_build(self, source: str) -> bool:
        """Ask whether the code of a source may run to build it."""
        return self.trust or _confirm(f"To build {source}, its code runs with all your rights. Let it?")

    def may_change(self, plan: Plan) -> bool:
        """Show a plan, and ask whether code that was never allowed may be installed."""
        console.note(*map(str, plan.changes))
        names = ", ".join(change.name for change in plan.without_consent)
        question = f"The code of {names} would run with all your rights, also that of mere dependencies. Install it?"
        return not names or self.trust or _confirm(question)


def _confirm(question: str) -> bool:
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    try:
        return console.confirmed(question)
    except typer.Abort:  # typer's exception for Ctrl-C
        raise KeyboardInterrupt from None


@dataclass(frozen=True)
class InstallRequest:
    """Sources to install and names to remove; the newest version is wanted of the normalized names in `upgrade`.

    `with_unused` removes with the names what nothing else needs then.
    """

    sources: Sequence[str] = ()
    upgrade: frozenset[str] = frozenset()
    remove: Sequence[str] = ()
    with_unused: bool = False
    indexes: Indexes = field(default_factory=Indexes)
    require_hashes: bool = False
    no_dependencies: bool = False
    may_build: bool = False
    dry_run: bool = False


@dataclass(frozen=True)
class TargetEnvironment:
    """The environment that is changed, locked for this process, and its installer and journal."""

    environment: Environment
    installer: Installer
    journal: Journal

    @property
    def installed(self) -> dict[str, Distribution]:
        """The installed distributions by normalized name."""
        return found_in(self.environment.sites)


@contextmanager
def target_environment(installer: str | None, command: str) -> Iterator[TargetEnvironment]:
    """Lock the environment of this process, undo a change that was broken off, and yield it.

    `command` is shown to processes that wait for the lock.
    """
    environment = current()
    with locked(environment, command) as lock:
        journal = Journal(environment)
        unfinished = journal.unfinished()
        if unfinished is not None:
            console.note(f"'{unfinished}' was broken off; putting everything back to what it was before.")
            journal.undo()
        addons.recover()
        yield TargetEnvironment(environment, choose(installer, environment, Runner(lock)), journal)


def change(target: TargetEnvironment, request: InstallRequest, command: str) -> Plan:
    """Make all changes of a request or none, and return them.

    Raises BenchbotError when they cannot be made; after any exception the environment is as it was before.
    """
    with tempfile.TemporaryDirectory(prefix="benchbot-install-") as temporary:
        folder = Path(temporary)
        console.note("Looking what would change …" if request.sources else "Looking …")
        prompt = Prompt(request.may_build)
        preparer = SourcePreparer(folder, target.installer, request.indexes, prompt.may_build)
        prepared = list(_prepared(preparer, request.sources, target.installed))
        lines = [item for item in prepared if isinstance(item, RequirementLine)]
        origins = {line.name: line.origin for line in lines if line.origin is not None}
        installed = target.installed
        pinned, coming = _stage(target, request, lines, folder / "unpacked")
        leaving, removals = _removals(installed, request)
        refuse_overwriting(coming, installed, target.environment)
        folders = [(item, addons.change_of(item)) for item in prepared if isinstance(item, AddonFolder)]
        changes = [change_of(one, installed.get(name), origins.get(name)) for name, one in sorted(coming.items())]
        plan = Plan([*changes, *(found for _, found in folders if found is not None), *removals])
        if not plan.changes or request.dry_run:
            return plan
        if not prompt.may_change(plan):
            raise BenchbotError(
                "Nothing was installed: you have not allowed the code that would come.",
                f"It would run with all your rights: {', '.join(one.name for one in plan.without_consent)}.",
                "Look at where it comes from; if you trust it, give --trust. It is remembered until the code changes.",
            )
        for one in plan.without_consent:
            trust.give(one.consent_digest, f"{one.name} {one.new}")
        with addons.installing([item for item, found in folders if found is not None], trusted=request.may_build):
            if coming or leaving:
                _apply(target, pinned, coming, leaving, origins, command, asked=frozenset(line.name for line in lines))
        for removal in removals:
            if removal.kind == "add-on":
                addons.remove(removal.name)
        return plan


def _prepared(
    preparer: SourcePreparer, sources: Iterable[str], installed: Collection[str]
) -> Iterator[RequirementLine | AddonFolder]:
    """Yield what is named, prepared, and what v2's add-ons among it need in turn and is not there (`.dependencies`)."""
    left, seen = list(sources), set(v2_addons.installed())
    while left:
        text = left.pop(0)
        item = preparer.prepare(text)
        yield item
        for name in migration.dependencies(item.path) if isinstance(item, AddonFolder) else ():
            replacement = official.replacement_of(name)
            wanted = [migration.url_of(name)] if replacement is None else replacement.distributions
            lacking = [
                one for one in wanted if one not in seen and one not in installed and addon_name(one) not in seen
            ]
            if lacking:
                console.note(f"{addon_name(text)} needs {name}: {', '.join(map(without_credentials, lacking))}")
            left += lacking
            seen.update(lacking)


def _stage(
    target: TargetEnvironment, request: InstallRequest, lines: Sequence[RequirementLine], folder: Path
) -> tuple[Requirements, dict[str, Distribution]]:
    """Resolve requirements; return pins of all that is to be installed, and their distributions, unpacked.

    Wheels that are installed with the same content are left out.
    """
    asked = {line.name for line in lines}
    installed = target.installed
    # BenchBot itself, and folders of sources that somebody works in, stay as they are.
    constraints = [
        f"{one.name}=={one.version}"
        for one in installed.values()
        if one.name == "benchbot" or (one.is_editable and one.name not in asked)
    ]
    requirements = Requirements(
        [line.text for line in lines],
        upgrade=request.upgrade,
        constraints=constraints,
        require_hashes=request.require_hashes,
        no_dependencies=request.no_dependencies,
        may_build=request.may_build,
        indexes=request.indexes,
    )
    pins = target.installer.resolve(requirements) if lines else {}
    for line in lines:
        # A wheel is not left out when its version is installed: its content may be another.
        if line.origin is not None or (line.name in pins and line.is_hash_of_version):
            pins[line.name] = line.text
    coming = {}
    if pins:
        target.installer.unpack(_exactly(pins.values(), request), folder)
        coming = unpacked(pins, folder)
    for name in {line.name for line in lines if line.origin is not None} & installed.keys():
        if not installed[name].is_editable and installed[name].content() == coming[name].content():
            del pins[name], coming[name]
    return _exactly(pins.values(), request), coming


def _exactly(pins: Iterable[str], request: InstallRequest) -> Requirements:
    return Requirements([*pins], may_build=request.may_build, indexes=request.indexes)


def _removals(
    installed: Mapping[str, Distribution], request: InstallRequest
) -> tuple[list[Distribution], list[Change]]:
    """Return the distributions to remove, and the changes of those and of add-ons; say what nothing else needs.

    Raises BenchbotError for a name that is no plug-in or add-on, and for a plug-in that another distribution needs.
    """
    leaving, changes = [], []
    for name in request.remove:
        one = installed.get(canonicalize_name(name))
        if name in v2_addons.installed():
            digest = addons.digest_of(name) or ""
            changes.append(Change(name, Action.REMOVE, "add-on", digest[:12], None, origin=addons.origin_of(name)))
        elif one is None or one.name == "benchbot" or not one.is_plugin:
            raise _not_removable(name, installed)
        else:
            leaving.append(one)
            origin = origin_text(one.origin)
            changes.append(Change(one.name, Action.REMOVE, "plug-in", one.version, None, origin=origin))
    leaving_names = {one.name for one in leaving}
    for other in installed.values() if leaving else ():
        needed = sorted(leaving_names & set(other.requires())) if other.name not in leaving_names else []
        if needed:
            raise BenchbotError(
                f"{needed[0]} cannot be uninstalled alone.",
                f"{other.name} needs it.",
                f"Uninstall both: benchbot uninstall {needed[0]} {other.name}",
            )
    unused = unused_without(leaving_names, installed)
    if unused and request.with_unused:
        leaving += unused
        changes += [Change(one.name, Action.REMOVE, "dependency", one.version, None) for one in unused]
    elif unused:
        named = ", ".join(f"{one.name} {one.version}" for one in unused)
        console.note(f"Nothing else here needs {named}: --with-unused uninstalls that, too.")
    return leaving, changes


def _not_removable(name: str, installed: Mapping[str, Distribution]) -> BenchbotError:
    normalized = canonicalize_name(name)
    if normalized == "benchbot":
        why, fix = "BenchBot does not remove itself.", "Remove the whole environment, or: pip uninstall benchbot"
    elif normalized in installed:
        why, fix = "It is installed, but no plug-in of BenchBot.", f"If you do not need it: pip uninstall {name}"
    else:
        plugins = [one.name for one in installed.values() if one.is_plugin and one.name != "benchbot"]
        known = sorted([*plugins, *v2_addons.installed()])
        why = f"Installed: {', '.join(known) or 'none'}.{did_you_mean(name, known)}"
        fix = "List them with: benchbot plugins list"
    return BenchbotError(f"{name} cannot be uninstalled.", why, fix)


def _apply(
    target: TargetEnvironment,
    requirements: Requirements,
    coming: Mapping[str, Distribution],
    leaving: Sequence[Distribution],
    origins: Mapping[str, dict[str, Any]],
    command: str,
    *,
    asked: frozenset[str],
) -> None:
    """Uninstall and install distributions; undone, to the last file, when that or the check of the plug-ins fails.

    Those that are not among the `asked` ones are dependencies, and known as such from then on.
    """
    replaced = [one for name, one in target.installed.items() if name in coming]
    was_requested = {one.name: (one.info / "REQUESTED").exists() for one in replaced}
    target.journal.open(command, [*replaced, *leaving], list(coming.values()))
    try:
        if leaving:
            names = [one.name for one in leaving]
            console.note(f"Uninstalling {', '.join(names)} …")
            target.installer.remove(names)
        if coming:
            console.note(f"Installing {', '.join(coming)} …")
            target.installer.install(requirements)
            _verify_content(target.installed, coming)
            for name, one in target.installed.items():
                if name in coming:
                    one.rewrite_origin(origins.get(name))
                    if name not in asked and not was_requested.get(name):
                        one.forget_request()
            plugins = [one.metadata.name for one in coming.values() if one.is_plugin]
            if plugins:
                console.note(f"Checking {', '.join(plugins)} …")
            check(plugins)
    except BaseException:
        console.note("Putting everything back to what it was …")
        target.journal.undo()
        raise
    target.journal.close()


def _verify_content(installed: Mapping[str, Distribution], staged: Mapping[str, Distribution]) -> None:
    """Raise BenchbotError unless the installed distributions are, byte for byte, those that were planned."""
    for name, distribution in staged.items():
        if name not in installed or installed[name].content() != distribution.content():
            raise BenchbotError(
                f"What was installed as {name} is not what was looked at.",
                "Its files have changed between the two.",
                "Run the command again; if it happens twice, the index is not to be trusted.",
            )
