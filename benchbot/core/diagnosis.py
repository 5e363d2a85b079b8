"""The diagnosis of a real robot before it moves: what its driver finds, and which findings keep a run from starting."""

import shlex
from collections.abc import Iterator, Sequence

from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean
from benchbot.core.findings import Finding, Level
from benchbot.core.platform import PlatformSpec
from benchbot.core.records import RobotDriver


def diagnose(driver: RobotDriver, distribution: str, spec: PlatformSpec) -> Iterator[Finding]:
    """Yield what a driver finds of a robot, nothing where it offers no diagnosis; a diagnosis that fails is a finding.

    Nothing is commanded: the robot does not move.
    """
    subject = f"robot {spec.robot['name']}"
    try:
        yield from () if driver.diagnose is None else driver.diagnose(spec)
    except BenchbotError as error:
        yield Finding(Level.BROKEN, subject, f"{error.title} {error.why}", error.fix)
    # A third party's code, its middleware and the robot may fail in any way at all, which this check finds out.
    except Exception as error:  # noqa: BLE001
        fix = f"Report it to the author of {distribution}."
        yield Finding(Level.BROKEN, subject, f"its diagnosis failed: {type(error).__name__}: {error}", fix)


def admit(robot: str, findings: Sequence[Finding], despite: Sequence[str]) -> None:
    """Raise BenchbotError when a robot is broken in a way that `despite`, names of findings, does not override."""
    known = list(dict.fromkeys(finding.subject for finding in findings))
    for name in despite:
        if name not in known:
            raise BenchbotError(
                f"The diagnosis of the robot '{robot}' has no finding '{name}'.",
                f"--despite names a finding as it is printed.{did_you_mean(name, known)} "
                f"It found: {', '.join(known) or 'nothing'}.",
                "Correct --despite, or leave it out.",
                failure=FailureClass.PLATFORM,
                ends_run=True,
            )
    broken = [finding for finding in findings if finding.level is Level.BROKEN and finding.subject not in despite]
    if broken:
        overrides = " ".join(f"--despite {shlex.quote(name)}" for name in dict.fromkeys(one.subject for one in broken))
        raise BenchbotError(
            f"The robot '{robot}' is not fit to be driven.",
            "\n".join(["Its diagnosis before the first motion:", *(f"{one.subject}: {one.detail}" for one in broken)]),
            "\n".join([*dict.fromkeys(one.fix for one in broken if one.fix), f"To drive it all the same: {overrides}"]),
            failure=FailureClass.PLATFORM,
            ends_run=True,
        )
