"""`benchbot compare`: sets of results, pair by pair."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import GroundTruths, Json, Method, Missing, Over

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchbot.plugins.report.result_sets import ResultSet


def compare(
    sets: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]PATH",
            help="Two sets of results or more: a folder, ZIP archive or result file each, or a scores document.",
        ),
    ],
    score: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which score. [default: the method's headline]")
    ] = None,
    over: Over = "places",
    ignore_seeds: Annotated[
        bool, typer.Option("--ignore-seeds", help="Pair the results of an environment in order, whatever their seeds.")
    ] = False,
    ignore_settings: Annotated[
        bool, typer.Option("--ignore-settings", help="Pair results, too, whose runs differ in what --set changed.")
    ] = False,
    method: Method = None,
    ground_truth: GroundTruths = None,
    missing: Missing = "zero",
    as_json: Json = False,
) -> None:
    """Say whether one set of results scores higher than another, and how sure that is.

    Results of the same environment, settings (--set) and seed are paired. Differences are tested by a permutation test
    over places; the p-values of several comparisons are adjusted. Results are scored first; scores documents are taken
    as they are.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation import intervals
    from benchbot.plugins.report import comparison, result_sets

    catalog = Catalog(load())
    named = result_sets.read(sets, catalog=catalog, method=method, ground_truth_paths=ground_truth, missing=missing)
    evaluator = result_sets.evaluator_of(named, catalog)
    document = comparison.compare(
        named, evaluator, score, over=intervals.Over(over), ignore_seeds=ignore_seeds, ignore_settings=ignore_settings
    )
    document["notes"] += [*_restarts(named), *_robots(named)]
    show(document, as_json=as_json)


def show(document: dict[str, Any], *, as_json: bool = False) -> None:
    """Print a comparison document; on stderr, what differs beside and what does not take part."""
    for line in document["notes"]:
        console.note(line)
    for item in document["comparisons"]:
        _tell_of_gaps(item, document["over"])
    if as_json:
        console.data_json(document)
        return
    console.table(
        ("", document["score"], "95 % interval", "scored", "failed"), [_set(item) for item in document["sets"]]
    )
    console.note()
    console.table(
        ("", "difference", "95 % interval", "p", "p (Holm)", "pairs", document["over"]),
        [_comparison(item) for item in document["comparisons"]],
    )
    console.data("", *(item["sentence"] for item in document["comparisons"]))


def _restarts(sets: "Sequence[ResultSet]") -> list[str]:
    """Return in a sentence how often the robot was put back in each set; nothing where it never was."""
    counts = {one.name: [(row["provenance"] or {}).get("restarts", 0) for row in one.document["rows"]] for one in sets}
    if not any(map(any, counts.values())):
        return []
    said = [f"{name} {sum(each)} in {sum(map(bool, each))} of {len(each)} results" for name, each in counts.items()]
    return [f"The robot was put back after it had moved (restarts): {'; '.join(said)}."]


def _robots(sets: "Sequence[ResultSet]") -> list[str]:
    """Return in sentences what differs between the real robots of the sets, and which findings were overridden."""
    told: dict[str, dict[str, dict[str, None]]] = {}
    notes = []
    for one in sets:
        robots = [(row["provenance"] or {}).get("robot") or {} for row in one.document["rows"]]
        despite = [", ".join(robot["despite"]) for robot in robots if robot.get("despite")]
        if despite:
            names = "; ".join(dict.fromkeys(despite))
            notes.append(f"{one.name}: {len(despite)} of {len(robots)} results despite a broken robot ({names}).")
        for robot in robots:
            for key, value in robot.get("driver", {}).items():
                if isinstance(value, str | int):
                    told.setdefault(key, {}).setdefault(str(value), {})[one.name] = None
    for key, values in told.items():
        if len(values) > 1:
            found = "; ".join(f"{value} ({', '.join(names)})" for value, names in values.items())
            notes.append(f"The robot's {key.replace('_', ' ')} differs: {found}.")
    return notes


def _set(item: dict[str, Any]) -> tuple[str, ...]:
    failures = ", ".join(f"{count} {name}" for name, count in item["failures"].items()) or "-"
    scored = f"{item['scored']}/{item['expected']}"
    return item["name"], f"{item['score']:.4f}", _interval(item["interval"]), scored, failures


def _comparison(item: dict[str, Any]) -> tuple[str, ...]:
    return (
        f"{item['a']} - {item['b']}",
        f"{item['difference']:+.4f}",
        _interval(item["interval"]),
        f"{item['p']:.3g}",
        f"{item['p_holm']:.3g}",
        str(item["pairs"]),
        str(item["clusters"]),
    )


def _interval(interval: dict[str, float] | None) -> str:
    return "-" if interval is None else f"[{interval['low']:.4f}, {interval['high']:.4f}]"


def _tell_of_gaps(item: dict[str, Any], over: str) -> None:
    """Name what does not take part in a comparison, and the option that helps when too little is left."""
    for name, side in ((item["a"], "a"), (item["b"], "b")):
        if item["unpaired"][side]:
            console.note(f"Only in {name}, left out: {'; '.join(item['unpaired'][side])}")
    if item["verdict"] == "too_few" and over == "places":
        console.note("To speak of the environments in just these places: --over environments")
    if item["unpaired"]["without_score"]:
        console.note(f"Without this score, left out: {'; '.join(item['unpaired']['without_score'])}")
