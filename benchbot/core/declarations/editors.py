"""Schemas for editors: files beside declarations, which are named in a declaration's first line.

The line is that of the YAML language server, which editors such as VS Code, Vim and Emacs use:
https://github.com/redhat-developer/yaml-language-server#using-inlined-schema
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchbot.core import atomic
from benchbot.core.declarations import schema

FOLDER = ".schemas"


def first_line(kind: str, up: int = 1) -> str:
    """Return the first line of a declaration that is `up` folders below the one that holds the folder of schemas."""
    return f"# yaml-language-server: $schema={'../' * up}{FOLDER}/{kind}.json\n"


def write(folder: Path, schemas: Mapping[str, dict[str, Any]]) -> list[Path]:
    """Write schemas into a folder, by kind, and return their files; raises OSError when they cannot be written."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for kind, document in schemas.items():
        paths.append(folder / f"{kind}.json")
        atomic.write(paths[-1], (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode())
    return paths


def leave(folder: Path, *kinds: str) -> None:
    """Leave schemas as BenchBot brings them in a folder of declarations; raises OSError when they cannot be written."""
    write(folder / FOLDER, {kind: schema.schema(kind) for kind in kinds})
