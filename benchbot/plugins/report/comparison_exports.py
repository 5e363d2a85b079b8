"""A comparison of sets for a paper: a table for LaTeX, a figure, or the document itself, by the ending of a file."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.atomic import write_text
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.plugins.report.episodes import natural
from benchbot.plugins.report.exports import latex, latex_row
from benchbot.plugins.report.result_sets import ResultSet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Document = Mapping[str, Any]
FIGURES = (".pdf", ".svg", ".png")
WIDTH_MM, ROW_MM, MOST_ROWS = 88.0, 4.2, 60


def check_ending(path: Path, more: Sequence[str] = ()) -> None:
    """Raise BenchbotError for a path whose ending says nothing that can be written."""
    endings = (*more, ".tex", ".json", *FIGURES)
    if path.suffix.lower() not in endings:
        raise BenchbotError(
            f"It is not known what to write into {path}.",
            f"Its name ends in none of: {', '.join(endings)}.",
            "Name it like that: table.tex for the paper's table, figure.pdf for its figure.",
        )


def write(
    path: Path,
    document: Document,
    sets: Sequence[ResultSet],
    evaluator: Evaluator,
    page: Callable[[], str] | None = None,
) -> None:
    """Write a comparison as the name ends; `page` gives what `.html` has. Raises BenchbotError as `check_ending`."""
    ending = path.suffix.lower()
    if ending in FIGURES:
        from benchbot.plugins.drawing import figures

        with figures.style():
            figures.save(forest(document), path)
    elif ending == ".tex":
        write_text(path, to_latex(document, sets, evaluator))
    elif ending == ".json":
        write_text(path, json.dumps(document, indent=1) + "\n")
    elif page is not None:
        write_text(path, page())


def to_latex(document: Document, sets: Sequence[ResultSet], evaluator: Evaluator) -> str:
    """Return a table for the package booktabs: each environment, all sets, and the first one minus each other.

    Scores are those that the method combines of all results; differences are those of pairs, with their interval.
    """
    score = document["score"]
    names = [item["name"] for item in document["sets"]]
    of_first = [item for item in document["comparisons"] if item["a"] == names[0]]
    head = ["Environment", *names, *(f"{item['a']} − {item['b']}" for item in of_first)]
    body = []
    for environment, values in by_environment(sets, evaluator, score).items():
        differences = [_mean(item, environment) for item in of_first]
        body.append([environment, *map(_number, values), *map(_signed, differences)])
    last = ["all", *(_number(item["score"]) for item in document["sets"])]
    last += [f"{_signed(item['difference'])}{_interval(item['interval'])}" for item in of_first]
    said = " ".join(item["sentence"] for item in of_first)
    caption = f"{score} of {', '.join(names)}: task {document['task']}, method {document['method']['name']} "
    caption += f"{document['method']['version']}. {said}"
    lines = [
        r"% \usepackage{booktabs}",
        r"\begin{table}",
        r"  \centering",
        rf"  \caption{{{latex(caption)}}}",
        rf"  \begin{{tabular}}{{l{'r' * (len(head) - 1)}}}",
        r"    \toprule",
        latex_row([latex(cell) for cell in head]),
        r"    \midrule",
        *(latex_row([latex(cell) for cell in row]) for row in body),
        r"    \midrule",
        latex_row([latex(cell) for cell in last]),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def by_environment(sets: Sequence[ResultSet], evaluator: Evaluator, score: str) -> dict[str, list[float | None]]:
    """Return the score of each set in each environment, None where a set has none that counts."""
    names = sorted({row["environment"] for one in sets for row in one.rows if row["environment"]}, key=natural)
    found: dict[str, list[float | None]] = {}
    for name in names:
        rows = [[row["scores"] for row in one.rows if row["environment"] == name] for one in sets]
        found[name] = [evaluator.combine(scores).get(score) if scores else None for scores in rows]
    return found


def forest(document: Document) -> "Figure":
    """Return the forest plot of each comparison: paired differences by environment, and the whole with its interval."""
    from matplotlib.figure import Figure

    comparisons = document["comparisons"]
    rows = [_rows(item) for item in comparisons]
    heights = [ROW_MM * (len(found) + 1) + 14 for found in rows]
    figure = Figure(figsize=(WIDTH_MM / 25.4, sum(heights) / 25.4), layout="constrained")
    panels = figure.subplots(len(comparisons), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, item, found in zip(panels, comparisons, rows, strict=True):
        _plot(axes, item, found, document)
    return figure


def _plot(axes: "Axes", item: Document, rows: Sequence[tuple[str, list[float]]], document: Document) -> None:
    from benchbot.plugins.drawing.figures import FAINT, INK, PATH, SMALL_PT

    for place, (_, values) in enumerate(rows):
        axes.plot(values, [place] * len(values), "o", color=PATH, markersize=2.6, alpha=0.75, zorder=3)
        if len(values) > 1:
            mean = sum(values) / len(values)
            axes.plot([mean, mean], [place - 0.28, place + 0.28], color=PATH, linewidth=1.2, zorder=4)
    bottom = len(rows)
    if item["interval"]:
        axes.plot([item["interval"]["low"], item["interval"]["high"]], [bottom, bottom], color=INK, linewidth=1.4)
    axes.plot([item["difference"]], [bottom], "D", color=INK, markersize=4, zorder=4)
    axes.axvline(0, color=FAINT, linewidth=0.6, zorder=1)
    axes.axhline(bottom - 0.5, color=FAINT, linewidth=0.4)
    axes.set_yticks(range(bottom + 1), [*(name for name, _ in rows), "all"], fontsize=SMALL_PT)
    axes.set_ylim(bottom + 0.7, -0.7)
    reach = 1.08 * max(abs(end) for end in axes.get_xlim())
    axes.set_xlim(-reach, reach)
    axes.tick_params(length=2, labelsize=SMALL_PT)
    axes.spines[["top", "right", "left"]].set_visible(False)
    lower = document.get("lower_is_better")
    better = "" if lower is None else f" ({item['a'] if not lower else item['b']} better to the right)"
    axes.set_xlabel(f"{document['score']}: {item['a']} − {item['b']}{better}", fontsize=SMALL_PT)


def _rows(item: Document) -> list[tuple[str, list[float]]]:
    """Return the differences by environment; of very many, those that are largest in the mean."""
    found: dict[str, list[float]] = {}
    for row in item["rows"]:
        found.setdefault(row["pair"].partition(",")[0], []).append(row["difference"])
    largest = sorted(found, key=lambda name: -abs(sum(found[name]) / len(found[name])))[:MOST_ROWS]
    return [(name, found[name]) for name in sorted(largest, key=natural)]


def _mean(item: Document, environment: str) -> float | None:
    values = dict(_rows({**item, "rows": [row for row in item["rows"] if row["pair"].split(",")[0] == environment]}))
    return None if environment not in values else sum(values[environment]) / len(values[environment])


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _signed(value: float | None) -> str:
    return "–" if value is None else f"{value:+.3f}".replace("-", "−")


def _interval(interval: Document | None) -> str:
    return "" if interval is None else f" [{_signed(interval['low'])}, {_signed(interval['high'])}]"
