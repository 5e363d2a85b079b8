"""What a file of a solution says that it needs: the modules that it imports, and the files that it names."""

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_PLACEHOLDER = re.compile(r"\{[^{}]*\}|%[-+ #0-9.]*[sdifr]")
_WORD = re.compile(rb"[\w./*+@~-]*[./][\w./*+@~-]*")
_RUN_MODULE = re.compile(rb"(?:^|\s)-m\s+([A-Za-z_]\w*(?:\.\w+)*)", re.ASCII)
_IMPORTERS = frozenset({"import_module", "__import__", "iter_modules", "walk_packages", "spec_from_file_location"})
"""Functions that import what is named at run time."""
_JOINERS = frozenset({"join", "joinpath", "Path", "PurePath"})
_WRITERS = ("write", "save", "imwrite", "imsave", "dump", "mkdir", "makedirs", "touch", "to_csv", "to_json", "unlink")
"""How the names of functions begin that make what they name, or remove it."""
_LONGEST = 300


@dataclass(frozen=True)
class Import:
    """An import: `level` dots, the module after them, and the names that are taken from it."""

    level: int
    module: str
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mentions:
    """The imports of a file; its texts that may be paths, with `*` for what is only known at run time."""

    imports: tuple[Import, ...] = ()
    texts: tuple[str, ...] = ()
    is_dynamic: bool = False
    """Whether it imports modules that it does not name."""


def of_python(source: bytes | str) -> Mentions:
    """Return the mentions of Python code; of what cannot be parsed, all is possible."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError):
        raw = source.encode() if isinstance(source, str) else source
        return Mentions(texts=of_text(raw).texts, is_dynamic=True)
    imports = dict.fromkeys(_imports(tree))
    texts = dict.fromkeys(text for text in _texts(tree) if 0 < len(text) < _LONGEST and "\n" not in text)
    return Mentions(tuple(imports), tuple(texts), any(_is_dynamic(node) for node in ast.walk(tree)))


def of_text(content: bytes) -> Mentions:
    """Return the mentions of any other file, a program too: its words with a dot or a slash in them, `-m MODULE`."""
    words = dict.fromkeys(word.decode("utf-8", "replace") for word in _WORD.findall(content) if len(word) < _LONGEST)
    modules = dict.fromkeys(word.decode() for word in _RUN_MODULE.findall(content))
    imports = [Import(0, name) for module in modules for name in (module, f"{module}.__main__")]
    return Mentions(tuple(imports), tuple(words))


def _imports(tree: ast.AST) -> Iterator[Import]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (Import(0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield Import(node.level, node.module or "", tuple(alias.name for alias in node.names))


def _texts(tree: ast.AST) -> Iterator[str]:
    """Yield the texts of a tree: paths that are joined as one, without docstrings, keys, and what is written to."""
    left: list[ast.AST] = [tree]
    while left:
        node = left.pop()
        if isinstance(node, ast.Call) and _writes(node):
            target = [node.func.value] if isinstance(node.func, ast.Attribute) else []
            left += [part for part in (*target, *node.args) if _joined(part) is None]
            continue
        joined = _joined(node)
        if joined is not None:
            yield joined.removeprefix("*/") if isinstance(node, ast.BinOp | ast.Call) else joined
            left += [part for part in _parts(node) if _joined(part) is None]
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            left.append(node.value)
        elif isinstance(node, ast.Dict):
            left += node.values
        else:
            left += ast.iter_child_nodes(node)


def _writes(call: ast.Call) -> bool:
    """Say whether a call writes to the files that it names: by its mode, or by its name."""
    name = _name(call.func)
    if name == "open":
        place = 0 if isinstance(call.func, ast.Attribute) else 1
        modes = [*call.args[place : place + 1], *(word.value for word in call.keywords if word.arg == "mode")]
        texts = [mode.value for mode in modes if isinstance(mode, ast.Constant) and isinstance(mode.value, str)]
        return any(re.fullmatch(r"[wax][bt+]*", text) for text in texts)
    return name.startswith(_WRITERS)


def _joined(node: ast.AST) -> str | None:
    """Return the path that an expression makes of texts, `*` for each part that is not one; None without a text."""
    if isinstance(node, ast.Constant):
        return _PLACEHOLDER.sub("*", node.value) if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(_joined(part) or "*" for part in node.values)
    parts = _parts(node)
    texts = [_joined(part) for part in parts]
    if not parts or all(text is None for text in texts):
        return None
    added = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add)
    return ("" if added else "/").join(text if text is not None else "*" for text in texts)


def _parts(node: ast.AST) -> Sequence[ast.expr]:
    """Return the parts of an expression that joins texts: `a + b`, `a / b`, `os.path.join(a, b)`, `Path(a, b)`."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div | ast.Add):
        return [node.left, node.right]
    if isinstance(node, ast.Call) and _name(node.func) in _JOINERS:
        # `" ".join(words)` joins no path, and `folder.joinpath(name)` begins with its object.
        text = isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Constant)
        first = [node.func.value] if isinstance(node.func, ast.Attribute) and node.func.attr == "joinpath" else []
        return [] if text else [*first, *node.args]
    return []


def _is_dynamic(node: ast.AST) -> bool:
    """Say whether a call imports a module that is not named by a text, or by the beginning of one."""
    if not isinstance(node, ast.Call) or _name(node.func) not in _IMPORTERS:
        return False
    place = 1 if _name(node.func) == "spec_from_file_location" else 0
    text = _joined(node.args[place]) if len(node.args) > place else None
    return text is None or text.startswith(("*", "."))


def _name(function: ast.expr) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
