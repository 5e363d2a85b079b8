"""`benchbot.lock`: the plug-ins of a project and all that they need, by version and hash, the same on every machine."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import benchbot
from benchbot.core import atomic
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import Distribution, normal, with_what_they_need
from benchbot.plugins.installer.indexes import Indexes
from benchbot.plugins.installer.installers import Installer, Pin
from benchbot.plugins.installer.staging import describe

NAME = "benchbot.lock"
VERSION = 1


@dataclass(frozen=True)
class Locked:
    """One distribution of a lock: `origin` is `index` or an address, `hashes` are `sha256:…` of its files there."""

    name: str
    version: str
    is_plugin: bool
    origin: str
    hashes: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """What to ask an installer for."""
        if self.origin == "index":
            return f"{self.name}=={self.version}{''.join(f' --hash={text}' for text in self.hashes)}"
        return "#".join([self.origin, *(text.replace(":", "=") for text in self.hashes[:1])])


def lock(installed: Mapping[str, Distribution], installer: Installer, indexes: Indexes) -> list[Locked]:
    """Return the installed plug-ins and what they need, with hashes; raises BenchbotError where one cannot be had."""
    wanted = _with_what_they_need(installed)
    local = sorted(name for name in wanted if _is_local(installed[name]))
    if local:
        raise BenchbotError(
            f"{', '.join(local)} cannot be locked.",
            "It was installed from a folder, which has no version that others could get.",
            "Install it from an index, a wheel or a git repository first.",
        )
    pins = [Pin(name, installed[name].version, "") for name in wanted if installed[name].origin is None]
    hashes = installer.hashes(pins, indexes) if pins else {}
    without = sorted(pin.name for pin in pins if not hashes.get(pin.name))
    if without:
        raise BenchbotError(
            f"There are no hashes of {', '.join(without)}.",
            "The index does not offer the installed version.",
            "Name the index that it came from: --index-url URL, or upgrade it.",
        )
    return [_locked(installed[name], hashes.get(name, [])) for name in wanted]


def write(path: Path, locked: Sequence[Locked]) -> None:
    """Write a lock, whole or not at all."""
    lines = [
        "# The plug-ins of this project and what they need. Made by: benchbot plugins lock",
        "# Applied by: benchbot plugins sync",
        f"version = {VERSION}",
        f"benchbot = {json.dumps(benchbot.__version__)}",
    ]
    for one in locked:
        lines += [
            "",
            "[[distribution]]",
            f"name = {json.dumps(one.name)}",
            f"version = {json.dumps(one.version)}",
            f"plugin = {json.dumps(one.is_plugin)}",
            f"from = {json.dumps(one.origin)}",
            "hashes = [" + ", ".join(json.dumps(text) for text in one.hashes) + "]",
        ]
    try:
        atomic.write(path, ("\n".join(lines) + "\n").encode())
    except OSError as error:
        raise BenchbotError(
            f"{path} cannot be written.", f"{error.strerror or error}.", "Name another file with --lock FILE."
        ) from error


def read(path: Path) -> list[Locked]:
    """Read a lock; raises BenchbotError for a file that is none."""
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


def _read_one(path: Path, row: Any) -> Locked:
    try:
        found = Locked(
            normal(str(row["name"])),
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


def _with_what_they_need(installed: Mapping[str, Distribution]) -> list[str]:
    fetched = {name: one for name, one in installed.items() if name != "benchbot" and not one.is_editable}
    return sorted(with_what_they_need([name for name, one in fetched.items() if one.is_plugin], fetched))


def _is_local(distribution: Distribution) -> bool:
    return "dir_info" in (distribution.origin or {})


def _locked(distribution: Distribution, hashes: Sequence[str]) -> Locked:
    origin = distribution.origin
    archive = (origin or {}).get("archive_info", {}).get("hashes", {})
    found = tuple(hashes) or tuple(f"{name}:{value}" for name, value in sorted(archive.items()))
    return Locked(distribution.name, distribution.version, distribution.is_plugin, describe(origin), found)
