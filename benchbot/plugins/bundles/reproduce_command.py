"""`benchbot reproduce`: runs the solution of a bundle again, and compares the results."""

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.console import interruptible
from benchbot.cli.kit.holding import (
    Cpus,
    CpuTime,
    FileSize,
    Gpus,
    Memory,
    Processes,
    Readable,
    WeakLimits,
    process_limits,
)
from benchbot.cli.kit.options import GroundTruths, Json
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.bundles.untrusted_solution import Choice, unpacked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchbot.core.selection import Selection
    from benchbot.plugins.bundles.bundle_file import Bundle
    from benchbot.plugins.bundles.comparing import SoftwareDifference
    from benchbot.plugins.bundles.reproducing import Reproduction, Scoring
    from benchbot.submission.modes import SolutionSpec


_FALSE = "The scores in the bundle are not those of its results:"


def reproduce(
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="A file that benchbot bundle has made.")],
    tolerance: Annotated[
        float,
        typer.Option(metavar="X", min=0, help="By how much each score may differ where results are not identical."),
    ] = 0.0,
    native: Annotated[
        bool, typer.Option("--native", help="Run the solution with all your rights, not in a sandbox. It asks first.")
    ] = False,
    trust: Annotated[bool, typer.Option("--trust", help="Say yes to that beforehand: you have read the code.")] = False,
    readable: Readable = None,
    cpus: Cpus = None,
    gpus: Gpus = 0,
    weak_limits: WeakLimits = False,
    memory: Memory = None,
    processes: Processes = None,
    cpu_time: CpuTime = None,
    file_size: FileSize = None,
    timeout: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", min=0, help="End a solution that runs longer. [default: as the bundle says]"),
    ] = None,
    ground_truth: GroundTruths = None,
    results_location: Annotated[
        Path | None, typer.Option("--results-location", "-r", metavar="FOLDER", help="Keep the new results here.")
    ] = None,
    unpack: Annotated[
        Path | None,
        typer.Option("--unpack", metavar="FOLDER", help="Write the solution's source to this new folder; run nothing."),
    ] = None,
    check_only: Annotated[
        bool, typer.Option("--check-only", help="Check the bundle, what is installed, and scores; run nothing.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Run the solution of a bundle again, once for each of its results, and say whether the same comes of it.

    A result is identical when every observation, every action and every bit of the answer is the same; otherwise it is
    said what differs first, and whether its scores are within the tolerance. The solution runs in a sandbox, or in a
    container where it ran in one for its results. Exits with 1 when a result, or a score that the bundle states, is
    different.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.bundles import bundle_file, reproducing

    if results_location is not None and results_location.exists() and not results_location.is_dir():
        raise BenchbotError(
            f"{results_location} is not a folder.", "The new results are several files.", "Name a folder."
        )
    catalog = Catalog(load())
    with bundle_file.opened(bundle) as opened:
        if unpack is not None:
            _unpack(opened, unpack)
            return
        chosen = reproducing.selections(opened, catalog)
        software = reproducing.other_software(opened, chosen)
        for difference in software:
            console.note(f"Other software: {difference}")
        _note_versions(opened, software)
        if check_only:
            _tell_of_check(reproducing.check_scores(opened, catalog, ground_truth))
            return
        limits = process_limits(memory, processes, cpu_time, file_size)
        choice = Choice(limits, timeout, native, trust, readable, cpus, gpus, weak_limits)
        with ExitStack() as stack:
            stack.enter_context(interruptible("the solution and its back end have been ended."))
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="benchbot-")))
            spec = stack.enter_context(unpacked(catalog, opened, folder / "solution", choice))
            found = _run(opened, chosen, spec, results_location or folder / "results")
            found, scoring = reproducing.score(opened, found, catalog, ground_truth, tolerance)
    _print(found, scoring, [str(difference) for difference in software], as_json=as_json)
    if scoring.false or any(one.likeness is reproducing.Likeness.DIFFERENT for one in found):
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)


def _run(bundle: "Bundle", chosen: "Sequence[Selection]", spec: "SolutionSpec", target: Path) -> "list[Reproduction]":
    """Run the solution again for each result, with a note on each."""
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.plugins.bundles import reproducing

    found = []
    with StatusLine() as status:
        for number, one in enumerate(reproducing.run(bundle, chosen, spec, target, status), 1):
            status.note(f"{number} of {len(chosen)}: {one.about}: {'differs' if one.differences else one.likeness}")
            found.append(one)
    return found


def _tell_of_check(scoring: "Scoring") -> None:
    """Say what was checked; exits with 1 for scores that are not those of the results, with 2 for unknown ones."""
    for problem in scoring.false:
        console.note(f"{_FALSE} {problem}")
    if scoring.false:
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)
    sound = "The bundle is as it was made, and its results can be made again here; that they would be the same was not"
    if scoring.method is not None and scoring.why_not is not None:
        console.note(f"{sound} tried. Its scores could not be computed again: {scoring.why_not}")
        raise typer.Exit(ExitCode.USAGE)
    said = "it states no scores" if scoring.method is None else "its scores are those of its results"
    console.note(f"{sound} tried; {said}.")


def _unpack(bundle: "Bundle", folder: Path) -> None:
    """Write the solution's source to a folder; its command goes to stdout."""
    import shlex

    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchbotError(
            f"{folder} is not an empty folder.", "What is there could be mixed up with the solution.", "Name a new one."
        )
    folder.mkdir(parents=True, exist_ok=True)
    bundle.extract_solution(folder)
    console.note(f"The solution is in {folder}, and runs there as:")
    console.document(shlex.join(bundle.manifest["solution"]["command"]))


def _note_versions(bundle: "Bundle", software: "Sequence[SoftwareDifference]") -> None:
    """Show how to install the versions that the results ran on, where versions differ."""
    wanted = [f"{one.name}=={one.version}" for one in software if one.version not in (None, one.installed_version)]
    if wanted and "lock" in bundle.manifest:
        console.note(f"To have the same: unzip {bundle.archive.source} benchbot.lock && benchbot plugins sync")
    elif wanted:
        console.note(f"To have the same: benchbot install {' '.join(wanted)}")


def _print(found: "list[Reproduction]", scoring: "Scoring", software: list[str], *, as_json: bool) -> None:
    if scoring.why_not is not None and scoring.method is not None:
        console.note(f"Not scored: {scoring.why_not}")
    for problem in scoring.false:
        console.note(f"{_FALSE} {problem}")
    for one in found:
        for text in (*one.differences, *one.score_differences):
            console.note(f"{one.about}: {text}")
    if as_json:
        console.data_json(
            {
                "results": [
                    {
                        "file": one.file,
                        "about": one.about,
                        "likeness": one.likeness.value,
                        "differences": list(one.differences),
                        "scores": None if one.scores is None else dict(one.scores),
                        "score_differences": list(one.score_differences),
                    }
                    for one in found
                ],
                "scored_with": None if scoring.why_not is not None else scoring.method,
                "false_scores": list(scoring.false),
                "software": software,
            }
        )
    else:
        for one in found:
            console.data(f"{one.likeness}  {one.about}")
