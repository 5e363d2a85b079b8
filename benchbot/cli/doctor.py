"""`benchbot doctor`: what is broken on this machine, and how to mend it."""

from dataclasses import asdict
from typing import Annotated

import typer

from benchbot.cli import report
from benchbot.cli.options import Json
from benchbot.core.errors import ExitCode


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Start every simulator and fill its cache; takes up to a minute.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Find what is broken on this machine, and how to mend it. Exits with 2 when something is."""
    from benchbot.cli.diagnosis import Level, diagnose
    from benchbot.core.catalog import Catalog
    from benchbot.core.plugins import load

    findings = []
    for finding in diagnose(Catalog(load()), warm=warm):
        findings.append(finding)
        if not as_json:
            report.data(f"{finding.level:<8} {finding.subject}: {finding.detail}")
            if finding.fix:
                report.data(f"{'':<8} Fix: {finding.fix}")
    if as_json:
        report.data_json([asdict(finding) for finding in findings])
    broken = sum(finding.level is Level.BROKEN for finding in findings)
    report.note(f"{broken} broken." if broken else "Everything works.")
    if broken:
        raise typer.Exit(ExitCode.USAGE)
