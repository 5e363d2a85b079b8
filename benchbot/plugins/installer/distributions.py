"""Distributions that are installed or unpacked in a folder, read from their metadata; nothing is imported."""

import base64
import csv
import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from importlib.metadata import PathDistribution
from pathlib import Path
from typing import Any

GROUP = "benchbot"
_SUFFIX = ".dist-info"
# What installers write themselves: it says how something was installed, not what.
NOTES = frozenset({"INSTALLER", "RECORD", "REQUESTED", "direct_url.json", "uv_cache.json", "uv_build.json"})


def normal(name: str) -> str:
    """Return a name as packaging.python.org/specifications/name-normalization writes it."""
    return re.sub(r"[-_.]+", "-", name).lower()


@dataclass(frozen=True)
class Distribution:
    """A distribution by its `.dist-info` folder; `name` is normal."""

    name: str
    version: str
    info: Path

    @cached_property
    def metadata(self) -> PathDistribution:
        """What the standard library reads of it."""
        return PathDistribution(self.info)

    @property
    def is_plugin(self) -> bool:
        """Whether BenchBot would load it."""
        return any(point.group == GROUP for point in self.metadata.entry_points)

    @property
    def packages(self) -> set[str]:
        """The top-level packages that BenchBot loads it from."""
        return {point.module.partition(".")[0] for point in self.metadata.entry_points if point.group == GROUP}

    @cached_property
    def files(self) -> tuple[str, ...]:
        """The paths of its files, relative to the folder that it is in, as RECORD lists them."""
        try:
            text = (self.info / "RECORD").read_text("utf-8")
        except OSError:
            return ()
        return tuple(row[0] for row in csv.reader(text.splitlines()) if row)

    @property
    def scripts(self) -> frozenset[str]:
        """The names of the commands that its entry points ask for; installers write those."""
        groups = ("console_scripts", "gui_scripts")
        return frozenset(point.name for point in self.metadata.entry_points if point.group in groups)

    @property
    def origin(self) -> dict[str, Any] | None:
        """Where it came from when it was not an index, as PEP 610 writes it."""
        try:
            found = json.loads((self.info / "direct_url.json").read_text("utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    @property
    def is_editable(self) -> bool:
        """Whether it is a folder of somebody's sources, used in place."""
        return bool((self.origin or {}).get("dir_info", {}).get("editable"))

    def requires(self, extras: Collection[str] = ()) -> dict[str, frozenset[str]]:
        """Return the normal names of what it needs with these extras of its own, and the extras of each."""
        needed: dict[str, frozenset[str]] = {}
        for text in self.metadata.requires or ():
            requirement, _, marker = text.partition(";")
            own = re.search(r"""extra\s*==\s*["']([^"']+)""", marker)
            if own is None or normal(own[1]) in extras:
                name, *asked = re.findall(r"[\w.-]+", re.sub(r"[(<>=!~@].*", "", requirement))
                needed[normal(name)] = needed.get(normal(name), frozenset()) | frozenset(map(normal, asked))
        return needed

    def content(self) -> str:
        """Return the SHA-256 over paths and bytes of what it brings: the same wherever and however it is installed."""
        digest = sha256()
        for place, path in sorted((placed(path), path) for path in self.files):
            is_script = place.startswith("bin/")
            generated = is_script and place.removeprefix("bin/") in self.scripts
            # Headers are put elsewhere in a virtual environment, and are nothing that runs.
            if generated or place.startswith("include/") or self._is_note(path):
                continue
            content = self.file(path).read_bytes()
            if is_script and content.startswith(b"#!"):  # installers write there which Python runs it
                content = content.partition(b"\n")[2]
            digest.update(f"{place}\0{len(content)}\0".encode())
            digest.update(content)
        return digest.hexdigest()

    def file(self, path: str) -> Path:
        """Return where one of its files is."""
        direct = self.info.parent / path
        return direct if direct.exists() else self.info.parent / placed(path)

    def _is_note(self, path: str) -> bool:
        return path.rpartition("/")[2] in NOTES and path.startswith(f"{self.info.name}/")

    def rewrite_origin(self, origin: dict[str, Any] | None) -> None:
        """Say where it came from (PEP 610), in place of a file that was there for installing only; None: an index."""
        path, record = self.info / "direct_url.json", self.info / "RECORD"
        entry = f"{self.info.name}/direct_url.json"
        rows = [row for row in csv.reader(record.read_text("utf-8").splitlines()) if row and row[0] != entry]
        path.unlink(missing_ok=True)  # it may be linked from elsewhere, such as an installer's cache
        if origin is not None:
            content = json.dumps(origin).encode()
            path.write_bytes(content)
            hashed = base64.urlsafe_b64encode(sha256(content).digest()).rstrip(b"=").decode()
            rows.append([entry, f"sha256={hashed}", str(len(content))])
        record.unlink()
        with record.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


def placed(path: str) -> str:
    """Return a path of RECORD from the folder of the installation on: pip and uv start elsewhere where they unpack."""
    return re.sub(r"^(\.\./)+", "", path)


def found_in(folders: Iterable[Path]) -> dict[str, Distribution]:
    """Return the distributions in folders by their normal names; the first of a name wins, as it does for Python."""
    found: dict[str, Distribution] = {}
    for distribution in _all_in(folders):
        found.setdefault(distribution.name, distribution)
    return found


def with_what_they_need(names: Iterable[str], available: Mapping[str, Distribution]) -> dict[str, Distribution]:
    """Return the distributions of these names and all that they need, with the extras that are asked for.

    What is not `available` is left out.
    """
    found: dict[str, Distribution] = {}
    asked: dict[str, frozenset[str]] = {}
    left = [(normal(name), frozenset[str]()) for name in names]
    while left:
        name, extras = left.pop()
        if name in available and (name not in found or not extras <= asked[name]):
            found[name] = available[name]
            asked[name] = asked.get(name, frozenset()) | extras
            left += available[name].requires(asked[name]).items()
    return found


def _all_in(folders: Iterable[Path]) -> Iterator[Distribution]:
    for folder in folders:
        for info in sorted(folder.glob(f"*{_SUFFIX}")):
            name, _, version = info.name.removesuffix(_SUFFIX).partition("-")
            yield Distribution(normal(name), version.replace("_", "-"), info)
