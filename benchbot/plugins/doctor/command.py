"""`benchbot doctor`: the problems of this machine, and how to mend them."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.core.errors import BenchbotError, ExitCode

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.findings import Finding


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Start every simulator and fill its cache; takes up to a minute.")
    ] = False,
    robot: Annotated[
        str | None, typer.Option("--robot", metavar="ROBOT", help="Look at a real robot that is switched on, instead.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find what is broken on this machine, or on a robot, and how to mend it. Exits with 2 when something is."""
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.findings import Level
    from benchbot.core.plugin_manager import load

    if warm and robot is not None:
        raise BenchbotError(
            "--warm and --robot do not go together.",
            "--warm starts the simulators of this machine, --robot looks at a real robot.",
            f"Do one after the other: benchbot doctor --robot {robot}",
        )
    catalog = Catalog(load())
    findings = []
    for finding in _found(catalog, warm=warm, robot=robot):
        findings.append(finding)
        if not as_json:
            console.data(f"{finding.level:<8} {finding.subject}: {finding.detail}")
            if finding.fix:
                console.data(f"{'':<8} Fix: {finding.fix}")
    if as_json:
        console.data_json([asdict(finding) for finding in findings])
    broken, warnings = (sum(finding.level is level for finding in findings) for level in (Level.BROKEN, Level.WARNING))
    counts = [f"{count} {what}" for count, what in ((broken, "broken"), (warnings, "to be looked at")) if count]
    console.note(f"{', '.join(counts)}." if counts else "Everything works.")
    if broken:
        raise typer.Exit(ExitCode.USAGE)


def _found(catalog: "Catalog", *, warm: bool, robot: str | None) -> "Iterator[Finding]":
    if robot is not None:
        from benchbot.plugins.doctor.plugins import diagnose_robot

        return diagnose_robot(catalog, robot)
    from benchbot.plugins.doctor.diagnosis import diagnose

    return diagnose(catalog, warm=warm)
