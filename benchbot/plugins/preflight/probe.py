"""A probe of code, whether it can be imported and compiled without running it, as JSON: `probe.py script|module NAME`.

It is run by the interpreter of a solution, of whatever Python from 3.7 on, and so imports nothing but its library.
`problem` says why the code cannot run; `missing` are modules that it imports before it does anything else, and that are
not there. What comes after another module of its own is not looked at: that one may change where modules are found.
"""

from __future__ import annotations

import ast
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import is_zipfile

if TYPE_CHECKING:
    from collections.abc import Iterator


def _find(name: str, path: Any = None) -> Any:
    for finder in sys.meta_path:
        find_spec = getattr(finder, "find_spec", None)
        found = find_spec(name, path) if find_spec else None
        if found is not None:
            return found
    return None


def _module(name: str) -> tuple[str | None, str | None]:
    """Return the file of a module that `python -m` runs (None: not one to read), and why there is none."""
    path = None
    parts = name.split(".")
    for count in range(1, len(parts) + 1):
        found = _find(".".join(parts[:count]), path)
        if found is None:
            return None, "There is no module " + ".".join(parts[:count])
        path = found.submodule_search_locations
    if path is not None:
        found = _find(name + ".__main__", path)
        if found is None:
            return None, name + " is a package without a module __main__"
    return (found.origin if str(found.origin).endswith(".py") else None), None


def _first_imports(tree: ast.Module) -> Iterator[str]:
    for node in tree.body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name.split(".")[0]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield str(node.module).split(".")[0]
        elif not (isinstance(node, ast.Expr) and type(node.value).__name__ in ("Constant", "Str")):
            return


def _look(kind: str, name: str) -> dict[str, Any]:
    """Return what is to be told."""
    path: str | None = name
    sys.path[0] = str(Path(name).resolve().parent if kind == "script" else Path.cwd())
    if kind == "module":
        path, problem = _module(name)
        if problem:
            return {"problem": problem}
    if path is None or Path(path).is_dir() or is_zipfile(path):
        return {}
    try:
        tree = ast.parse(Path(path).read_bytes(), path)
    except (SyntaxError, ValueError) as error:
        return {"problem": "{}:{}: {}".format(path, getattr(error, "lineno", None), getattr(error, "msg", error))}
    missing = []
    for module in _first_imports(tree):
        found = sys.modules.get(module) or _find(module)
        origin = getattr(found, "origin", None) or getattr(found, "__file__", None) or ""
        if found is None:
            missing.append(module)
        elif origin.startswith(sys.path[0]) and "site-packages" not in origin:
            break
    return {"missing": missing}


if __name__ == "__main__":
    json.dump(_look(sys.argv[1], sys.argv[2]), sys.stdout)
