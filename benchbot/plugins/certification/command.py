"""`benchbot certify`: a simulator beside the reference."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.core.errors import BenchbotError, ExitCode, did_you_mean

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog, Declaration
    from benchbot.plugins.certification.measuring import Measurement

ROOMS = "miniroom:1,miniroom:2,miniroom:3,miniroom:4,miniroom:5"
QUICK_ROOMS = "miniroom:1"
REFERENCE = "sim_taichi"


def certify(
    plugin: Annotated[str, typer.Argument(metavar="PLUGIN", help="The simulator, or the distribution that it is in.")],
    robot: Annotated[
        str | None,
        typer.Option("--robot", "-r", metavar="ROBOT", help="On this robot. [default: that of the smallest pictures]"),
    ] = None,
    reference: Annotated[
        str, typer.Option("--reference", metavar="SIMULATOR", help="Compare it with this one.")
    ] = REFERENCE,
    rooms: Annotated[
        str | None, typer.Option("--envs", "-e", metavar="ENV,ENV", help=f"In these rooms. [default: {ROOMS}]")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help=f"Two solutions instead of four, in {QUICK_ROOMS} alone.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output-location", "-o", metavar="DIR", help="The folder. [default: certificate-SIMULATOR here]"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Say how far a simulator's scores are from the reference's.

    Runs the conformance kit, then the same solutions in the same rooms on the same robot in both simulators, and writes
    certificate.html, certificate.json and badge.md. Exits with 1 where scores cannot be compared. The same command goes
    on where it was ended; scores of the reference are kept for the next certificate.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import installed, load
    from benchbot.plugins.certification import measuring, report
    from benchbot.plugins.certification.certificate import Certificate

    catalog = Catalog(load())
    simulator = _simulator(plugin, catalog)
    if reference not in catalog.plugins.pool("simulators"):
        raise BenchbotError(
            f"There is no simulator '{reference}' to compare with.",
            f"Installed: {', '.join(sorted(catalog.plugins.pool('simulators'))) or 'none'}.",
            "Install it: benchbot install 'benchbot[full]'",
        )
    chosen = robot_to_certify(simulator, robot, catalog)
    names = [name for name in (rooms or (QUICK_ROOMS if quick else ROOMS)).split(",") if name]
    measured = measuring.measurement(names, quick=quick)
    _require_installed(measured, catalog)
    folder = (output or Path(f"certificate-{simulator}")).absolute()
    declared = measuring.in_the_reference(chosen, reference)

    console.note(f"Certifying {simulator} with the robot {chosen.name}, beside {reference}", "Conformance:")
    findings = measuring.conformance(simulator, chosen.name, names[0])
    console.findings(findings)
    here = measuring.scores(chosen.name, measured, folder, console.note)
    kept = measuring.reference_folder(declared, measured, catalog)
    there = measuring.scores(declared["name"], measured, kept, console.note, declared)
    versions = {info.distribution: info.version for info in installed()}
    document = Certificate(
        simulator,
        chosen.name,
        reference,
        measured.task,
        catalog.plugins.record("evaluators", measured.method).headline,
        versions,
        tuple(findings),
        measuring.rows(measured, here, there),
    )
    written = report.write(document, folder)
    if as_json:
        console.data_json(document.as_dict())
    else:
        console.data(document.statement, document.badge)
    console.note(*(f"Wrote {path}" for path in written))
    if document.problems:
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)


def _simulator(plugin: str, catalog: "Catalog") -> str:
    """Return the name of a simulator, or that of the only one in a distribution."""
    pool = catalog.plugins.pool("simulators")
    if plugin in pool:
        return plugin
    inside = sorted(name for name, provided in pool.items() if provided.distribution == plugin)
    if len(inside) == 1:
        return inside[0]
    known = sorted({*pool, *(provided.distribution for provided in pool.values())})
    if inside:
        raise BenchbotError(
            f"'{plugin}' has several simulators.",
            f"They are {', '.join(inside)}.",
            f"Name one: benchbot certify {inside[0]}",
        )
    raise BenchbotError(
        f"There is no simulator '{plugin}'.",
        f"Simulators, and the distributions that they are in: {', '.join(known) or 'none'}."
        f"{did_you_mean(plugin, known)}",
        "Name one of them, or install the plug-in: benchbot install NAME",
    )


def robot_to_certify(simulator: str, named: str | None, catalog: "Catalog") -> "Declaration":
    """Return the robot to certify with: the one that is named, or that with the smallest pictures, without an arm."""
    if named is not None:
        found = catalog.get("robots", named)
        if found.data["type"] != simulator:
            raise BenchbotError(
                f"The robot '{named}' does not run in {simulator}.",
                f"It is of type '{found.data['type']}'.",
                f"Name one of type '{simulator}': benchbot list robots",
            )
        return found
    seeing = [
        one
        for one in catalog.pool("robots").values()
        if one.data["type"] == simulator and {"image_depth", "image_segment", "poses"} <= set(one.data["connections"])
    ]
    if not seeing:
        raise BenchbotError(
            f"No robot of {simulator} has what the solutions need.",
            "They map objects from image_depth, image_segment and poses.",
            f"Declare a robot of type '{simulator}' with these connections.",
        )
    # An arm stands in the picture and before the laser, and no solution moves it.
    return min(seeing, key=lambda one: ("arm" in one.data, _pixels(one), one.name))


def _pixels(robot: "Declaration") -> int:
    camera = robot.data.get("camera", {})
    return int(camera.get("width", 0)) * int(camera.get("height", 0)) or 10**9


def _require_installed(measured: "Measurement", catalog: "Catalog") -> None:
    """Raise BenchbotError for a task, a method or a room that is not installed, before anything takes long."""
    catalog.get("tasks", measured.task)
    catalog.plugins.record("evaluators", measured.method)
    for room in measured.rooms:
        catalog.get("environments", room)
