"""BenchBot: is my robotics algorithm any good?"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.core.hookspecs import hookimpl

__version__ = "0.1.0"
__all__ = ["__version__", "hookimpl"]


def __getattr__(name: str) -> Any:
    # Plug-ins write `from benchbot import hookimpl`; everybody else's `import benchbot` stays free of pluggy.
    if name == "hookimpl":
        from benchbot.core.hookspecs import hookimpl

        return hookimpl
    raise AttributeError(f"module 'benchbot' has no attribute '{name}'")
