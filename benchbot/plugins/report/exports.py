"""The scores for other programs and for papers: CSV, Markdown and LaTeX tables, and JUnit XML. All text is escaped."""

import csv
import io
import re
from collections.abc import Sequence
from xml.etree import ElementTree as ET

from benchbot.core.errors import FailureClass
from benchbot.core.text import markdown, one_line, visible
from benchbot.plugins.report import summary
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode

CSV_COLUMNS = (
    "environment", "place", "variant", "robot", "seed", "repeat", "task", "method", "method_version",
    "status", "score", "value", "failure", "reason", "source", "settings",
)  # fmt: skip

_FAULT_OF_OTHERS = (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE)
_LATEX = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "''", "→": r"$\rightarrow$", "–": "--", "`": r"\textasciigrave{}",
    "−": "$-$", "↑": r"$\uparrow$", "↓": r"$\downarrow$",
}  # fmt: skip
# The beginning of a formula. Spreadsheets for Chinese and Japanese take the wide characters, too, and those for
# languages with a decimal comma begin a cell at each semicolon.
_FORMULA = re.compile(r"(^|;)(?=\s*[=+\-@＝＋－＠])")


def to_csv(data: ReportData) -> str:
    """Return a row for each score of each expected result, `value` empty where a result is missing.

    Cells that a spreadsheet would take for a formula begin with an apostrophe.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for episode in data.episodes:
        for name in data.score_names:
            value = (episode.scores or {}).get(name)
            cells = [
                episode.environment, episode.place, episode.variant, episode.robot, episode.seed, episode.repeat,
                data.scores["task_details"]["name"], data.scores["method"]["name"],
                data.scores["method"]["version"], "missing" if episode.scores is None else "scored", name,
            ]  # fmt: skip
            tail = [episode.failure, episode.reason, episode.source, episode.settings]
            writer.writerow([*map(_cell, cells), "" if value is None else repr(value), *map(_cell, tail)])
    return out.getvalue()


def to_markdown(data: ReportData) -> str:
    """Return the summary and a table of all scores by environment, as GitHub shows them."""
    text, headline = markdown, data.headline
    task, method = data.scores["task_details"]["name"], data.scores["method"]
    measured = f"in {summary.environments_in_words(data)}, task {task}, method {method['name']} {method['version']}"
    lines = [
        f"# {text(summary.title(data))}",
        "",
        f"**{text(headline)} {_with_interval(data, headline)}** {text(measured)}. {text(_coverage(data))}",
        "",
        f"| environment | {' | '.join(map(text, _named(data)))} | episodes |",
        f"|---|{'---:|' * (len(data.score_names) + 1)}",
    ]
    for label, values, count in _rows(data):
        lines.append(f"| {' | '.join([text(label), *values, str(count)])} |")
    failures = summary.failures(data)
    if failures:
        lines += ["", "| failure | episodes | what happened |", "|---|---:|---|"]
    for name, episodes in failures.items():
        reasons = "; ".join(text(f"{episode.label}: {episode.reason or ''}".rstrip(": ")) for episode in episodes)
        lines.append(f"| {text(name)} | {len(episodes)} | {reasons} |")
    return "\n".join(lines) + "\n"


def to_latex(data: ReportData) -> str:
    """Return a table of all scores by environment, for the package booktabs."""
    text, names = latex, data.score_names
    body = [latex_row([text(label), *values, str(count)]) for label, values, count in _rows(data)]
    interval = summary.interval(data, data.headline)
    level = f" with its {text(interval.name)}" if interval else ""
    caption = (
        f"{text(summary.title(data))}: {text(data.headline)}{level}: "
        f"{text(_with_interval(data, data.headline))}, task {text(data.scores['task_details']['name'])}, "
        f"method {text(data.scores['method']['name'])} {text(data.scores['method']['version'])}. "
        f"{text(_coverage(data))}"
    )
    return "\n".join(
        [
            r"% \usepackage{booktabs}",
            r"\begin{table}",
            r"  \centering",
            rf"  \caption{{{caption}}}",
            rf"  \begin{{tabular}}{{l{'r' * (len(names) + 1)}}}",
            r"    \toprule",
            latex_row(["Environment", *map(text, _named(data)), "Episodes"]),
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


def to_junit(data: ReportData) -> str:
    """Return the episodes as test cases: those that failed fail, those that are no fault of the solution are errors.

    An episode that failed and was scored all the same fails, too; its scores are properties of the case.
    The form is that which Jenkins and GitLab read: https://github.com/testmoapp/junitxml
    """
    cases = [_test_case(episode, data) for episode in data.episodes]
    counts = {
        "tests": str(len(cases)),
        "failures": str(sum(case.find("failure") is not None for case in cases)),
        "errors": str(sum(case.find("error") is not None for case in cases)),
    }
    root = ET.Element("testsuites", {"name": _xml(summary.title(data)), **counts})
    name = _xml(data.scores["task_details"]["name"])
    suite = ET.SubElement(root, "testsuite", {"name": name, **counts})
    _properties(suite, {name: repr(float(value)) for name, value in data.scores["scores"].items()})
    suite.extend(cases)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _rows(data: ReportData) -> list[tuple[str, list[str], int]]:
    """Return label, scores and number of episodes of each environment, and of all together."""
    groups: list[tuple[str, Sequence[ReportedEpisode]]] = [*data.environments.items()]
    found = [(label, data.combined(episodes), len(episodes)) for label, episodes in groups]
    found.append(("all", data.scores["scores"], len(data.episodes)))
    return [(label, [_number(scores.get(name)) for name in data.score_names], count) for label, scores, count in found]


def _named(data: ReportData) -> list[str]:
    return [f"{name} {summary.arrow(data, name)}".rstrip() for name in data.score_names]


def _coverage(data: ReportData) -> str:
    coverage = data.scores["coverage"]
    missing = summary.missing_in_words(data)
    gaps = f"; {len(coverage['missing'])} missing, {missing}" if coverage["missing"] else ""
    return f"{coverage['scored']} of {coverage['expected']} results scored{gaps}.{summary.means_in_words(data)}"


def _with_interval(data: ReportData, name: str) -> str:
    found = summary.interval(data, name)
    value = f"{data.scores['scores'][name]:.3f}"
    return value if found is None else f"{value} [{found.low:.3f}, {found.high:.3f}]"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def latex_row(cells: Sequence[str]) -> str:
    """Return a row of a table of escaped cells."""
    return f"    {' & '.join(cells)} \\\\".replace("–", "--")


def _cell(value: object) -> str:
    """Return a cell as one line, and such that no spreadsheet runs it as a formula."""
    text = "" if value is None else one_line(str(value))
    return text if isinstance(value, int | float) else _FORMULA.sub(r"\1'", text)


def latex(text: str) -> str:
    """Return a text as one line that LaTeX prints as it is."""
    return "".join(_LATEX.get(letter, letter) for letter in one_line(text))


def _test_case(episode: ReportedEpisode, data: ReportData) -> ET.Element:
    place = _xml(f"{data.scores['task_details']['name']}.{episode.robot or 'robot'}")
    name = episode.label if episode.source is None or episode.document else f"{episode.label} ({episode.source})"
    case = ET.Element("testcase", {"classname": place, "name": _xml(name)})
    found = {name: repr(float(value)) for name, value in (episode.scores or {}).items()}
    times = {key: str(episode.provenance[key]) for key in summary.TIME_KEYS if episode.provenance.get(key) is not None}
    _properties(case, found | times)
    if episode.failure is not None or episode.scores is None:
        kind = "error" if episode.failure in _FAULT_OF_OTHERS else "failure"
        reason = _xml(episode.reason or "There is no result.")
        found_at = {"type": _xml(episode.failure or "missing"), "message": reason}
        ET.SubElement(case, kind, found_at).text = _xml(episode.source or "")
    return case


def _properties(parent: ET.Element, values: dict[str, str]) -> None:
    if values:
        properties = ET.SubElement(parent, "properties")
        for name, value in values.items():
            ET.SubElement(properties, "property", {"name": _xml(name), "value": _xml(value)})


def _xml(value: object) -> str:
    return visible(str(value))
