"""Scores as text: a headline, a table, and the coverage."""

from collections import Counter
from typing import Any

from benchbot.core import overrides
from benchbot.evaluation.coverage import means_in_words
from benchbot.evaluation.result_document import listed

_MOST_CLASSES, _MOST_COLUMNS, _CLASS_WIDTH, _LEAST_WRONG = 8, 5, 10, 0.05


def headline(document: dict[str, Any]) -> str:
    """Return the one score that stands for the document, such as `OMQ 0.7312`; `OMQ -` where there is none.

    One that leaves results out says so: `ATE_RMSE_m 0.0312 (mean of 3 of 5)`.
    """
    name = document["method"]["headline"]
    means = [f" ({text.rpartition(': ')[2]})" for text in means_in_words(document["coverage"], [name])]
    return f"{name} {_numbers(document['scores'], [name])[0]}{''.join(means)}"


def table(document: dict[str, Any]) -> list[str]:
    """Return lines: one per result and a summary, the headline score first, its interval, and what is missing."""
    first = document["method"]["headline"]
    names = [first, *(name for name in document["scores"] if name != first)]
    lines = [["", *names]]
    rows = zip(_labels(document["rows"]), document["rows"], strict=True)
    lines += [[label, *_numbers(row["scores"], names)] for label, row in rows]
    if len(document["rows"]) != 1 or document["coverage"]["missing"]:
        lines.append(["all", *_numbers(document["scores"], names)])
    widths = [max(len(line[column]) for line in lines) for column in range(len(names) + 1)]
    texts = []
    for label, *cells in lines:
        aligned = (cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))
        texts.append("  ".join([label.ljust(widths[0]), *aligned]))
    means = means_in_words(document["coverage"], names)
    return [*texts, *means, *_interval(document), *_gaps(document["coverage"])]


def coverage(counts: dict[str, Any], word: str) -> list[str]:
    """Return lines that say how many results are `word` (scored, valid), what is missing, and what was left out."""
    lines = [f"{counts['scored']} of {counts['expected']} {word}"]
    if counts.get("failures"):
        classes = ", ".join(f"{count} {name}" for name, count in counts["failures"].items())
        lines.append(f"  failed episodes: {classes}")
    lines += [f"  warning: {warning}" for warning in counts.get("warnings", ())]
    for item in counts["missing"]:
        what = " ".join(filter(None, [_label(item), item["source"] and f"({item['source']})"]))
        lines.append(f"  missing: {what}: {item['reason']}")
    alike: dict[str, list[str]] = {}
    for item in counts["skipped"]:
        alike.setdefault(item["reason"], []).append(item["source"])
    lines += [f"  left out: {listed(sources)}: {reason}" for reason, sources in alike.items()]
    own = counts.get("own_files", 0)
    return lines + ([f"  {own} file{'s' * (own != 1)} of BenchBot's own left aside"] if own else [])


def diagnosis(explanation: dict[str, Any], headline: str) -> list[str]:
    """Return lines for each diagnosed result: what went wrong, and what the headline score would gain without it."""
    entries = explanation["results"]
    lines = []
    for label, entry in zip(_labels(entries), entries, strict=True):
        told = entry.get("diagnosis", {})
        errors, hints = told.get("errors", []), told.get("hints", [])
        if errors or hints:
            lines.append(f"What went wrong in {label}, and the {headline} that it costs:")
        lines += [f"  {error['kind']:<10} {error['count']:>5}  {error['gain']:+.2f}" for error in errors]
        lines += [f"  hint: {hint}" for hint in hints]
        for title, key in (("Classes", "confusion"), ("States", "states")):
            lines += _matrix(f"{title} of {label}: true ones down, what estimates give them across", told.get(key, []))
        for group in told.get("breakdown", []):
            lines.append(f"Quality in {label} by {group['by'].replace('_', ' ')} (found of all):")
            for row in group["groups"]:
                lines.append(f"  {row['label']:<26} {row['quality']:.2f}  {row['found']:>5}/{row['objects']}")
        if ending := told.get("ending"):
            x, y = ending["place"]
            lines.append(f"{label} ended at ({x:.2f}, {y:.2f}): {ending['kind'].replace('_', ' ')}. {ending['why']}")
        if drift := told.get("drift"):
            lines.append(f"Drift in {label}, over stretches of the true way:")
            for row in drift:
                off = f"{row['error_m']:8.4f} m  {row['error_deg']:7.2f} deg"
                lines.append(f"  {row['length_m']:>5g} m  {off}  {row['stretches']:>6} x")
    return lines


def _matrix(title: str, confusion: list[dict[str, Any]]) -> list[str]:
    """Return a confusion of classes as a table: those with most probability beside the diagonal, the worst first."""

    def wrong(row: dict[str, Any]) -> float:
        return float(row["objects"] - row["estimated"].get(row["truth"], 0.0))

    rows = sorted((row for row in confusion if wrong(row) >= _LEAST_WRONG), key=wrong, reverse=True)[:_MOST_CLASSES]
    if not rows:
        return []
    shares: dict[str, float] = {}
    for row in rows:
        for name, value in row["estimated"].items():
            shares[name] = shares.get(name, 0.0) + value
    columns = sorted(shares, key=lambda name: -shares[name])[:_MOST_COLUMNS]
    short = {name: name if len(name) <= _CLASS_WIDTH else f"{name[: _CLASS_WIDTH - 1]}…" for name in columns}
    lines = [["", *(short[name] for name in columns), "other", "missed"]]
    for row in rows:
        other = sum(value for name, value in row["estimated"].items() if name not in columns)
        values = [row["estimated"].get(name, 0.0) for name in columns]
        cells = [f"{value:.1f}" if value >= _LEAST_WRONG else "." for value in [*values, other]]
        lines.append([row["truth"] or "nothing", *cells, str(row["missed"] or ".")])
    widths = [max(len(line[column]) for line in lines) for column in range(len(columns) + 3)]
    texts = [
        "  ".join([line[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    ]
    return [f"{title}:", *(f"  {text}" for text in texts)]


def _labels(rows: list[dict[str, Any]]) -> list[str]:
    """Return the environment of each row, with what tells those of one environment apart."""
    counts = Counter(row["environment"] for row in rows)
    return [_label(row) if counts[row["environment"]] > 1 else row["environment"] for row in rows]


def _label(row: dict[str, Any]) -> str:
    said = [f"{key} {row[key]}" for key in ("seed", "episode", "repeat") if row.get(key) is not None]
    settings = overrides.label(row.get("settings") or {})
    return " ".join(filter(None, [row["environment"], *said, settings]))


def _numbers(scores: dict[str, float], names: list[str]) -> list[str]:
    return [f"{scores[name]:.4f}" if name in scores else "-" for name in names]


def _interval(document: dict[str, Any]) -> list[str]:
    """Return a line such as `OMQ 0.62 [0.51, 0.71]`, how sure that is, or why it is not known."""
    name = document["method"]["headline"]
    interval = document.get("intervals", {}).get(name)
    statistics = document.get("statistics", {})
    if interval is None:
        return [statistics["note"]] if statistics.get("note") and len(document["rows"]) > 1 else []
    numbers = f"{name} {document['scores'][name]:.2f} [{interval['low']:.2f}, {interval['high']:.2f}]"
    return [f"{numbers} ({interval['level'] * 100:g} % interval, {statistics['method']}: {statistics['clusters']})"]


def _gaps(counts: dict[str, Any]) -> list[str]:
    how = "are left out" if counts.get("missing_counts") == "leave-out" else "count as zero"
    said = [counts[key] for key in ("missing", "skipped", "failures", "warnings", "own_files") if counts.get(key)]
    return coverage(counts, f"scored; the missing {how}" if counts["missing"] else "scored") if said else []
