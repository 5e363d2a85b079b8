"""The rooms of `benchbot/plugins`: one imports of another only the modules that its `__init__` names."""

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import benchbot.plugins

ROOMS = Path(next(iter(benchbot.plugins.__path__)))
PREFIX = "benchbot.plugins."


def test_a_room_imports_of_another_only_what_that_names() -> None:
    imports = {(module, source) for source in ROOMS.rglob("*.py") for module in imported_modules(source)}
    private = [
        f"{source.relative_to(ROOMS)} imports {module}"
        for module, source in sorted(imports)
        if room_of(module) != source.relative_to(ROOMS).parts[0] and not is_public(module)
    ]
    assert private == []


@pytest.mark.parametrize("room", sorted(path.parent.name for path in ROOMS.glob("*/__init__.py")))
def test_what_a_room_names_exists(room: str) -> None:
    missing = [name for name in named_by(room) if find_spec(f"{PREFIX}{room}.{name}") is None]
    assert missing == []


def imported_modules(source: Path) -> Iterator[str]:
    """Yield the modules in rooms that a file imports anywhere, also within a function."""
    for node in ast.walk(ast.parse(source.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith(PREFIX))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PREFIX):
            module = node.module or ""
            of_a_package = module.count(".") == PREFIX.count(".")
            yield from (f"{module}.{alias.name}" for alias in node.names) if of_a_package else [module]


def room_of(module: str) -> str:
    return module.removeprefix(PREFIX).partition(".")[0]


def is_public(module: str) -> bool:
    room, _, inside = module.removeprefix(PREFIX).partition(".")
    return inside.partition(".")[0] in named_by(room)


def named_by(room: str) -> list[str]:
    """Return what `__all__` of a room's `__init__` lists; nothing when it has none."""
    for node in ast.parse((ROOMS / room / "__init__.py").read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names: list[str] = ast.literal_eval(node.value)
            return names
    return []
