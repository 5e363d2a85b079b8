"""`benchbot bundle`: packs results and the solution that made them into one file for others."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import GroundTruths, Json
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog, Declaration
    from benchbot.evaluation.result_document import ResultDocument
    from benchbot.plugins.bundles.snapshot import Snapshot
    from benchbot.plugins.bundles.solution_source import Source


def bundle(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULT", help="Result files, ZIP archives and folders of them.")
    ],
    solution: Annotated[
        Path | None,
        typer.Option(
            "--solution",
            "-s",
            metavar="PATH",
            help="The folder in which its command ran, or its one file. [default: what the batch has run]",
        ),
    ] = None,
    example: Annotated[
        str | None, typer.Option("--example", "-E", metavar="NAME", help="The solution is this example.")
    ] = None,
    command: Annotated[
        str | None,
        typer.Option("--command", metavar="COMMAND", help="What runs it in that folder. [default: as the results say]"),
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option("--leave-out", metavar="PATTERN", help="Leave these files of the solution out; repeatable."),
    ] = None,
    scores: Annotated[
        Path | None, typer.Option("--scores", metavar="SCORES.json", help="The scores of just these results.")
    ] = None,
    evaluate_with: Annotated[
        str | None, typer.Option("--evaluate-with", "-e", metavar="METHOD", help="Score the results with this method.")
    ] = None,
    ground_truth: GroundTruths = None,
    lock: Annotated[
        Path | None,
        typer.Option(
            "--lock", metavar="FILE", help="What benchbot plugins lock wrote. [default: benchbot.lock of the solution]"
        ),
    ] = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0, help="How long the solution may run, where it is limited.")
    ] = None,
    output: Annotated[Path, typer.Option("--output-location", "-o", metavar="FILE.zip", help="Write it here.")] = Path(
        "bundle.zip"
    ),
    as_json: Json = False,
) -> None:
    """Make one file of results, the solution that made them, and what they ran on, so that others can repeat them.

    \b
    benchbot bundle result.json --solution my_solution/ --evaluate-with omq -o mine.zip
    benchbot reproduce mine.zip

    Of a folder under git everything goes in that git does not ignore. Links, secrets and ground truth are refused. The
    bundle's path goes to stdout. The same results and source give the same bytes.
    """
    from benchbot.cli.kit.status_line import working
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.bundles import bundle_file
    from benchbot.submission.modes import split_words

    console.check_output(output)
    catalog = Catalog(load())
    with working("Reading results"):
        submissions = _submissions(results)
    kept = _snapshot(submissions, results)
    source = _source(catalog, solution, example, leave_out or [], kept)
    with working("Packing the bundle"):
        manifest = bundle_file.make(
            output,
            submissions,
            source,
            scores=_scores(submissions, results, scores, evaluate_with, catalog, ground_truth),
            command=None if command is None else split_words("--command", command),
            lock=lock or _lock_in(source),
            timeout_s=timeout,
            snapshot=kept if solution is None and example is None else None,
        )
    _note_contents(manifest, output)
    console.data_json({"path": str(output), **manifest}) if as_json else console.data(str(output))


def _snapshot(submissions: "list[ResultDocument]", paths: list[Path]) -> "Snapshot | None":
    """Return the snapshot that made the results of a batch, where it lies with them."""
    from benchbot.plugins.bundles import snapshot

    ran = ((item.document.get("provenance") or {}).get("solution") or {} for item in submissions)
    named = {one.get("snapshot") for one in ran}
    return snapshot.found(str(named.pop()), paths) if len(named) == 1 and None not in named else None


def _source(
    catalog: "Catalog", solution: Path | None, example: str | None, leave_out: list[str], kept: "Snapshot | None"
) -> "Source":
    from benchbot.plugins.bundles import solution_source

    if solution is None and example is None and kept is not None:
        console.note(f"The solution is the snapshot that the batch has run: {kept.path}")
        return solution_source.of_snapshot(kept, leave_out)
    if (solution is None) == (example is None):
        raise BenchbotError(
            "It is not clear which solution made the results.",
            f"{'Neither' if solution is None else 'Both'} of --solution and --example was given.",
            "Name its folder, or its file: --solution PATH; or an example: --example NAME. What a batch has run lies "
            "with its results, and needs no name.",
        )
    if example is None:
        source = solution_source.collect(solution or Path(), leave_out)
    else:
        chosen = catalog.get("examples", example)
        source = solution_source.collect(chosen.path.parent, [*leave_out, *_of_other_examples(chosen, catalog)])
    if kept is not None:
        solution_source.require_content(source, kept)
    return source


def _of_other_examples(chosen: "Declaration", catalog: "Catalog") -> set[str]:
    """Return the files in the folder of an example that are others', and the plug-in that lists them."""

    def files(example: "Declaration") -> set[str]:
        words = shlex.split(str(example.data.get("native_command", "")))
        return {example.path.name, *(Path(word).as_posix() for word in words)}

    folder = chosen.path.parent
    beside = [other for other in catalog.pool("examples").values() if other.path.parent == folder]
    return {"plugin.py", "__init__.py", *(name for other in beside for name in files(other))} - files(chosen)


def _lock_in(source: "Source") -> Path | None:
    from benchbot.plugins.installer.lockfile import NAME

    path = source.folder / NAME
    return path if any(member.path == NAME for member in source.members) else None


def _submissions(paths: list[Path]) -> "list[ResultDocument]":
    from benchbot.evaluation import result_files
    from benchbot.evaluation.result_document import ResultDocument

    found = []
    for item in result_files.read(paths):
        if isinstance(item, result_files.Unreadable):
            raise item.error
        if isinstance(item, ResultDocument):
            found.append(item)
    if not found:
        raise BenchbotError("There is nothing to bundle.", "No result was given.", "Name result files, or a folder.")
    return found


def _scores(
    submissions: "list[ResultDocument]",
    paths: list[Path],
    stated: Path | None,
    method: str | None,
    catalog: "Catalog",
    ground_truth: list[Path] | None,
) -> dict[str, Any] | None:
    from benchbot.core.results import read_scores
    from benchbot.evaluation import evaluate_files

    if stated is not None and method is not None:
        raise BenchbotError(
            "The scores are named twice.", "--scores and --evaluate-with exclude each other.", "Leave one of them out."
        )
    if method is not None:
        return evaluate_files(paths, catalog=catalog, method=method, ground_truth_paths=ground_truth)
    if stated is None:
        return None
    document = read_scores(stated)
    known = {item.about for item in submissions}
    rows = len(document["rows"])
    if rows > len(known):
        raise BenchbotError(
            f"The scores in {stated} are not of these results.",
            f"They are of {rows} results, and {len(known)} go into the bundle.",
            "Score just these: --evaluate-with METHOD",
        )
    return document


def _note_contents(manifest: dict[str, Any], path: Path) -> None:
    solution = manifest["solution"]
    files = [name for name in manifest["files"] if name.startswith("solution/")]
    size = sum(pinned["bytes"] for pinned in manifest["files"].values())
    console.note(f"Solution     {len(files)} files, run as: {shlex.join(solution['command'])}")
    console.note(f"Results      {len(manifest['results'])}")
    if manifest["scores"] is not None:
        console.note(f"Scores       {manifest['scores']['method']}")
    if solution.get("git_dirty"):
        console.note("Warning      The solution had changes that were not committed when it ran.")
    console.note(f"Bundle       {size / 2**20:.1f} MiB")
