"""Taichi's front end, without the work that it does for error messages when there is no error.

To find a compiled kernel on disk, Taichi first turns its Python source into its own syntax tree. For every node of that
it wraps and underlines lines of source, in case an error should have to show them, and it reads, unwraps and parses the
source of a function again at every call. That is more than half of the time that a kernel takes to load: 1.8 of 2.5
processor seconds in a picture's 13 kernels (Taichi 1.7.4). None changes the tree: kernels on disk stay what they are.
"""

import ast
import functools
import importlib
import sys
import textwrap
from types import SimpleNamespace
from typing import Any

KNOWN_VERSION = (1, 7)


def hasten(taichi: Any) -> None:
    """Replace what is slow in Taichi 1.7; other versions, and forks of it, are left as they are."""
    if taichi.__name__ != "taichi" or taichi.__version__[:2] != KNOWN_VERSION:
        return
    kernels: Any = importlib.import_module("taichi.lang.kernel_impl")
    kernels.getsourcelines = functools.cache(kernels.getsourcelines)
    kernels.getsourcefile = functools.cache(kernels.getsourcefile)
    kernels.textwrap = SimpleNamespace(fill=functools.cache(textwrap.fill), dedent=functools.cache(textwrap.dedent))
    kernels.ast = SimpleNamespace(parse=_parse)
    kernels._inside_class = _is_class_body
    context = importlib.import_module("taichi.lang.ast.ast_transformer_utils").ASTTransformerContext
    context.get_pos_info = _position


def _parse(source: str) -> ast.Module:
    """Return the syntax tree of a function: one for all of its calls. Taichi changes that of a kernel."""
    return ast.parse(source) if ".kernel" in source.partition("def ")[0] else _tree(source)


_tree = functools.cache(ast.parse)


def _position(context: Any, node: Any) -> str:
    """Return the place of an error, without the underlining of all of its lines."""
    place = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:\n'
    return f"{place}{context.src[node.lineno - 1]}\n"


def _is_class_body(level_of_class_stackframe: int) -> bool:
    """Return whether a decorator is in the body of a class, from the names there instead of from the source.

    Taichi counts up to the frame that holds the class.
    """
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals
