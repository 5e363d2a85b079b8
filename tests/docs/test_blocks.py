"""Every block of code in the documentation is run, compiled or read by a test, or says why it is not."""

import ast
import importlib
import importlib.util
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.docs.blocks import ROOT, Block, blocks, pages

SHELLS = {"bash", "console"}
DATA: dict[str, Callable[[str], object]] = {"json": json.loads, "toml": tomllib.loads, "yaml": yaml.safe_load}
# Runs whatever page has its mark.
TUTORIALS = "tests/docs/test_tutorials.py"
BLOCKS = [(page, block) for page in pages() for block in blocks(page.read_text("utf-8"))]


def name(value: Any) -> str:
    return str(value.relative_to(ROOT)) if isinstance(value, Path) else f"line {value.line}"


@pytest.mark.parametrize("page", pages(), ids=name)
def test_every_block_says_what_it_is(page: Path) -> None:
    languages = {block.language for block in blocks(page.read_text("utf-8"))}
    assert languages <= {*SHELLS, *DATA, "python", "text"}


@pytest.mark.parametrize(("page", "block"), [pair for pair in BLOCKS if pair[1].language in SHELLS], ids=name)
def test_commands_are_run_or_say_why_not(page: Path, block: Block) -> None:
    if block.run_by:
        runner = (ROOT / block.run_by).read_text("utf-8")
        assert block.run_by == TUTORIALS or page.name in runner, f"{block.run_by} does not read {page.name}"
    else:
        assert block.excuse, "write <!-- run by tests/… --> or <!-- not run: why --> above it"
        named = re.findall(r"\b(?:plugins|tests)/[\w/]+(?:\.py)?", block.excuse)
        assert [path for path in named if not (ROOT / path).exists()] == [], "it names a test that there is not"


@pytest.mark.parametrize(("page", "block"), [pair for pair in BLOCKS if pair[1].language == "python"], ids=name)
def test_python_compiles_and_finds_what_it_imports(page: Path, block: Block) -> None:
    if block.excuse:
        return
    # A function's inside may stand alone on a page.
    tree = ast.parse(block.text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for item in node.names:
                assert is_there(item.name), f"{page}: import {item.name}"
        elif isinstance(node, ast.ImportFrom):
            assert node.module
            for item in node.names:
                assert is_there(node.module, item.name), f"{page}: from {node.module} import {item.name}"


def is_there(module: str, attribute: str = "") -> bool:
    """Say whether a module can be imported and has this name; those called acme are the reader's own."""
    if module.split("_", maxsplit=1)[0] == "acme":
        return True
    return not attribute or hasattr(importlib.import_module(module), attribute) or is_module(f"{module}.{attribute}")


def is_module(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


@pytest.mark.parametrize(("page", "block"), [pair for pair in BLOCKS if pair[1].language in DATA], ids=name)
def test_data_can_be_read(page: Path, block: Block) -> None:
    if not block.excuse:
        DATA[block.language](block.text)


def test_a_mark_belongs_to_the_block_below_it() -> None:
    page = """<!-- not run: needs a robot -->
```bash
benchbot ready
```

  ```python title="a.py"
  import x
  ```
"""
    first, second = blocks(page)

    assert (first.language, first.excuse, first.line) == ("bash", "needs a robot", 2)
    assert (second.language, second.text, second.excuse, second.run_by) == ("python", "import x\n", "", "")
