"""Properties and findings: how a check says what it looked at, and how a report of them reads."""

import traceback
from collections.abc import Callable, Iterable
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level

_KIT = str(Path(__file__).parent)
_MARKS = {Level.OK: "ok     ", Level.WARNING: "warning", Level.BROKEN: "BROKEN "}


class Wrong(Exception):  # noqa: N818
    """A property does not hold: what was seen, and how to mend it. `level` may be a mere warning."""

    def __init__(self, detail: str, fix: str, level: Level = Level.BROKEN) -> None:
        super().__init__(detail)
        self.detail = detail
        self.fix = fix
        self.level = level


class Nonconformity(AssertionError):  # noqa: N818
    """Something does not conform; its text is the whole report."""


def look(subject: str, property_holds: Callable[[], str]) -> Finding:
    """Return the finding of one property: a function that returns what it saw, or raises `Wrong`.

    Whatever else it raises is taken for the plug-in's own failure.
    """
    try:
        detail = property_holds()
    except Wrong as wrong:
        return Finding(wrong.level, subject, wrong.detail, wrong.fix)
    except BenchbotError as error:
        return Finding(Level.BROKEN, subject, f"{error.title} {error.why}", error.fix)
    # A plug-in under test may fail in any way at all, and the other properties are still worth a look.
    except Exception as error:  # noqa: BLE001
        return Finding(Level.BROKEN, subject, f"It raised {type(error).__name__}: {error}", f"Mend {_place(error)}.")
    return Finding(Level.OK, subject, detail)


def unchecked(why: str, fix: str) -> Wrong:
    """Return what to raise where a property cannot be looked at: a warning, so that nobody takes it for checked."""
    return Wrong(f"Not checked: {why}", fix, Level.WARNING)


def as_text(findings: Iterable[Finding]) -> str:
    """Return a report, a line per finding, with the fix below what is wrong."""
    lines = []
    for finding in findings:
        lines.append(f"{_MARKS[finding.level]} {finding.subject}: {finding.detail}")
        if finding.fix and finding.level is not Level.OK:
            lines.append(f"        fix: {finding.fix}")
    return "\n".join(lines)


def conform(findings: Iterable[Finding]) -> None:
    """Return when nothing is broken (warnings are let pass); else raise `Nonconformity` with the report."""
    looked_at = list(findings)
    broken = [finding for finding in looked_at if finding.level is Level.BROKEN]
    if not looked_at:
        raise Nonconformity("Nothing was checked.")
    if broken:
        of = f"{len(broken)} of {len(looked_at)} properties do" if len(broken) > 1 else "One property does"
        raise Nonconformity(f"{of} not hold.\n{as_text(looked_at)}")


def _place(error: Exception) -> str:
    """Return the file and line of the plug-in that an error comes from."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(_KIT)] or list(frames)
    return f"{own[-1].filename}:{own[-1].lineno}"
