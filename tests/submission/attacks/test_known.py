"""The table of docs/attacks.md that says what a solution can know: each of its lines names tests that exist."""

import ast
import re

from tests.submission.attacks.table import PAGE

ROOT = PAGE.parents[1]
NAMED = re.compile(r"`([a-z_/]+\.py)::(\w+)`")


def rows() -> list[list[str]]:
    """Return the cells of the table's lines, without its head."""
    section = PAGE.read_text("utf-8").partition("## What a solution can know")[2].partition("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def found_in(path: str) -> set[str]:
    tree = ast.parse((ROOT / path).read_text("utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}


def test_each_line_is_held_by_a_test() -> None:
    assert len(rows()) > 15
    for channel, tells, _, held_by in rows():
        assert tells, channel
        assert NAMED.search(held_by), f"no test holds the line of {channel}"


def test_each_test_that_is_named_exists() -> None:
    for *_, held_by in rows():
        for path, name in NAMED.findall(held_by):
            assert name in found_in(path), f"{path} has no {name}"
