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
from collections.abc import Callable
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


def compile_before_launch(taichi: Any, compiled: Callable[[], None]) -> None:
    """Call `compiled` whenever a kernel has been compiled, before it runs: that may take as long again.

    Taichi compiles a kernel as part of its first launch. Versions other than 1.7, and forks, go on doing so.
    """
    if taichi.__name__ != "taichi" or taichi.__version__[:2] != KNOWN_VERSION:
        return
    kernel: Any = importlib.import_module("taichi.lang.kernel_impl").Kernel
    materialize = kernel.materialize

    def materialize_and_compile(self: Any, key: Any = None, args: Any = None, arg_features: Any = None) -> None:
        is_known = key in self.compiled_kernels
        materialize(self, key, args, arg_features)
        if key is not None and not is_known:
            program = self.runtime.prog
            program.compile_kernel(program.config(), program.get_device_caps(), self.compiled_kernels[key])
            compiled()

    kernel.materialize = materialize_and_compile


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
