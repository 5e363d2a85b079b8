"""Methods of evaluation: choosing the one that scores a task's results."""

from typing import Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins
from benchbot.core.records import Evaluator


def for_task(catalog: Catalog, name: str | None, task_details: dict[str, Any]) -> Evaluator:
    """Return the named method, or the task's `evaluation_method`, or the only one that scores its results format.

    The task is asked as the result tells of it, else the installed one of its name. Raises BenchbotError as `choose`.
    """
    named = name or task_details.get("evaluation_method")
    if named is None and task_details["name"] in catalog.names("tasks"):
        named = catalog.get("tasks", task_details["name"]).data.get("evaluation_method")
    return choose(catalog.plugins, named, task_details.get("results_format"))


def choose(plugins: Plugins, name: str | None, results_format: str | None) -> Evaluator:
    """Return the named method, or the only installed one that scores results of this format.

    Raises BenchbotError when there is none, when there are several, and when the named one does not read the format.
    """
    if name is not None:
        method: Evaluator = plugins.record("evaluators", name)
        if results_format not in method.result_formats:
            raise BenchbotError(
                f"The method '{name}' cannot score these results.",
                f"They have the format {results_format!r}; it reads: {', '.join(sorted(method.result_formats))}.",
                "Leave the method out to have the right one chosen.",
            )
        return method
    installed: list[Evaluator] = [provided.value for provided in plugins.pool("evaluators").values()]
    fitting = [method for method in installed if results_format in method.result_formats]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        raise BenchbotError(
            "There are several methods that score these results.",
            f"For the format '{results_format}': {', '.join(sorted(method.name for method in fitting))}.",
            "Choose one with --method.",
        )
    known = ", ".join(sorted(method.name for method in installed)) or "none"
    raise BenchbotError(
        "There is no method that scores these results.",
        f"They have the format {results_format!r}. Installed methods: {known}.{plugins.broken_hint()}",
        "Install one, for object maps: benchbot install benchbot-eval-omq",
    )
