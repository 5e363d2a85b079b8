"""Scores as people read them."""

from typing import Any


def headline(document: dict[str, Any]) -> str:
    """Return the one score that stands for the document, such as `OMQ 0.7312`."""
    name = document["method"]["headline"]
    return f"{name} {document['scores'][name]:.4f}"


def table(document: dict[str, Any]) -> str:
    """Return a line per environment and a summary, the headline score first, and what is missing."""
    names = _ordered(document)
    lines = [["", *names]]
    lines += [[row["environment"], *_numbers(row["scores"], names)] for row in document["rows"]]
    if len(document["rows"]) != 1 or document["coverage"]["missing"]:
        lines.append(["all", *_numbers(document["scores"], names)])
    widths = [max(len(line[column]) for line in lines) for column in range(len(names) + 1)]
    texts = []
    for label, *cells in lines:
        aligned = (cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True))
        texts.append("  ".join([label.ljust(widths[0]), *aligned]))
    return "\n".join([*texts, *_gaps(document["coverage"])])


def coverage(counts: dict[str, Any], word: str) -> list[str]:
    """Return lines that say how many results are `word` (scored, valid), what is missing, and what was left out."""
    lines = [f"{counts['scored']} of {counts['expected']} {word}"]
    for item in counts["missing"]:
        what = " ".join(filter(None, [item["environment"], item["source"] and f"({item['source']})"]))
        lines.append(f"  missing: {what}: {item['reason']}")
    return lines + [f"  left out: {item['source']}: {item['reason']}" for item in counts["skipped"]]


def _ordered(document: dict[str, Any]) -> list[str]:
    first = document["method"]["headline"]
    return [first, *(name for name in document["scores"] if name != first)]


def _numbers(scores: dict[str, float], names: list[str]) -> list[str]:
    return [f"{scores[name]:.4f}" if name in scores else "-" for name in names]


def _gaps(counts: dict[str, Any]) -> list[str]:
    return coverage(counts, "scored; the missing count as zero") if counts["missing"] or counts["skipped"] else []
