"""Findings of a diagnosis, with how to mend them, and problems of files, with their places."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path


class Level(StrEnum):
    """The severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    BROKEN = "broken"


@dataclass(frozen=True)
class Finding:
    """The result of one check; `subject` is its name, `fix` is empty when there is nothing to mend."""

    level: Level
    subject: str
    detail: str
    fix: str = ""

    def as_dict(self) -> dict[str, str]:
        """Return it as results hold it."""
        return {"level": self.level.value, "name": self.subject, "text": self.detail}


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a file: where (line, and JSON pointer of RFC 6901), and what.

    A `warning` is about something that may be right on another machine.
    """

    path: Path
    line: int | None
    pointer: str
    message: str
    warning: bool = False

    def __str__(self) -> str:
        line = "" if self.line is None else f":{self.line}"
        level = "warning: " if self.warning else ""
        where = f" at {self.pointer}" if self.pointer else ""
        return f"{self.path}{line}: {level}{self.message}{where}"
