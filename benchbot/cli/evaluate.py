"""`benchbot eval`: results against ground truths."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console, options, requirement
from benchbot.cli.show import listing, showing
from benchbot.core.errors import BenchbotError, ExitCode

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog


def evaluate(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULT", help="Result files, ZIP archives and folders of them.")
    ],
    method: options.Method = None,
    ground_truth: options.GroundTruths = None,
    output: Annotated[
        Path, typer.Option("--output-location", "-o", metavar="PATH", help="Write the scores here.")
    ] = Path("scores.json"),
    required_task: options.RequiredTask = None,
    required_envs: options.RequiredEnvs = None,
    required_envs_batch: options.RequiredEnvsBatch = None,
    missing: options.Missing = "zero",
    over: options.Over = "places",
    explain: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="Write why: what became of each object. It holds ground truth: keep it from solutions.",
        ),
    ] = None,
    validate_only: Annotated[
        bool, typer.Option("--validate-only", "-V", help="Check the results, score nothing.")
    ] = False,
    require: options.Requirements = None,
    as_json: options.Json = False,
    list_methods: Annotated[bool, listing("methods", "--list-methods")] = False,
    show_method: Annotated[str | None, showing("methods", "--show-method")] = None,
    list_batches: Annotated[bool, listing("batches", "--list-batches")] = False,
    show_batch: Annotated[str | None, showing("batches", "--show-batch")] = None,
) -> None:
    """Score results against the ground truth of their environments, and write a scores document.

    The headline score goes to stdout, the table to stderr. One result that cannot be scored does not stop the others.
    """
    from benchbot.cli.kit import scoring
    from benchbot.cli.kit.status_line import working
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.core.results import write_scores
    from benchbot.evaluation import intervals, validate_files
    from benchbot.evaluation.score import explain as explain_scores
    from benchbot.evaluation.score import score_files, write_explanation

    requirements = requirement.parse(require)
    catalog = Catalog(load())
    environments = required_environments(catalog, required_envs, required_envs_batch)
    if required_task is not None:
        catalog.get("tasks", required_task)
    if validate_only:
        with working("Checking the results"):
            coverage = validate_files(results, catalog=catalog, required_task=required_task, required_envs=environments)
        console.note(*scoring.coverage(coverage, "valid"))
        if as_json:
            console.data_json(coverage)
        if coverage["missing"]:
            raise typer.Exit(ExitCode.SUBMISSION_FAILED)
        return
    console.check_output(output)
    console.check_output(explain)
    with working("Working out the intervals"):
        evaluation = score_files(
            results,
            catalog=catalog,
            method=method,
            ground_truth_paths=ground_truth,
            required_task=required_task,
            required_envs=environments,
            missing=missing,
            over=intervals.Over(over),
        )
        explained = None if explain is None else explain_scores(evaluation, catalog)
    document = evaluation.document
    write_scores(output, document)
    console.note(*scoring.table(document))
    console.note(f"Scores: {output}")
    if explain is not None and explained is not None:
        write_explanation(explain, explained)
        console.note(*scoring.diagnosis(explained, document["method"]["headline"]))
        console.note(f"Explanation, with ground truth: {explain}")
    console.data_json(document) if as_json else console.data(scoring.headline(document))
    requirement.check(requirements, document["scores"])


def required_environments(catalog: "Catalog", names: str | None, batch: str | None) -> list[str] | None:
    """Return the environments that count, each known to exist, or None when all do."""
    if names is not None and batch is not None:
        raise BenchbotError(
            "The required environments are named twice.",
            "--required-envs and --required-envs-batch exclude each other.",
            "Leave one of them out.",
        )
    if batch is not None:
        environments: list[str] = catalog.get("batches", batch).data["environments"]
    elif names is not None:
        environments = [name.strip() for name in names.split(",") if name.strip()]
    else:
        return None
    for environment in environments:
        catalog.environments(environment)
    return environments
