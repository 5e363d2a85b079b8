"""The table of docs/attacks.md, kept in step with what the attacks come to.

With BENCHBOT_WRITE_TABLES=1 in the environment the tests write what they find; otherwise they compare.
"""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[3] / "docs" / "attacks.md"
MODES = (
    "native",
    "sandbox",
    "sandbox, by an ordinary user",
    "container",
    "container, by an ordinary user",
)
GOT, NOTHING, NOT_TRIED, REFUSED = "**gets it**", "nothing", "not tried", "refused beforehand"


def check(mode: str, attempts: dict[str, dict[str, Any]], refused: Collection[str] = ()) -> None:
    """Compare a column of the table with what was tried in a mode, and what it came to; or write it.

    `refused` are attempts at limits that are refused there, unless weak ones are allowed.
    """
    found = {name: NOTHING if attempt["got"] is None else GOT for name, attempt in attempts.items()}
    found |= dict.fromkeys(refused, REFUSED)
    rows = read()
    if os.environ.get("BENCHBOT_WRITE_TABLES"):
        for name, outcome in found.items():
            rows.setdefault(name, {})[mode] = outcome
        write(rows)
    told = {name: row[mode] for name, row in read().items() if row[mode] != NOT_TRIED}
    assert told == found, "docs/attacks.md says otherwise; BENCHBOT_WRITE_TABLES=1 writes it anew"


def read() -> dict[str, dict[str, str]]:
    """Return the rows of the table: the outcome of each attack, by mode."""
    rows = {}
    for line in PAGE.read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and len(cells) == 1 + len(MODES) and cells[0] != "attack":
            rows[cells[0]] = dict(zip(MODES, cells[1:], strict=True))
    return rows


def write(rows: dict[str, dict[str, str]]) -> None:
    """Write the rows where the table is."""
    lines = PAGE.read_text("utf-8").splitlines()
    before = lines[: next(number for number, line in enumerate(lines) if line.startswith("|---")) + 1]
    after = lines[len(before) :]
    while after and after[0].startswith("|"):
        after.pop(0)
    table = [f"| {name} | {' | '.join(row.get(mode, NOT_TRIED) for mode in MODES)} |" for name, row in rows.items()]
    PAGE.write_text("\n".join([*before, *table, *after]) + "\n", "utf-8")
