"""Whether a distribution brings declarations only, or code: decided by looking at its files, which are not run.

Declarations only is: files of data in packages of its own, empty `__init__.py`, and entry-point modules that are
nothing but hooks that yield paths beside them. Everything that Python could run is code, and so are the hooks of
formats and examples: their declarations name functions and commands.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from benchbot.plugins.installer.distributions import GROUP, NOTES, Distribution, placed

HARMLESS_HOOKS = frozenset(
    f"benchbot_{kind}" for kind in ("tasks", "robots", "environments", "ground_truths", "batches", "episodes")
)
_IMPORTS = {
    "__future__": {"annotations"},
    "benchbot": {"hookimpl"},
    "benchbot.core.hookspecs": {"hookimpl"},
    "collections.abc": {"Iterable", "Iterator"},
    "importlib.resources": {"files"},
    "importlib.resources.abc": {"Traversable"},
    "pathlib": {"Path"},
    "typing": {"Iterable", "Iterator", "TYPE_CHECKING"},
}
_DATA = frozenset({
    ".yaml", ".yml", ".json", ".md", ".txt", ".rst", ".csv", ".png", ".jpg", ".jpeg", ".webp", ".svg", ".pgm", ".hdr",
    ".exr", ".glb", ".gltf", ".bin", ".obj", ".mtl", ".ply", ".stl", ".npy", ".typed", ".pyi",
})  # fmt: skip
_MANY = 5


def code_in(distribution: Distribution) -> list[str]:
    """Return what in a distribution is code or may be, in words; nothing when it brings declarations only."""
    found = [*_entry_points(distribution), *_files(distribution)]
    return [*found[:_MANY], f"and {len(found) - _MANY} more"] if len(found) > _MANY else found


def _entry_points(distribution: Distribution) -> Iterator[str]:
    for point in distribution.metadata.entry_points:
        if point.group == "console_scripts":
            yield f"the command {point.name}"
        elif point.group != GROUP:
            yield f"an entry point in {point.group}"
        elif ":" in point.value or not _entrances(point.module) & set(distribution.files):
            yield f"the entry point {point.value}"


def _files(distribution: Distribution) -> Iterator[str]:
    modules = {point.module for point in distribution.metadata.entry_points if point.group == GROUP}
    packages = distribution.packages
    entrances = {path for module in modules for path in _entrances(module)}
    for path in sorted(distribution.files):
        parts = path.split("/")
        suffix = Path(path).suffix
        if parts[0] == distribution.info.name:
            continue  # metadata, which nothing imports
        elif path in entrances:
            if not _only_yields_paths(distribution.info.parent / path):
                yield path
        elif parts[-1] == "__init__.py" and parts[0] in packages:
            if not _is_empty(distribution.info.parent / path):
                yield path
        elif placed(path).removeprefix("bin/") in distribution.scripts:
            continue  # its entry point has been told
        elif parts[0] not in packages or suffix not in _DATA or parts[-1] in NOTES:
            yield path


def _entrances(module: str) -> set[str]:
    return {f"{module.replace('.', '/')}{end}" for end in (".py", "/__init__.py")}


def _is_empty(path: Path) -> bool:
    tree = _parsed(path)
    return tree is not None and all(map(_is_constant, tree.body))


def _only_yields_paths(path: Path) -> bool:
    tree = _parsed(path)
    return tree is not None and all(map(_is_harmless, tree.body))


def _parsed(path: Path) -> ast.Module | None:
    try:
        return ast.parse(path.read_bytes())
    except (OSError, ValueError, SyntaxError, RecursionError):
        return None


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
        and all(map(_gives_paths, function.body))
    )


_ANNOTATION = (ast.Name, ast.Subscript, ast.Constant, ast.BinOp, ast.BitOr, ast.Load, ast.Tuple)


def _gives_paths(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.Return):
        return isinstance(statement.value, ast.List | ast.Tuple) and all(map(_is_path, statement.value.elts))
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Yield):
        return statement.value.value is not None and _is_path(statement.value.value)
    return _is_text(statement)


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
    # `files("x")` imports x: only its own package is known to be harmless.
    return _is_name(node.func, "files") and (_is_name(argument, "__name__") or _is_name(argument, "__package__"))


def _stays_inside(node: ast.expr) -> bool:
    if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
        return False
    return ".." not in node.value and not node.value.startswith("/")


def _is_constant(statement: ast.stmt) -> bool:
    """Say whether a statement is a text by itself, or gives dunder names such as `__version__` a constant."""
    if isinstance(statement, ast.Assign):
        names = all(isinstance(to, ast.Name) and to.id in ("__version__", "__author__") for to in statement.targets)
        return names and isinstance(statement.value, ast.Constant)
    return _is_text(statement)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _is_name(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name
