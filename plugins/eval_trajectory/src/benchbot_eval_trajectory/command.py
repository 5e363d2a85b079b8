"""`benchbot trajectory`: errors of trajectory files, and results as such files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from benchbot.cli.kit import console, requirement
from benchbot.cli.kit.options import Json, Requirements, group
from benchbot.plugin import BenchbotError

if TYPE_CHECKING:
    from benchbot_eval_trajectory.trajectory import Trajectory

app = group("Trajectory errors of TUM and KITTI files.")

MAX_DIFFERENCE_S = 0.01
SUMMARY = ("rmse", "mean", "median", "max")


@app.command()
def evaluate(
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE", help="A TUM or KITTI file.")],
    truth: Annotated[Path, typer.Argument(metavar="GROUND_TRUTH", help="A file of the same format.")],
    align: Annotated[
        Literal["none", "se3", "sim3"],
        typer.Option(
            metavar="none|se3|sim3", help="Bring the estimate closest to the truth first; sim3 scales it too."
        ),
    ] = "se3",
    length_m: Annotated[
        float, typer.Option("--length", metavar="METRES", min=0.0, help="Relative errors over so much of the true way.")
    ] = 1.0,
    max_difference_s: Annotated[
        float,
        typer.Option("--max-difference", metavar="SECONDS", min=0.0, help="Poses of TUM files belong together up to."),
    ] = MAX_DIFFERENCE_S,
    association: Annotated[
        Literal["evo", "tum"],
        typer.Option(
            metavar="evo|tum",
            help="Each pose of the shorter file with its nearest, as evo; or the closest two first, as TUM's tools.",
        ),
    ] = "evo",
    require: Requirements = None,
    as_json: Json = False,
) -> None:
    """Print absolute (ATE) and relative (RPE) trajectory errors: root mean square, mean, median, largest, how many.

    TUM files are associated by time, KITTI files line by line.
    """
    from benchbot_eval_trajectory import comparison, files

    requirements = requirement.parse(require)
    document = comparison.compare(
        files.read(estimate),
        files.read(truth),
        align=align,
        length_m=length_m,
        max_difference_s=max_difference_s,
        association=association,
    )
    note = f"{document['poses']} pairs of poses, alignment {align}"
    console.note(note + (f", scale {document['scale']:.6g}" if align == "sim3" else ""))
    for name, unmatched in document["unmatched"].items():
        if unmatched["poses"]:
            words = f"{unmatched['poses']} of {unmatched['of']} poses of the {name.replace('_', ' ')}"
            console.note(f"Unmatched: {words} (association {association}, up to {max_difference_s:g} s)")
    if as_json:
        console.data_json(document)
    else:
        header = ("", *SUMMARY, "count")
        rows = [
            (name, *(f"{values[key]:.6f}" for key in SUMMARY), str(values["count"])) if values else (name, *"-----")
            for name, values in document["errors"].items()
        ]
        console.table(header, rows)
    requirement.check(requirements, _scores(document))


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="INPUT", help="A BenchBot result (.json), a TUM or a KITTI file.")],
    output: Annotated[Path, typer.Argument(metavar="OUTPUT", help="The file to write.")],
    file_format: Annotated[
        Literal["tum", "kitti"], typer.Option("--format", metavar="tum|kitti", help="What to write.")
    ] = "tum",
    truth: Annotated[
        bool, typer.Option("--truth", help="Of a result, where the robot really went, not the solution's estimate.")
    ] = False,
) -> None:
    """Write the trajectory of a result, or of a file, as a TUM or KITTI file."""
    from benchbot.plugin import write_text
    from benchbot_eval_trajectory import files

    console.check_output(output)
    if source.suffix.lower() == ".json":
        trajectory = _of_result(source, truth=truth)
    elif truth:
        raise BenchbotError(
            f"{source} holds one trajectory.",
            "--truth chooses one of the two that a result holds.",
            "Leave --truth out, or convert a result.",
        )
    else:
        trajectory = files.read(source)
    write_text(output, files.text_of(trajectory, files.FileFormat(file_format)))
    console.note(f"{len(trajectory)} poses: {output}")


def _of_result(path: Path, *, truth: bool) -> "Trajectory":
    """Return the estimate, or the true poses at the observations, one for each time."""
    import numpy as np

    from benchbot.plugin import read_result
    from benchbot_eval_trajectory import evaluator
    from benchbot_eval_trajectory.formats import trajectory as results_format

    document = read_result(path)
    if truth:
        found, _ = evaluator.truth_of(document)
    else:
        results_format.validate(document.get("results"))
        found, _, _ = evaluator.matched(document)
    if found.times_s is None:
        return found
    return found.at(np.flatnonzero(np.diff(found.times_s, append=np.inf) > 0))


def _scores(document: dict[str, Any]) -> dict[str, float]:
    """Return the errors by the names that `--require` knows, such as `ATE_RMSE_m`."""
    scores = {}
    for name, values in document["errors"].items():
        stem, _, unit = name.rpartition("_")
        for key in SUMMARY if values else ():
            scores[f"{stem}_{key if key != 'rmse' else 'RMSE'}_{unit}"] = values[key]
    return scores
