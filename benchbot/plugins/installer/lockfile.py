"""`benchbot.lock`: the plug-ins of a project and all that they need, by version and hash, for use on any machine."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name

import benchbot
from benchbot.core import atomic
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import Distribution, origin_text, with_dependencies
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installers import Installer

NAME = "benchbot.lock"
VERSION = 1


@dataclass(frozen=True)
class LockedDistribution:
    """One distribution of a lock: `origin` is `index` or an address, `hashes` are `sha256:…` of its files there."""

    name: str
    version: str
    is_plugin: bool
    origin: str
    hashes: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """The source to install it from, as `benchbot install` takes it."""
        if self.origin == "index":
            return f"{self.name}=={self.version}{''.join(f' --hash={text}' for text in self.hashes)}"
        return "#".join([self.origin, *(text.replace(":", "=") for text in self.hashes[:1])])


def lock(installed: Mapping[str, Distribution], installer: Installer, indexes: Indexes) -> list[LockedDistribution]:
    """Return the installed plug-ins and all that they need, with hashes.

    Editable plug-ins are left out. Raises BenchbotError for a distribution that others could not get.
    """
    fetched = {name: one for name, one in installed.items() if name != "benchbot" and not one.is_editable}
    wanted = sorted(with_dependencies([name for name, one in fetched.items() if one.is_plugin], fetched))
    local = [name for name in wanted if "dir_info" in (installed[name].origin or {})]
    if local:
        raise BenchbotError(
            f"{', '.join(local)} cannot be locked.",
            "It was installed from a folder, which has no version that others could get.",
            "Install it from an index, a wheel or a git repository first.",
        )
    indexed = [name for name in wanted if installed[name].origin is None]
    pins = [f"{name}=={installed[name].version}" for name in indexed]
    hashes = installer.hashes(pins, indexes) if pins else {}
    without = [name for name in indexed if not hashes.get(name)]
    if without:
        raise BenchbotError(
            f"There are no hashes of {', '.join(without)}.",
            "The index does not offer the installed version.",
            "Name the index that it came from: --index-url URL, or upgrade it.",
        )
    return [_locked(installed[name], hashes.get(name, [])) for name in wanted]


def write(path: Path, locked: Sequence[LockedDistribution]) -> None:
    """Write a lock file; raises BenchbotError, when it cannot be written."""
    lines = [
        "# The plug-ins of this project and what they need. Made by: benchbot plugins lock",
        "# Applied by: benchbot plugins sync",
        f"version = {VERSION}",
        f"benchbot = {json.dumps(benchbot.__version__)}",
    ]
    for one in locked:
        row = {"name": one.name, "version": one.version, "plugin": one.is_plugin, "from": one.origin}
        # Strings, booleans and lists of strings are written alike in JSON and TOML.
        values = (f"{key} = {json.dumps(value)}" for key, value in {**row, "hashes": one.hashes}.items())
        lines += ["", "[[distribution]]", *values]
    try:
        atomic.write(path, ("\n".join(lines) + "\n").encode())
    except OSError as error:
        raise BenchbotError(
            f"{path} cannot be written.", f"{error.strerror or error}.", "Name another file with --lock FILE."
        ) from error


def read(path: Path) -> list[LockedDistribution]:
    """Read a lock file; raises BenchbotError for one that is missing or not valid."""
    try:
        document = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise BenchbotError(
            f"{path} cannot be read.",
            f"{error.strerror or error}.",
            "Make it with: benchbot plugins lock; or name another with --lock FILE.",
        ) from error
    except ValueError as error:
        raise _no_lock(path, str(error)) from error
    if document.get("version") != VERSION:
        raise _no_lock(path, f"Its version is {document.get('version')!r}; this BenchBot reads version {VERSION}.")
    return [_read_one(path, row) for row in document.get("distribution", [])]


def _read_one(path: Path, row: Any) -> LockedDistribution:
    try:
        found = LockedDistribution(
            canonicalize_name(str(row["name"])),
            str(row["version"]),
            bool(row["plugin"]),
            str(row["from"]),
            tuple(map(str, row["hashes"])),
        )
    except (KeyError, TypeError) as error:
        raise _no_lock(path, f"A distribution in it lacks {error}.") from error
    if found.origin == "index" and not found.hashes:
        raise _no_lock(path, f"{found.name} has no hashes.")
    return found


def _no_lock(path: Path, why: str) -> BenchbotError:
    return BenchbotError(f"{path} is no lock that can be used.", why, "Make it anew with: benchbot plugins lock")


def _locked(distribution: Distribution, hashes: Sequence[str]) -> LockedDistribution:
    origin = distribution.origin
    archive = (origin or {}).get("archive_info", {}).get("hashes", {})
    found = tuple(hashes) or tuple(f"{name}:{value}" for name, value in sorted(archive.items()))
    return LockedDistribution(
        distribution.name, distribution.version, distribution.is_plugin, origin_text(origin), found
    )


def difference(
    locked: Sequence[LockedDistribution], installed: Mapping[str, Distribution]
) -> tuple[list[str], list[str], list[str]]:
    """Return sources to install and names to remove to get what is locked, and notes on what is left as it is.

    Editable plug-ins stay: somebody works in their folders.
    """
    names = {one.name for one in locked} | {"benchbot"}
    others = [one for one in installed.values() if one.is_plugin and one.name not in names]
    notes = [
        f"{one.name} is used from its folder of sources and stays, though it is not in the lock."
        for one in others
        if one.is_editable
    ]
    sources = []
    for one in locked:
        here = installed.get(one.name)
        if here is not None and here.is_editable:
            text = f"{one.name} is used from its folder of sources and stays"
            notes.append(f"{text}, instead of version {one.version} of the lock.")
        elif here is None or (here.version, origin_text(here.origin)) != (one.version, one.origin):
            sources.append(one.source)
    return sources, [one.name for one in others if not one.is_editable], notes
