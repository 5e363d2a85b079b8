"""`benchbot compare`: sets of results, pair by pair."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import GroundTruths, Json, Method, Missing, Over
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchbot.plugins.report.result_sets import ResultSet


def compare(
    sets: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]PATH",
            help="Two sets of results or more: a folder, ZIP archive or result file each, or a scores document. With "
            "--across one or more folders, the NAME is that of the solution.",
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
    paired_by: Annotated[
        Literal["scene"] | None,
        typer.Option(
            metavar="scene",
            help="Print two sets side by side, scene by scene, whatever robot and seed: simulated and real. Of several "
            "solutions, each in a folder of its name, also how alike both sets order them.",
        ),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Print the kinds of error of each set, too, and what each costs.")
    ] = False,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output-location",
            "-o",
            metavar="PATH",
            help="Write it here as well, as the name ends: .tex (the paper's table), .pdf, .svg, .png (its figure), "
            ".json; repeatable.",
        ),
    ] = None,
    across: Annotated[
        Literal["simulator"] | None,
        typer.Option(
            metavar="simulator",
            help="Put the same solutions, task and places in several simulators side by side: scores, differences by "
            "scene, how alike solutions are ranked, and where recorded pictures differ the most.",
        ),
    ] = None,
    objects: Annotated[
        bool,
        typer.Option("--objects", help="Say which true objects one set found and another did not. Shows the truth."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Say whether one set of results scores higher than another, and how sure that is.

    Results of the same environment, settings (--set) and seed are paired. Differences are tested by a permutation test
    over places; the p-values of several comparisons are adjusted. Results are scored first; scores documents are taken
    as they are.
    """
    from benchbot.cli.kit.status_line import working
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.evaluation import intervals, result_files
    from benchbot.plugins.report import comparison, comparison_exports, object_changes, result_sets

    for path in output or ():
        comparison_exports.check_ending(path)
        console.check_output(path)
    catalog = Catalog(load())
    if across is not None:
        if paired_by is not None:
            raise BenchbotError(
                "--across and --paired-by are two ways to compare.",
                "Both were given.",
                "Leave one of them out: --across simulator pairs scenes by itself.",
            )
        if output:
            raise BenchbotError(
                "Across simulators there is no table or figure for a paper.",
                "-o was given with --across.",
                "Leave one of them out; --json prints all of it.",
            )
        from benchbot.plugins.report.across_simulators import across_simulators

        scoring: dict[str, Any] = {"catalog": catalog, "method": method, "ground_truth_paths": ground_truth}
        with working("Comparing simulators"):
            found = across_simulators(sets, score, over=intervals.Over(over), missing=missing, **scoring)
        show_simulators(found, as_json=as_json)
        return
    if paired_by is not None:
        if output:
            raise BenchbotError(
                "Scene by scene there is no table or figure for a paper.",
                "-o was given with --paired-by.",
                "Leave one of them out; --json prints all of it.",
            )
        scoring = {"catalog": catalog, "method": method, "ground_truth_paths": ground_truth, "missing": missing}
        with working("Comparing scene by scene"):
            scenes = _by_scene(sets, score, scoring)
        show_scenes(scenes, as_json=as_json)
        return
    with working("Testing the differences"):
        named = result_sets.read(sets, catalog=catalog, method=method, ground_truth_paths=ground_truth, missing=missing)
        evaluator = result_sets.evaluator_of(named, catalog)
        paired = {"ignore_seeds": ignore_seeds, "ignore_settings": ignore_settings}
        document = comparison.compare(named, evaluator, score, over=intervals.Over(over), **paired)
        if explain:
            document["errors"] = comparison.errors_of(named)
        if objects:
            paths = dict(map(result_files.named, sets))
            document["objects"] = object_changes.object_changes(
                paths, catalog=catalog, method=method, ground_truth_paths=ground_truth
            )
    document["notes"] += [*_restarts(named), *_robots(named)]
    for path in output or ():
        comparison_exports.write(path, document, named, evaluator)
        console.note(f"Written: {path}")
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
    if "errors" in document:
        console.note()
        console.table(("error", *_titles(document["errors"])), _errors(document["errors"]))
    console.data("", *(item["sentence"] for item in document["comparisons"]))
    for item in document.get("objects", ()):
        _tell_of_objects(item)


def _tell_of_objects(item: dict[str, Any]) -> None:
    """Print which objects one set found and the other did not."""
    a, b = item["a"], item["b"]
    both = f"both found {item['both']} objects, neither {item['neither']}, in {item['episodes']} episodes of both"
    console.data("", f"{a} and {b}: {both}")
    for name, other, rows in ((a, b, item["won"]), (b, a, item["lost"])):
        console.data(f"Only {name} found {len(rows)}:")
        cells = [(row["class"], row["episode"], row["why"]) for row in rows]
        console.table(("class", "episode", f"why not {other}"), cells)


def _titles(errors: dict[str, Any]) -> list[str]:
    return [title for name in errors for title in (name, "costs")]


def _errors(errors: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of the table of errors: each kind, how many each set has, and what they cost it."""
    told = [{error["kind"]: error for error in found} for found in errors.values()]
    rows = []
    for kind in dict.fromkeys(kind for each in told for kind in each):
        cells = [
            (str(each[kind]["count"]), f"{each[kind]['gain']:.2f}") if kind in each else ("-", "-") for each in told
        ]
        rows.append((kind, *(cell for pair in cells for cell in pair)))
    return rows


def _by_scene(texts: list[str], score: str | None, scoring: dict[str, Any]) -> dict[str, Any]:
    """Return the table of two sets by scenes, with what their recordings show."""
    from benchbot.evaluation.result_files import named
    from benchbot.plugins.report import channel_differences, comparison, result_sets, scene_pairs

    if len(texts) != 2:
        raise BenchbotError(
            "--paired-by scene puts two sets side by side.",
            f"{len(texts)} were given.",
            "Name two: benchbot compare simulated=A real=B --paired-by scene",
        )
    (name_a, path_a), (name_b, path_b) = map(named, texts)
    solutions = scene_pairs.solutions_of(path_a, path_b)
    if name_a == name_b:
        raise BenchbotError(
            f"2 sets are called '{name_a}'.",
            f"They are: {path_a}, {path_b}.",
            "Give them names: benchbot compare simulated=A real=B --paired-by scene",
        )
    pairs = {}
    for solution in solutions or [""]:
        a, b = result_sets.read([f"{name_a}={path_a / solution}", f"{name_b}={path_b / solution}"], **scoring)
        pairs[solution] = (a, b)
    first, *others = [one for both in pairs.values() for one in both]
    for other in others:
        result_sets.require_alike(first, other)
    chosen = score or str(first.document["method"]["headline"])
    for one in (first, *others):
        comparison.require_score(one, chosen)
    catalog = scoring["catalog"]
    evaluator = result_sets.evaluator_of([first, *others], catalog)
    document = scene_pairs.scene_pairs((name_a, name_b), pairs, evaluator, chosen)
    notes = [note for both in pairs.values() for note in (*comparison.notes_on(both), *_restarts(both))]
    found = [
        {"solution": row["solution"], **differences}
        for row in document["rows"]
        if (differences := channel_differences.of_scene(catalog.plugins, *pairs[row["solution"]], row["scene"]))
    ]
    return {**document, "channels": found, "notes": list(dict.fromkeys(notes))}


def show_scenes(document: dict[str, Any], *, as_json: bool = False) -> None:
    """Print the table of two sets by scenes; on stderr, what differs beside and what does not take part."""
    for line in document["notes"]:
        console.note(line)
    for name, scenes in document["only"].items():
        if scenes:
            console.note(f"Only in {name}, left out: {'; '.join(scenes)}")
    if as_json:
        console.data_json(document)
        return
    several = any(row["solution"] for row in document["rows"])
    console.table(
        (*(["solution"] if several else []), "scene", document["a"], document["b"], "difference", "results"),
        [
            (
                *([row["solution"]] if several else []),
                row["scene"],
                f"{row['a']:.4f}",
                f"{row['b']:.4f}",
                f"{row['difference']:+.4f}",
                " and ".join(map(str, row["results"])),
            )
            for row in document["rows"]
        ],
    )
    differs = document["mean_absolute_difference"]
    console.data("", f"Mean absolute difference of {document['score']}: {differs:.4f}", *_rank_lines(document["ranks"]))
    for item in document["channels"]:
        steps = " and ".join(map(str, item["steps"]))
        console.data("", f"{' '.join(filter(None, [item['solution'], item['scene']]))}, {steps} steps recorded:")
        told = [(one["channel"], f"{one['mean_absolute']:.4g}", one["unit"]) for one in item["channels"]]
        console.table(("observation", "mean absolute difference", "unit"), told)


def show_simulators(document: dict[str, Any], *, as_json: bool = False) -> None:
    """Print the tables of pairs of simulators; on stderr, what does not take part and what differs beside."""
    for line in document["notes"]:
        console.note(line)
    if as_json:
        console.data_json(document)
        return
    for pair in document["pairs"]:
        console.table(
            ("solution", "scene", pair["a"], pair["b"], "difference"),
            [
                (row["solution"], row["scene"], f"{row['a']:.4f}", f"{row['b']:.4f}", f"{row['difference']:+.4f}")
                for row in pair["rows"]
            ],
        )
        console.data("")
        console.table(
            ("scene", "mean difference", "largest", "of", "Kendall's tau"),
            [
                (
                    scene["scene"],
                    f"{scene['mean_difference']:+.4f}",
                    f"{scene['largest_difference']:+.4f}",
                    scene["largest_of"],
                    "-" if scene["kendall_tau"] is None else f"{scene['kendall_tau']:.2f}",
                )
                for scene in pair["scenes"]
            ],
        )
        mean = f"Mean absolute difference of {document['score']}: {pair['mean_absolute_difference']:.4f}"
        console.data("", mean, *_rank_lines(pair["ranks"]))
        if pair["ranks"] is not None:
            interval = pair["ranks"]["interval"]
            said = pair["ranks"]["note"] or f"95 % interval of tau over other {document['over']}: {_interval(interval)}"
            console.data(said)
        for item in pair["pictures"]:
            worst = item["worst"][0]
            console.data(
                "",
                f"{' '.join(filter(None, [item['solution'], item['scene']]))}: pictures differ by "
                f"{item['mean_absolute']:.2f} of 255 in {item['steps']} steps, most in step {worst['step']}, by "
                f"{worst['mean_absolute']:.2f}",
                *(path for path in (worst["a"], worst["b"]) if path is not None),
            )


def _rank_lines(ranks: dict[str, Any] | None) -> list[str]:
    if ranks is None:
        return []
    order = f"Order of {ranks['solutions']} solutions over {len(ranks['scenes'])} scenes"
    if ranks["kendall_tau"] is None:
        return [f"{order}: none, one of the sets has the same score for all of them."]
    tau, p, rho = (ranks[name] for name in ("kendall_tau", "kendall_p", "spearman_rho"))
    return [f"{order}: Kendall's tau {tau:.3f} (p = {p:.3g}), Spearman's rho {rho:.3f}"]


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
