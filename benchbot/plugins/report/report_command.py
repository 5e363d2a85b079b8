"""`benchbot report`: results as a page for people, tables for papers and programs, test cases for CI."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import GroundTruths, Method, Missing, Over, RequiredEnvs, RequiredEnvsBatch, RequiredTask
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.evaluation.score import Options

DEFAULT = Path("report.html")


def report(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]RESULT",
            help="Result files, ZIP archives and folders of them. With names, new=A old=B, sets side by side.",
        ),
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output-location",
            "-o",
            metavar="PATH",
            help="Write it here, as the name ends: .html, .csv, .tex, .md, .xml (JUnit); repeatable. "
            f"[default: {DEFAULT}]",
        ),
    ] = None,
    wanted: Annotated[
        Literal["html", "csv", "tex", "md", "xml"] | None,
        typer.Option(
            "--format",
            metavar="html|csv|tex|md|xml",
            help="Write this, whatever the name ends in; to stdout without -o.",
        ),
    ] = None,
    method: Method = None,
    name: Annotated[
        str | None,
        typer.Option("--name", metavar="TEXT", help="What the solution is called. [default: the name of its file]"),
    ] = None,
    frames: Annotated[
        Path | None,
        typer.Option(
            "--frames",
            metavar="FOLDER",
            help="What submit --record frames=FOLDER wrote, for a single result. [default: 'frames' beside the result]",
        ),
    ] = None,
    ground_truth: GroundTruths = None,
    required_task: RequiredTask = None,
    required_envs: RequiredEnvs = None,
    required_envs_batch: RequiredEnvsBatch = None,
    missing: Missing = "zero",
    over: Over = "places",
) -> None:
    """Make a report of results, to be read by somebody who was not there; prints the paths of what it wrote.

    The page holds ground truth and needs no other file, no network and no script.
    """
    from benchbot.cli.evaluate import required_environments
    from benchbot.cli.kit.status_line import working
    from benchbot.core.atomic import write_text
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation import intervals
    from benchbot.evaluation.score import Options, score_files
    from benchbot.plugins.drawing.scene_maps import frames_in
    from benchbot.plugins.report import result_sets
    from benchbot.plugins.report.episodes import gather
    from benchbot.plugins.report.rendering import format_of, render

    paths = output or ([] if wanted else [DEFAULT])
    for path in paths:
        console.check_output(path)
    catalog = Catalog(load())
    scoring: Options = {
        "catalog": catalog,
        "method": method,
        "ground_truth_paths": ground_truth,
        "required_task": required_task,
        "required_envs": required_environments(catalog, required_envs, required_envs_batch),
        "missing": missing,
        "over": intervals.Over(over),
    }
    if result_sets.are_named(results):
        if wanted not in (None, "html") or frames is not None or name is not None:
            raise BenchbotError(
                "Sets side by side make a page.",
                "--format, --frames and --name are for the report of one set.",
                "Leave them out; for tables and figures name them: benchbot report new=A old=B -o table.tex",
            )
        _write_side_by_side(results, paths or [DEFAULT], scoring)
        return
    formats = {path: wanted or format_of(path) for path in paths}
    if frames is not None:
        frames_in(frames)
    files = [Path(text) for text in results]
    with working("Working out the intervals"):
        evaluation = score_files(files, **scoring)
    if frames is not None and evaluation.document["coverage"]["expected"] > 1:
        raise BenchbotError(
            "The frames are not known to belong to one result.",
            f"--frames {frames} was given with {evaluation.document['coverage']['expected']} results.",
            "Keep each result in a folder of its own, with its frames in 'frames' beside it, and leave --frames out.",
        )
    with working("Drawing the report"):
        data = gather(evaluation, files, catalog=catalog, name=name, frames=frames)
        texts = {name: render(data, name) for name in dict.fromkeys([*formats.values(), *([wanted] if wanted else [])])}
    for path, form in formats.items():
        write_text(path, texts[form])
        console.data(str(path))
    if wanted is not None and not paths:
        console.document(texts[wanted].rstrip("\n"))


def _write_side_by_side(texts: list[str], paths: list[Path], scoring: "Options") -> None:
    """Write the comparison of named sets as pages, tables and figures, by the endings of `paths`."""
    from benchbot.cli.kit.status_line import working
    from benchbot.core.text import visible
    from benchbot.evaluation.intervals import Over
    from benchbot.evaluation.score import score_files
    from benchbot.plugins.report import comparison, comparison_exports, result_sets, side_by_side
    from benchbot.plugins.report.episodes import gather

    for path in paths:
        comparison_exports.check_ending(path, (".html", ".htm"))
    catalog = scoring["catalog"]
    named = result_sets.distinct(texts)
    with working("Scoring the sets"):
        evaluations = {name: score_files([path], **scoring) for name, path in named}
        sets = [result_sets.ResultSet(name, evaluation.document) for name, evaluation in evaluations.items()]
        for other in sets[1:]:
            result_sets.require_alike(sets[0], other)
        evaluator = result_sets.evaluator_of(sets, catalog)
        document = comparison.compare(sets, evaluator, over=scoring.get("over", Over.PLACES))
    with working("Drawing the report"):
        data = [gather(evaluations[name], [path], catalog=catalog, name=name) for name, path in named]

        def page() -> str:
            return visible(side_by_side.html(data, document))

        for path in paths:
            comparison_exports.write(path, document, sets, evaluator, page)
            console.data(str(path))
