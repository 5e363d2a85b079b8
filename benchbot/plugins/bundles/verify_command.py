"""`benchbot verify`: replays results in the simulator, and checks scores."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.console import interruptible
from benchbot.cli.kit.options import GroundTruths, Json
from benchbot.core.errors import BenchbotError, ExitCode

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.evaluation import ground_truths
    from benchbot.evaluation.result_document import ResultDocument
    from benchbot.evaluation.result_files import Unreadable

VERIFIED, DIFFERENT, UNVERIFIABLE = "verified", "different", "unverifiable"


def verify(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULT", help="Result files, ZIP archives and folders of them.")
    ],
    scores: Annotated[
        Path | None, typer.Option("--scores", metavar="SCORES.json", help="Hold these scores against the results, too.")
    ] = None,
    ground_truth: GroundTruths = None,
    as_json: Json = False,
) -> None:
    """Take the recorded actions of results again, in the simulator, and say whether the same is seen.

    A result is verified when every observation is the same to the byte, the robot's way, its time and collisions are
    as the result says, and its limits are kept; its score is computed again. That its map or other answer was made
    by the solution is not shown by that: benchbot reproduce runs the solution again. Exits with 1 when a result or
    score is different, with 2 when one cannot be verified.
    """
    from benchbot.cli.kit.status_line import working
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.long_work import counted
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation import ground_truths, result_files
    from benchbot.evaluation.result_document import ResultDocument

    kinds = (ResultDocument, result_files.Unreadable)
    catalog = Catalog(load())
    truths = ground_truths.GroundTruths.of(catalog, ground_truth)
    with interruptible("the simulator has been ended."), working("Replaying results"):
        items = [item for item in result_files.read(results) if isinstance(item, kinds)]
        found = [_verified(item, catalog, truths) for item in counted("Replaying results", items)]
        wrong_scores = None if scores is None else _wrong_scores(results, scores, catalog, ground_truth)
    if as_json:
        console.data_json({"results": found, "scores": wrong_scores})
    else:
        for row in found:
            but = row.get("not_proven", ())[:1] if row["outcome"] == VERIFIED else ()
            outcome = " but for ".join([row["outcome"], *but])
            shown = ", ".join(row.get("shown", ()))
            console.data("  ".join(filter(None, [outcome, row["about"], row["source"], shown])))
    for row in found:
        _note_details(row)
    for problem in wrong_scores or ():
        console.note(f"scores: {problem}")
    if wrong_scores == []:
        console.note(f"The scores in {scores} are those of the results.")
    outcomes = {row["outcome"] for row in found}
    if DIFFERENT in outcomes or wrong_scores:
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)
    if UNVERIFIABLE in outcomes:
        raise typer.Exit(ExitCode.USAGE)


def _verified(
    item: "ResultDocument | Unreadable", catalog: "Catalog", truths: "ground_truths.GroundTruths"
) -> dict[str, Any]:
    import tempfile

    from benchbot.evaluation.result_files import Unreadable
    from benchbot.plugins.bundles import recomputing, replay
    from benchbot.supervisor.platform.host import ChildHost

    if isinstance(item, Unreadable):
        return _row(item.source, "", UNVERIFIABLE, [f"{item.error.title} {item.error.why}"])
    with tempfile.TemporaryDirectory(prefix="benchbot-") as folder:
        try:
            verification = replay.verify(
                item.document, catalog, lambda selection: ChildHost(selection, Path(folder) / "platform.log")
            )
        # Including a failure of the simulator: one hostile result must not prevent the check of others.
        except BenchbotError as error:
            return _row(item.source, item.about, UNVERIFIABLE, [f"{error.title} {error.why} {error.fix}"])
    row = _row(item.source, item.about, VERIFIED if verification.verified else DIFFERENT, list(verification.problems))
    scored = recomputing.recomputed(item, catalog, truths)
    not_proven = list(verification.unproven)
    if item.document.get("results") is not None:
        score = [] if scored.scores else [f"its score. {scored.why_not}"]
        not_proven = ["the answer, which is the solution's own", *not_proven, *score]
    if verification.verified:
        row["shown"] = ["actions", "observations", f"budgets ({replay.budgets_in_words(item.document)})"]
        row["shown"] += [f"score ({scored.headline} {scored.scores[scored.headline]:.4f})"] if scored.scores else []
    return {
        **row,
        "scores": scored.scores,
        "observations": verification.observations,
        "not_proven": not_proven,
        "software": [str(difference) for difference in verification.software],
    }


def _row(source: str, about: str, outcome: str, problems: list[str]) -> dict[str, Any]:
    return {"source": source, "about": about, "outcome": outcome, "problems": problems}


def _note_details(row: dict[str, Any]) -> None:
    """Note problems, statements that a replay cannot show, and other software."""
    for problem in row["problems"]:
        console.note(f"{row['source']}: {problem}")
    for what in row.get("not_proven", ())[row["outcome"] == VERIFIED :]:  # the line has told the first
        console.note(f"{row['source']}: not shown by a replay: {what}")
    if row["outcome"] == DIFFERENT:
        for difference in row["software"]:
            console.note(f"{row['source']}: other software: {difference}")


def _wrong_scores(results: list[Path], stated: Path, catalog: "Catalog", ground_truth: list[Path] | None) -> list[str]:
    from benchbot.core.results import read_scores
    from benchbot.evaluation import evaluate_files
    from benchbot.plugins.bundles.comparing import score_contradictions

    document = read_scores(stated)
    method = document["method"]["name"]
    missing = document["coverage"].get("missing_counts", "zero")
    found = evaluate_files(results, catalog=catalog, method=method, ground_truth_paths=ground_truth, missing=missing)
    return score_contradictions(document, found)
