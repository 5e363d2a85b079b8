"""Taichi's front end, without the work that it does for error messages when there is no error.

To find a compiled kernel on disk, Taichi first turns its Python source into its own syntax tree. For every node of that
it wraps and underlines lines of source, in case an error should have to show them, and it reads, unwraps and parses the
source of a function again at every call. That is more than half of the time that a kernel takes to load: 1.8 of 2.5
processor seconds in a picture's 13 kernels (Taichi 1.7.4). None changes the tree: kernels on disk stay what they are.
"""

import ast
import functools
import importlib
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, SimpleNamespace, TracebackType
from typing import Any

import numpy as np

KNOWN_VERSION = (1, 7)
PLAIN = (bool, int, float, str)
INTEGERS = (int, np.integer)


def _is_known(taichi: Any) -> bool:
    return bool(taichi.__name__ == "taichi" and taichi.__version__[:2] == KNOWN_VERSION)


@contextmanager
def importing() -> Iterator[None]:
    """Import Taichi in here, in half of the time.

    It decorates 93 functions of its own, and asks for each whether the line that holds it begins a class. To know that
    line `inspect` searches all modules and reads their sources.
    """
    find_out = inspect.getframeinfo

    def frame_info(frame: FrameType | TracebackType, context: int = 1) -> inspect.Traceback:
        asking = sys._getframe(1)
        if asking.f_globals.get("__name__") != "taichi.lang.kernel_impl" or not isinstance(frame, FrameType):
            return find_out(frame, context)
        inner: FrameType | None = asking
        while inner is not None and inner.f_back is not frame:
            inner = inner.f_back
        line = "class " if inner is not None and "__qualname__" in inner.f_locals else ""
        return inspect.Traceback(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name, [line], 0)

    inspect.getframeinfo = frame_info
    try:
        yield
    finally:
        inspect.getframeinfo = find_out


def hasten(taichi: Any) -> None:
    """Replace what is slow in Taichi 1.7; other versions, and forks of it, are left as they are."""
    if not _is_known(taichi):
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
    if not _is_known(taichi):
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


def shorten_launches(taichi: Any) -> None:
    """Launch kernels without finding out again, argument by argument, what Taichi knows from their launch before.

    That is 0.28 ms of Python for each of the 19 launches of a picture, in which all threads wait; so it is 0.10 (Taichi
    1.7.4, one core of an EPYC). Kernels that return something, and arguments of other kinds than numbers, Taichi's own
    arrays and numpy's contiguous ones, go the long way.
    """
    if not _is_known(taichi):
        return
    kernels: Any = importlib.import_module("taichi.lang.kernel_impl")
    primitives = kernels.primitive_types
    array_of_device = importlib.import_module("taichi.lang._ndarray").ScalarNdarray
    go_the_long_way = kernels.Kernel.__call__

    def kind_of(annotation: Any) -> str:
        if isinstance(annotation, kernels.template):
            return "template"
        if isinstance(annotation, kernels.ndarray_type.NdarrayType):
            return "array"
        if id(annotation) in primitives.real_type_ids:
            return "real"
        if id(annotation) in primitives.integer_type_ids:
            return "int" if kernels.is_signed(kernels.cook_dtype(annotation)) else "uint"
        return "other"

    def launch(self: Any, *args: Any, **named: Any) -> Any:
        kinds = self.__dict__.get("kinds_of_arguments")
        if kinds is None:
            kinds = self.kinds_of_arguments = [kind_of(each.annotation) for each in self.arguments]
            self.known_launches = {}
            self.is_known_kind = self.return_type is None and "other" not in kinds
        if named or not self.is_known_kind or len(args) != len(kinds):
            return go_the_long_way(self, *args, **named)
        key: list[Any] = []
        for kind, value in zip(kinds, args, strict=True):
            if kind == "array":
                if isinstance(value, array_of_device):
                    is_plain = value.grad is None
                else:
                    is_plain = isinstance(value, np.ndarray) and value.flags.c_contiguous
                if not is_plain:
                    return go_the_long_way(self, *args)
                key += (value.dtype, len(value.shape))
            elif kind == "template":
                if not isinstance(value, PLAIN):
                    return go_the_long_way(self, *args)
                key.append(value)
            elif kind != "real" and not isinstance(value, INTEGERS):
                return go_the_long_way(self, *args)
        program = self.runtime.prog
        known = self.known_launches.get(tuple(key))
        if known is None or known[0] is not program:
            go_the_long_way(self, *args)
            compiled = self.compiled_kernels[self.ensure_compiled(*args)]
            machine_code = program.compile_kernel(program.config(), program.get_device_caps(), compiled)
            self.known_launches[tuple(key)] = program, compiled, machine_code
            return None
        context = known[1].make_launch_context()
        slot = 0
        for kind, value in zip(kinds, args, strict=True):
            if kind == "array" and isinstance(value, array_of_device):
                context.set_arg_ndarray((slot,), value.arr)
            elif kind == "array":
                address = value.__array_interface__["data"][0]
                context.set_arg_external_array_with_shape((slot,), address, value.nbytes, value.shape, 0)
            elif kind == "int":
                context.set_arg_int((slot,), int(value))
            elif kind == "real":
                context.set_arg_float((slot,), float(value))
            elif kind == "uint":
                context.set_arg_uint((slot,), int(value))
            slot += kind != "template"
        program.launch_kernel(known[2], context)
        return None

    kernels.Kernel.__call__ = launch


def _parse(source: str) -> ast.Module:
    """Return the syntax tree of a function: one for all of its calls. Taichi changes that of a kernel."""
    return ast.parse(source) if "kernel" in source.partition("def ")[0] else _tree(source)


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
