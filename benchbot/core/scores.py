"""Scores documents: checked, written atomically, read with care."""

from pathlib import Path
from typing import Any

from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError

VERSION = 1


def write(path: Path, document: dict[str, Any]) -> None:
    """Write a scores document atomically; raises BenchbotError when it is not valid or cannot be written."""
    schema.check(document, "scores", path)
    results.write_json(path, document)


def read(path: Path) -> dict[str, Any]:
    """Return a scores document; raises BenchbotError for one of a version or form that it does not know."""
    document = schema.read(path)
    version = document.get("version")
    if version != VERSION:
        found = "no version" if version is None else f"version {version!r:.20}"
        raise BenchbotError(
            f"{path} is not a scores document that this BenchBot reads.",
            f"It has {found}; this BenchBot reads version {VERSION}.",
            "Score the results again with: benchbot eval RESULT… -o scores.json",
        )
    schema.check(document, "scores", path)
    return document
