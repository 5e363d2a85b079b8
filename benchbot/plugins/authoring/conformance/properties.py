"""Properties and findings: the result of checking one property, and the report of many."""

import os
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar, TypeVarTuple

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level

_KIT = str(Path(__file__).parent)
_MARKS = {Level.OK: "ok     ", Level.WARNING: "warning", Level.BROKEN: "BROKEN "}
LEAK_ROUNDS = 3
RAISED = "It raised "

Subject = TypeVar("Subject")
Subjects = TypeVarTuple("Subjects")


class Violation(Exception):  # noqa: N818
    """A property does not hold: what was seen, and how to mend it. `level` may be a mere warning."""

    def __init__(self, detail: str, fix: str, level: Level = Level.BROKEN) -> None:
        super().__init__(detail)
        self.detail = detail
        self.fix = fix
        self.level = level


class Nonconformity(AssertionError):  # noqa: N818
    """Something does not conform; the text of the exception is the whole report."""


def check_property(subject: str, property_holds: Callable[[], str]) -> Finding:
    """Return the finding of one property: a function that returns what it saw, or raises `Violation`.

    Any other exception is taken for the plug-in's own failure.
    """
    try:
        detail = property_holds()
    except Violation as violation:
        return Finding(violation.level, subject, violation.detail, violation.fix)
    except BenchbotError as error:
        return Finding(Level.BROKEN, subject, f"{error.title} {error.why}", error.fix)
    # A plug-in under test may fail in any way at all, and the other properties are still worth a look.
    except Exception as error:  # noqa: BLE001
        fix = f"Mend {_origin(error)}."
        return Finding(Level.BROKEN, subject, f"{RAISED}{type(error).__name__}: {error}", fix)
    return Finding(Level.OK, subject, detail)


def check_properties(properties: Mapping[str, Callable[[*Subjects], str]], *subjects: *Subjects) -> list[Finding]:
    """Return the finding of each property: functions of the subjects, by name."""
    return [check_property(name, partial(holds, *subjects)) for name, holds in properties.items()]


def obtain(name: str, make: Callable[[], Subject], describe: Callable[[Subject], str]) -> tuple[Finding, list[Subject]]:
    """Return the finding about getting what is to be checked, and a list of that: empty when it cannot be had."""
    made: list[Subject] = []

    def can_be_had() -> str:
        made.append(make())
        return describe(made[0])

    return check_property(name, can_be_had), made


def told_once(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings with the same exception, raised in many, told in one: the first, which names the others."""
    raised: dict[tuple[str, str], list[Finding]] = {}
    kept: list[Finding] = []
    for finding in findings:
        same = raised.setdefault((finding.detail, finding.fix), []) if finding.detail.startswith(RAISED) else []
        if not same:
            kept.append(finding)
        same.append(finding)
    also = {id(first): others for first, *others in raised.values()}
    return [
        replace(one, detail=f"{one.detail} The same in: {', '.join(other.subject for other in also[id(one)])}.")
        if also.get(id(one))
        else one
        for one in kept
    ]


def unchecked(why: str, fix: str) -> Violation:
    """Return the exception for a property that cannot be checked: a warning, since an OK would be taken for checked."""
    return Violation(f"Not checked: {why}", fix, Level.WARNING)


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
    checked = list(findings)
    broken = [finding for finding in checked if finding.level is Level.BROKEN]
    if not checked:
        raise Nonconformity("Nothing was checked.")
    if broken:
        count = f"{len(broken)} of {len(checked)} properties do" if len(broken) > 1 else "One property does"
        raise Nonconformity(f"{count} not hold.\n{as_text(checked)}")


def leaves_nothing_open(use: Callable[[], None]) -> str:
    """Check that repeated use leaves no process, thread or file open. The first use may fill caches."""
    if not Path("/proc/self/fd").is_dir():
        raise unchecked("this system does not tell what is open.", "Check it on Linux.")
    use()
    before = _open_resources()
    for _ in range(LEAK_ROUNDS):
        use()
    grown = {kind: count - before[kind] for kind, count in _open_resources().items()}
    # Every round leaks alike; one resource more or less may belong to something else in this process.
    leaked = [f"{count} {kind}" for kind, count in grown.items() if count >= LEAK_ROUNDS]
    if leaked:
        raise Violation(
            f"{LEAK_ROUNDS} rounds left {' and '.join(leaked)} open.", "End and close in close() what was started."
        )
    return f"no process, thread or file after {LEAK_ROUNDS} rounds"


@contextmanager
def environment_variables(**values: str) -> Iterator[None]:
    """Set environment variables of this process for the block, and no others: threads may read them meanwhile."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _open_resources() -> dict[str, int]:
    """Count this process's children, threads and open files, on a system with /proc."""
    children = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    return {
        "processes": sum(len(path.read_text("utf-8").split()) for path in children),
        "threads": threading.active_count(),
        "files": len(list(Path("/proc/self/fd").iterdir())),
    }


def _origin(error: Exception) -> str:
    """Return the file and line of the plug-in that an error comes from."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(_KIT)] or list(frames)
    return f"{own[-1].filename}:{own[-1].lineno}"
