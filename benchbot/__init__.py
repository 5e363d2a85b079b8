"""BenchBot: is my robotics algorithm any good?"""

from typing import Any

__version__ = "0.1.0"
__all__ = ["__version__"]


def __getattr__(name: str) -> Any:
    # Where plug-ins of BenchBot 0.1 took it from.
    if name == "hookimpl":
        import importlib
        import warnings

        warnings.warn("Import hookimpl from benchbot.plugin.", DeprecationWarning, stacklevel=2)
        return importlib.import_module("benchbot.plugin").hookimpl
    raise AttributeError(f"module 'benchbot' has no attribute '{name}'")
