"""Entry points of installed distributions, read from their metadata.

What `importlib.metadata` does, without its start-up cost: it imports the e-mail package to parse headers, which alone
takes longer than everything else that `benchbot list` does. A test holds both to the same answer.
Format: https://packaging.python.org/en/latest/specifications/entry-points/
"""

import os
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any, NamedTuple

_METADATA = {".dist-info": "METADATA", ".egg-info": "PKG-INFO"}


class EntryPoint(NamedTuple):
    """A name that a distribution gives to an object: `value` is `module` or `module:attribute`."""

    name: str
    value: str
    distribution: str
    version: str


def find(group: str, prefix: str = "") -> Iterator[EntryPoint]:
    """Yield the entry points of a group, in the order of `sys.path`. Distributions inside ZIP files are not seen.

    With `prefix`, only distributions are read whose metadata is in a folder of a name that begins with it.
    """
    for folder in dict.fromkeys(sys.path):
        try:
            with os.scandir(folder or ".") as entries:
                found = sorted(
                    entry.path
                    for entry in entries
                    if entry.name.startswith(prefix) and entry.name.endswith(tuple(_METADATA))
                )
        except OSError:
            continue
        for path in found:
            yield from _of(path, group)


def shipped(kind: str) -> Iterator[Any]:
    """Yield the records of a kind (`commands`, …) that BenchBot's own plug-ins yield.

    They are asked without pluggy, and those of others are not imported: `benchbot --help` has no time for either.
    """
    found = {
        point.name: point for point in reversed([*find("benchbot", "benchbot-")]) if point.distribution == "benchbot"
    }
    for _, point in sorted(found.items()):
        yield from getattr(import_module(point.value), f"benchbot_{kind}", tuple)()


def _of(path: str, group: str) -> Iterator[EntryPoint]:
    text = _read(os.path.join(path, "entry_points.txt"))  # noqa: PTH118
    if group not in text:
        return
    headers = _headers(_read(os.path.join(path, _METADATA[os.path.splitext(path)[1]])))  # noqa: PTH118, PTH122
    section = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("["):
            section = line.strip("[]").strip()
        elif section == group and "=" in line and line[0] not in "#;":
            name, _, value = line.partition("=")
            # What may follow in brackets are extras, which the specification tells readers to ignore.
            value = value.partition("[")[0].strip()
            yield EntryPoint(name.strip(), value, headers.get("Name", ""), headers.get("Version", ""))


def _headers(text: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for line in text.splitlines():
        if not line:
            break
        key, colon, value = line.partition(":")
        if colon and not line[0].isspace():
            found.setdefault(key, value.strip())
    return found


def _read(path: str) -> str:
    try:
        with open(path, encoding="utf-8") as file:  # noqa: PTH123
            return file.read()
    except (OSError, UnicodeDecodeError):
        return ""
