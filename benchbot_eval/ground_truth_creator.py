"""The import name of BenchBot v2: ground truths begun from a format and an environment that are installed."""

from collections.abc import Callable
from typing import Any

from benchbot.core.errors import BenchbotError


class GroundTruthCreator:
    """Makes ground truths of a format, for an environment `name:variant`; raises BenchbotError for unknown names."""

    def __init__(self, ground_truth_format_name: str, environment_name: str) -> None:
        from benchbot.core.declarations import formats
        from benchbot.core.declarations.catalog import Catalog
        from benchbot.core.plugin_manager import load

        catalog = Catalog(load())
        self.ground_truth_format = catalog.get("formats", ground_truth_format_name)
        scenes = catalog.environments(environment_name)
        if len(scenes) > 1:
            raise BenchbotError(
                f"'{environment_name}' names {len(scenes)} scenes.",
                "A ground truth is of one.",
                "Make one for each variant.",
            )
        self.environment = scenes[0]
        self._functions = formats.functions(self.ground_truth_format)

    def create_empty(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Return a ground truth without objects; arguments are those of the format's `create`."""
        instance = self.function("create")(*args, **kwargs) if "create" in self._functions else {}
        return {
            "environment": dict(self.environment.data),
            "format": dict(self.ground_truth_format.data),
            "ground_truth": instance,
        }

    def function(self, name: str) -> Callable[..., Any]:
        """Return one of the format's functions; raises BenchbotError for one that it does not have."""
        if name not in self._functions:
            raise BenchbotError(
                f"The format '{self.ground_truth_format.name}' has no function '{name}'.",
                f"It has: {', '.join(self.functions())}.",
                "Call one of these.",
            )
        return self._functions[name]

    def functions(self) -> list[str]:
        """Return the names of the format's functions."""
        return sorted(self._functions)
