"""The scores as tables for other programs and for papers: CSV, Markdown and LaTeX. All text is escaped."""

import csv
import io
import re
from collections.abc import Callable, Sequence

from benchbot.plugins.drawing.episodes import Episode, Material
from benchbot.plugins.report import summary

CSV_COLUMNS = (
    "environment", "place", "variant", "robot", "seed", "repeat", "task", "method", "method_version",
    "status", "score", "value", "failure", "reason", "source", "settings",
)  # fmt: skip

_LATEX = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "''", "→": r"$\rightarrow$", "–": "--", "`": r"\textasciigrave{}",
    "↑": r"$\uparrow$", "↓": r"$\downarrow$",
}  # fmt: skip
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]|[\ud800-\udfff]")


def to_csv(material: Material) -> str:
    """Return a row for each score of each expected result, `value` empty where a result is missing.

    Cells that a spreadsheet would take for a formula begin with an apostrophe.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for episode in material.episodes:
        for name in material.score_names:
            value = (episode.scores or {}).get(name)
            cells = [
                episode.environment, episode.place, episode.variant, episode.robot, episode.seed, episode.repeat,
                material.scores["task_details"]["name"], material.scores["method"]["name"],
                material.scores["method"]["version"], "missing" if episode.scores is None else "scored", name,
            ]  # fmt: skip
            tail = [episode.failure, episode.reason, episode.source, episode.settings]
            writer.writerow([*map(_cell, cells), "" if value is None else repr(value), *map(_cell, tail)])
    return out.getvalue()


def to_markdown(material: Material) -> str:
    """Return the summary and a table of all scores by environment, as GitHub shows them."""
    text, headline = _markdown, material.headline
    task, method = summary.task(material)["name"], material.scores["method"]
    measured = f"in {summary.environments_in_words(material)}, task {task}, method {method['name']} {method['version']}"
    lines = [
        f"# {text(summary.title(material))}",
        "",
        f"**{text(headline)} {_with_interval(material, headline)}** {text(measured)}. {text(_coverage(material))}",
        "",
        f"| environment | {' | '.join(map(text, _named(material)))} | episodes |",
        f"|---|{'---:|' * (len(material.score_names) + 1)}",
    ]
    for label, values, count in _rows(material):
        lines.append(f"| {' | '.join([text(label), *values, str(count)])} |")
    failures = summary.failures(material)
    if failures:
        lines += ["", "| failure | episodes | what happened |", "|---|---:|---|"]
    for group in failures:
        reasons = "; ".join(text(f"{episode.label}: {episode.reason or ''}".rstrip(": ")) for episode in group.episodes)
        lines.append(f"| {text(group.name)} | {len(group.episodes)} | {reasons} |")
    return "\n".join(lines) + "\n"


def to_latex(material: Material) -> str:
    """Return a table of all scores by environment, for the package booktabs."""
    text, names = _latex, material.score_names
    body = [_latex_row([text(label), *values, str(count)]) for label, values, count in _rows(material)]
    interval = summary.interval(material, material.headline)
    level = f" with its {text(interval.name)}" if interval else ""
    caption = (
        f"{text(summary.title(material))}: {text(material.headline)}{level}: "
        f"{text(_with_interval(material, material.headline))}, task {text(summary.task(material)['name'])}, "
        f"method {text(material.scores['method']['name'])} {text(material.scores['method']['version'])}. "
        f"{text(_coverage(material))}"
    )
    return "\n".join(
        [
            r"% \usepackage{booktabs}",
            r"\begin{table}",
            r"  \centering",
            rf"  \caption{{{caption}}}",
            rf"  \begin{{tabular}}{{l{'r' * (len(names) + 1)}}}",
            r"    \toprule",
            _latex_row(["Environment", *map(text, _named(material)), "Episodes"]),
            r"    \midrule",
            *body[:-1],
            r"    \midrule",
            body[-1],
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def _rows(material: Material) -> list[tuple[str, list[str], int]]:
    """Return label, scores and number of episodes of each environment, and of all together."""
    groups: list[tuple[str, Sequence[Episode]]] = [*material.environments.items()]
    found = [(label, material.combined(episodes), len(episodes)) for label, episodes in groups]
    found.append(("all", material.scores["scores"], len(material.episodes)))
    return [
        (label, [_number(scores.get(name)) for name in material.score_names], count) for label, scores, count in found
    ]


def _named(material: Material) -> list[str]:
    return [f"{name} {summary.arrow(material, name)}".rstrip() for name in material.score_names]


def _coverage(material: Material) -> str:
    coverage = material.scores["coverage"]
    missing = summary.missing_in_words(material)
    gaps = f"; {len(coverage['missing'])} missing, {missing}" if coverage["missing"] else ""
    return f"{coverage['scored']} of {coverage['expected']} results scored{gaps}."


def _with_interval(material: Material, name: str) -> str:
    found = summary.interval(material, name)
    value = f"{material.scores['scores'][name]:.3f}"
    return value if found is None else f"{value} [{found.low:.3f}, {found.high:.3f}]"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _latex_row(cells: Sequence[str]) -> str:
    return f"    {' & '.join(cells)} \\\\".replace("–", "--")


def _cell(value: object) -> str:
    """Return a cell without control characters, and such that no spreadsheet runs it as a formula."""
    text = "" if value is None else _CONTROL.sub(" ", str(value))
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") and not isinstance(value, int | float) else text


def _escaper(escape: Callable[[str], str]) -> Callable[[object], str]:
    return lambda value: escape(_CONTROL.sub(" ", str(value)))


_markdown = _escaper(lambda text: re.sub(r"([\\`*_{}\[\]()<>#+!|~&$@])", r"\\\1", text))
_latex = _escaper(lambda text: "".join(_LATEX.get(letter, letter) for letter in text))
