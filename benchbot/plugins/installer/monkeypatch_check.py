"""What an import has changed in other people's modules: functions and methods that are not the ones that they were."""

import sys
from collections.abc import Iterator, Mapping
from types import ModuleType
from typing import Any

Functions = Mapping[tuple[str, str], object]


def functions() -> Functions:
    """Return every function and method of the imported modules by module and name, to compare with later ones."""
    modules = [(name, module) for name, module in [*sys.modules.items()] if isinstance(module, ModuleType)]
    return {(name, path): value for name, module in modules for path, value in _of(name, module)}


def patched(before: Functions) -> list[str]:
    """Return the names of those in `before` that are others by now, or gone."""
    after = functions()
    missing = object()
    return sorted(
        {
            f"{module}.{path}"
            for (module, path), value in before.items()
            if module in sys.modules and after.get((module, path), missing) is not value
        }
    )


def _of(name: str, module: ModuleType) -> Iterator[tuple[str, object]]:
    for attribute, value in [*vars(module).items()]:
        if callable(value):
            yield attribute, value
        if isinstance(value, type) and value.__module__ == name:
            yield from ((f"{attribute}.{key}", member) for key, member in _members(value))


def _members(owner: type) -> list[tuple[str, Any]]:
    # What Python itself writes into a class when it is first used, such as caches of abstract classes, is no patch.
    hidden = ("_abc_impl", "__abstractmethods__", "__weakref__", "__dict__", "__annotations__")
    return [
        (key, value)
        for key, value in [*vars(owner).items()]
        if key not in hidden and (callable(value) or isinstance(value, classmethod | staticmethod | property))
    ]
