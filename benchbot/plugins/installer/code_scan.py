"""Decides whether a distribution contains code or declarations only, from its files, without running them.

Declarations only are: data files in packages of its own, empty `__init__.py`, and entry-point modules that consist of
hooks that yield paths beside them. Everything that Python could run is code, and so are the hooks of formats and
examples: their declarations name functions and commands.
"""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

from benchbot.plugins.installer.distributions import GROUP, INSTALLER_FILES, Distribution, without_parents

HARMLESS_HOOKS = frozenset(
    f"benchbot_{kind}" for kind in ("tasks", "robots", "environments", "ground_truths", "batches", "episodes")
)
_IMPORTS = {
    "__future__": {"annotations"},
    "benchbot": {"hookimpl"},
    "benchbot.plugin": {"hookimpl"},
    "benchbot.core.hookspecs": {"hookimpl"},
    "collections.abc": {"Iterable", "Iterator"},
    "importlib.resources": {"files"},
    "importlib.resources.abc": {"Traversable"},
    "pathlib": {"Path"},
    "typing": {"Iterable", "Iterator", "TYPE_CHECKING"},
}
_CONSTANTS = frozenset({"PLUGIN_API", "__author__", "__version__"})
_DATA = frozenset({
    ".yaml", ".yml", ".json", ".md", ".txt", ".rst", ".csv", ".png", ".jpg", ".jpeg", ".webp", ".svg", ".pgm", ".hdr",
    ".exr", ".glb", ".gltf", ".bin", ".obj", ".mtl", ".ply", ".stl", ".npy", ".typed", ".pyi",
})  # fmt: skip
_MAX_SHOWN = 5


def code_in(distribution: Distribution) -> list[str]:
    """Return a description of everything in a distribution that is or may be code; empty for declarations only."""
    found = [*_entry_points(distribution), *_files(distribution)]
    more = [f"and {len(found) - _MAX_SHOWN} more"] if len(found) > _MAX_SHOWN else []
    return [*found[:_MAX_SHOWN], *more]


def _entry_points(distribution: Distribution) -> Iterator[str]:
    for point in distribution.metadata.entry_points:
        if point.group == "console_scripts":
            yield f"the command {point.name}"
        elif point.group != GROUP:
            yield f"an entry point in {point.group}"
        elif ":" in point.value or not _sources(point.module) & set(distribution.files):
            yield f"the entry point {point.value}"


def _files(distribution: Distribution) -> Iterator[str]:
    packages = distribution.packages
    plugin_sources = {path for module in distribution.plugin_modules for path in _sources(module)}
    for path in sorted(distribution.files):
        parts = path.split("/")
        source = distribution.info.parent / path
        if parts[0] == distribution.info.name:
            continue  # metadata, which nothing imports
        elif path in plugin_sources:
            if not _consists_of(_is_harmless, source):
                yield path
        elif parts[-1] == "__init__.py" and parts[0] in packages:
            if not _consists_of(_is_constant, source):
                yield path
        elif without_parents(path).removeprefix("bin/") in distribution.scripts:
            continue  # _entry_points names it
        elif parts[0] not in packages or source.suffix not in _DATA or parts[-1] in INSTALLER_FILES:
            yield path


def _sources(module: str) -> set[str]:
    return {f"{module.replace('.', '/')}{end}" for end in (".py", "/__init__.py")}


def _consists_of(is_allowed: Callable[[ast.stmt], bool], source: Path) -> bool:
    try:
        return all(map(is_allowed, ast.parse(source.read_bytes()).body))
    except (OSError, ValueError, SyntaxError, RecursionError):
        return False


def _is_harmless(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.ImportFrom):
        allowed = _IMPORTS.get(statement.module or "", set())
        plain = all(alias.name in allowed and alias.asname in (None, alias.name) for alias in statement.names)
        return statement.level == 0 and plain
    if isinstance(statement, ast.If):
        return (
            _is_name(statement.test, "TYPE_CHECKING")
            and not statement.orelse
            and all(map(_is_harmless, statement.body))
        )
    if isinstance(statement, ast.FunctionDef):
        return _is_hook(statement)
    return _is_constant(statement)


def _is_hook(function: ast.FunctionDef) -> bool:
    arguments = function.args
    return (
        function.name in HARMLESS_HOOKS
        and len(function.decorator_list) == 1
        and _is_name(function.decorator_list[0], "hookimpl")
        and not (arguments.args or arguments.posonlyargs or arguments.kwonlyargs or arguments.vararg or arguments.kwarg)
        and (function.returns is None or all(isinstance(node, _ANNOTATION) for node in ast.walk(function.returns)))
        and all(map(_yields_paths, function.body))
    )


_ANNOTATION = (ast.Name, ast.Subscript, ast.Constant, ast.BinOp, ast.BitOr, ast.Load, ast.Tuple)


def _yields_paths(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.Return):
        return isinstance(statement.value, ast.List | ast.Tuple) and all(map(_is_path, statement.value.elts))
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Yield):
        return statement.value.value is not None and _is_path(statement.value.value)
    return _is_docstring(statement)


def _is_path(node: ast.expr) -> bool:
    """Say whether an expression is `Path(__file__)[.parent] / "…"` or `files(__name__ or "…") / "…"`."""
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Div) and _stays_inside(node.right) and _is_path(node.left)
    if isinstance(node, ast.Attribute):
        return node.attr == "parent" and isinstance(node.value, ast.Call) and _is_path(node.value)
    if not isinstance(node, ast.Call) or len(node.args) != 1 or node.keywords:
        return False
    argument = node.args[0]
    if _is_name(node.func, "Path"):
        return _is_name(argument, "__file__")
    # `files("x")` imports x; only the package itself is known to be harmless.
    return _is_name(node.func, "files") and (_is_name(argument, "__name__") or _is_name(argument, "__package__"))


def _stays_inside(node: ast.expr) -> bool:
    if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
        return False
    return ".." not in node.value and not node.value.startswith("/")


def _is_constant(statement: ast.stmt) -> bool:
    """Say whether a statement is a docstring, or assigns a literal to one of `_CONSTANTS`."""
    if isinstance(statement, ast.Assign):
        names = all(isinstance(one, ast.Name) and one.id in _CONSTANTS for one in statement.targets)
        return names and isinstance(statement.value, ast.Constant)
    return _is_docstring(statement)


def _is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _is_name(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name
