"""Distributions that are installed or unpacked in a folder, read from their metadata; nothing is imported."""

import base64
import csv
import json
import re
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib.metadata import PathDistribution
from pathlib import Path
from typing import Any

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

GROUP = "benchbot"
_SUFFIX = ".dist-info"
# Installers write these files themselves: they tell how a distribution was installed and are no part of it.
INSTALLER_FILES = frozenset({"INSTALLER", "RECORD", "REQUESTED", "direct_url.json", "uv_cache.json", "uv_build.json"})


@dataclass(frozen=True)
class Distribution:
    """A distribution by its `.dist-info` folder; `name` is normalized (PEP 503)."""

    name: str
    version: str
    info: Path

    @cached_property
    def metadata(self) -> PathDistribution:
        """The same distribution as the standard library reads it."""
        return PathDistribution(self.info)

    @property
    def plugin_modules(self) -> set[str]:
        """The modules that BenchBot would load as plug-ins."""
        return {point.module for point in self.metadata.entry_points if point.group == GROUP}

    @property
    def is_plugin(self) -> bool:
        """Whether BenchBot would load it."""
        return bool(self.plugin_modules)

    @property
    def packages(self) -> set[str]:
        """The top-level packages that BenchBot loads it from."""
        return {module.partition(".")[0] for module in self.plugin_modules}

    @cached_property
    def files(self) -> tuple[str, ...]:
        """The paths of its files as RECORD lists them, relative to the folder that contains `.dist-info`."""
        try:
            text = (self.info / "RECORD").read_text("utf-8")
        except OSError:
            return ()
        return tuple(row[0] for row in csv.reader(text.splitlines()) if row)

    @property
    def scripts(self) -> frozenset[str]:
        """The names of the commands that its entry points declare; installers write the files."""
        groups = ("console_scripts", "gui_scripts")
        return frozenset(point.name for point in self.metadata.entry_points if point.group in groups)

    @property
    def origin(self) -> dict[str, Any] | None:
        """The content of `direct_url.json` (PEP 610), or None for a distribution from an index."""
        try:
            found = json.loads((self.info / "direct_url.json").read_text("utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    @property
    def is_editable(self) -> bool:
        """Whether it is used in place, from a folder of sources."""
        return bool((self.origin or {}).get("dir_info", {}).get("editable"))

    def requires(self, extras: Collection[str] = ()) -> dict[str, frozenset[str]]:
        """Return the extras that it needs of each requirement, by normalized name, on this machine with these extras.

        Requirements that are not valid (PEP 508) are left out: installers refuse them, too.
        """
        needed: dict[str, frozenset[str]] = {}
        for text in self.metadata.requires or ():
            with suppress(InvalidRequirement):
                one = Requirement(text)
                if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
                    name = canonicalize_name(one.name)
                    needed[name] = needed.get(name, frozenset()) | {canonicalize_name(extra) for extra in one.extras}
        return needed

    def content(self) -> str:
        """Return the SHA-256 over paths and bytes of its own files: the same wherever and however it is installed."""
        digest = sha256()
        for place, path in sorted((without_parents(path), path) for path in self.files):
            is_script = place.startswith("bin/")
            generated = is_script and place.removeprefix("bin/") in self.scripts
            is_note = path.startswith(f"{self.info.name}/") and path.rpartition("/")[2] in INSTALLER_FILES
            # Headers go to another folder in a virtual environment, and Python does not run them.
            if generated or is_note or place.startswith("include/"):
                continue
            content = self.file(path).read_bytes()
            if is_script and content.startswith(b"#!"):  # installers write the path of the interpreter there
                content = content.partition(b"\n")[2]
            digest.update(f"{place}\0{len(content)}\0".encode())
            digest.update(content)
        return digest.hexdigest()

    def file(self, path: str) -> Path:
        """Return the location of one of its `files`."""
        direct = self.info.parent / path
        return direct if direct.exists() else self.info.parent / without_parents(path)

    def rewrite_origin(self, origin: dict[str, Any] | None) -> None:
        """Replace `direct_url.json` (PEP 610), which may name a temporary file; None: it comes from an index."""
        self._rewrite("direct_url.json", None if origin is None else json.dumps(origin).encode())

    def forget_request(self) -> None:
        """Remove `REQUESTED` (PEP 376), which installers leave in all that they are given as pins."""
        self._rewrite("REQUESTED", None)

    def _rewrite(self, name: str, content: bytes | None) -> None:
        """Write a file of the `.dist-info` folder, or remove it where there is no content, and RECORD with it."""
        path, record = self.info / name, self.info / "RECORD"
        entry = f"{self.info.name}/{name}"
        rows = [row for row in csv.reader(record.read_text("utf-8").splitlines()) if row and row[0] != entry]
        path.unlink(missing_ok=True)  # it may be a hard link into an installer's cache, as may be RECORD
        if content is not None:
            path.write_bytes(content)
            hashed = base64.urlsafe_b64encode(sha256(content).digest()).rstrip(b"=").decode()
            rows.append([entry, f"sha256={hashed}", str(len(content))])
        record.unlink()
        with record.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


def without_parents(path: str) -> str:
    """Return a path of RECORD without the leading `../`, whose number depends on the folder that is unpacked into."""
    return re.sub(r"^(\.\./)+", "", path)


def origin_text(origin: Mapping[str, Any] | None) -> str:
    """Return an origin (PEP 610) in a word: `index`, or its address with the git commit."""
    if origin is None:
        return "index"
    commit = origin.get("vcs_info", {}).get("commit_id")
    url = str(origin["url"])
    return f"git+{url}@{commit}" if commit else url.removeprefix("file://")


def found_in(folders: Iterable[Path]) -> dict[str, Distribution]:
    """Return the distributions in folders by normalized name; the first of a name wins, as it does for Python."""
    found: dict[str, Distribution] = {}
    for folder in folders:
        for info in sorted(folder.glob(f"*{_SUFFIX}")):
            raw_name, _, version = info.name.removesuffix(_SUFFIX).partition("-")
            name = canonicalize_name(raw_name)
            found.setdefault(name, Distribution(name, version.replace("_", "-"), info))
    return found


def with_dependencies(names: Iterable[str], available: Mapping[str, Distribution]) -> dict[str, Distribution]:
    """Return the distributions of these names and all that they need, with the extras that are asked for.

    Distributions that are not `available` are left out.
    """
    found: dict[str, Distribution] = {}
    asked: dict[str, frozenset[str]] = {}
    left: list[tuple[str, frozenset[str]]] = [(canonicalize_name(name), frozenset()) for name in names]
    while left:
        name, extras = left.pop()
        if name in available and (name not in found or not extras <= asked[name]):
            found[name] = available[name]
            asked[name] = asked.get(name, frozenset()) | extras
            left += available[name].requires(asked[name]).items()
    return found


def unused_without(leaving: Collection[str], installed: Mapping[str, Distribution]) -> list[Distribution]:
    """Return what would be left of the needs of distributions that leave, by name: what nothing else needs.

    Plug-ins, and whatever somebody has asked an installer for by name (the file REQUESTED, PEP 376), are not among it.
    """
    needed = with_dependencies(leaving, installed).keys() - set(leaving)
    candidates = {
        name for name in needed if not installed[name].is_plugin and not (installed[name].info / "REQUESTED").exists()
    }
    kept = with_dependencies(installed.keys() - candidates - set(leaving), installed)
    return [installed[name] for name in sorted(candidates - kept.keys())]
