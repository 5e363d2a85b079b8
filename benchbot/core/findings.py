"""Findings: what a diagnosis looked at, how bad it is, and how to mend it."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How bad a finding is."""

    OK = "ok"
    WARNING = "warning"
    BROKEN = "broken"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at; `fix` is empty when there is nothing to mend."""

    level: Level
    subject: str
    detail: str
    fix: str = ""
