"""What a mapper imports, from docstrings."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

from benchbot import mapping
from docs.tools.reference.tables import GENERATED, code, paragraph, table

_INTRODUCTION = """\
# The parts of mappers

`from benchbot.mapping import point_cloud, fuse, create_object, …`. How they are used together, and in which frames and
units, is in [the object map](../mapping.md). `Floats` is a float32 array of NumPy, `Doubles` a float64 one,
`Mask` one of booleans; an `ArrayLike` may be a list as well. Mistakes are `benchbot.api.BenchbotError`, which
says what to do.

"""
_MODULES = (
    "formats.object_map",
    *(f"mapping.{name}" for name in ("projection", "objects", "boxes", "voxels", "planes", "drawing")),
    *(f"mapping.{name}" for name in ("occupancy", "viewpoints", "paths", "roaming", "changes")),
)


def page() -> str:
    """Return the page of `benchbot.mapping`, by the modules that its names come from."""
    modules = [import_module(f"benchbot.plugins.{name}") for name in _MODULES]
    return GENERATED + _INTRODUCTION + "\n".join(map(_section, modules))


def _section(module: ModuleType) -> str:
    text = f"## {module.__name__.rpartition('.')[2]}\n\n{paragraph(module.__doc__ or '')}\n"
    ours = [getattr(mapping, name) for name in mapping.__all__]
    ours = [one for one in ours if getattr(one, "__module__", "") == module.__name__]
    rows = [_row(one) for one in ours if inspect.isfunction(one)]
    text += "\n" + table(["function", "meaning"], rows) if rows else ""
    return text + "".join(map(_class, filter(inspect.isclass, ours)))


def _class(cls: type) -> str:
    text = f"\n### {cls.__name__}\n\n{paragraph(inspect.getdoc(cls) or '')}\n"
    rows = [*_made(cls), *map(_row, _methods(cls))]
    return text + ("\n" + table(["member", "meaning"], rows) if rows else "")


def _made(cls: type) -> Iterator[list[str]]:
    """Yield how an object of a class is made."""
    body = _parsed(cls).body
    fields = [ast.unparse(node) for node in body if isinstance(node, ast.AnnAssign)]
    for node in body:
        if isinstance(node, ast.FunctionDef) and node.name == "__init__":
            fields = [ast.unparse(node.args).removeprefix("self").removeprefix(", ")]
    yield [code(f"{cls.__name__}({', '.join(fields)})"), "How one is made."]


def _methods(cls: type) -> Iterator[Callable[..., Any]]:
    for name, member in vars(cls).items():
        function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        if inspect.isfunction(function) and function.__module__ == cls.__module__ and not name.startswith("_"):
            yield function


def _row(function: Callable[..., Any]) -> list[str]:
    """Return a function as its author wrote it, and its docstring."""
    node = _parsed(function)
    assert isinstance(node, ast.FunctionDef)  # noqa: S101 - by what is called
    node.args.args = [one for one in node.args.args if one.arg not in ("self", "cls")]
    names = [ast.unparse(one) for one in node.decorator_list]
    name = function.__qualname__ if "classmethod" in names else node.name
    arrow = f" → {ast.unparse(node.returns)}" if node.returns and ast.unparse(node.returns) != "None" else ""
    written = name + arrow if "property" in names else f"{name}({ast.unparse(node.args)}){arrow}"
    return [code(written.replace("'", "")), paragraph(inspect.getdoc(function) or "")]


def _parsed(thing: Any) -> Any:
    return ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]
