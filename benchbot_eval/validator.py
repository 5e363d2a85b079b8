"""The import name of BenchBot v2: validation of results, an alias of `benchbot.evaluation.validate_files`."""

from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path

from benchbot.core.errors import BenchbotError

_validated: list["Validator"] = []


class Validator:
    """Results that are valid: JSON files, ZIP archives and folders of them.

    Raises BenchbotError for one that is not, and for results of several tasks. Results of other tasks than
    `required_task` and of other environments than `required_envs` are left out. v2 handed what it had validated to its
    Evaluator in a pickle in /tmp; here both have to be used in one process.
    """

    def __init__(
        self,
        results_filenames: str | PathLike[str] | Iterable[str | PathLike[str]],
        required_task: str | None = None,
        required_envs: Sequence[str] | None = None,
    ) -> None:
        names = [results_filenames] if isinstance(results_filenames, str | PathLike) else results_filenames
        self.paths = [Path(name) for name in names]
        self.required_task = required_task
        self.required_envs = required_envs
        self.validate_results_data()
        _validated[:] = [self]

    def validate_results_data(self) -> bool:
        """Return True, or raise BenchbotError that says which results are not valid, and why."""
        from benchbot.core.declarations.catalog import Catalog
        from benchbot.core.plugin_manager import load
        from benchbot.evaluation import validate_files

        coverage = validate_files(
            self.paths, catalog=Catalog(load()), required_task=self.required_task, required_envs=self.required_envs
        )
        broken = [item for item in coverage["missing"] if item["source"] is not None and item["failure"] is None]
        if broken:
            raise BenchbotError(
                "Some results are not valid.",
                "\n".join(f"{item['source']}: {item['reason']}" for item in broken),
                "Mend them, or leave them out.",
            )
        return True


def latest() -> Validator:
    """Return what was validated last; raises BenchbotError when nothing was."""
    if not _validated:
        raise BenchbotError(
            "There are no validated results.",
            "An Evaluator scores what a Validator has found valid, in the same process.",
            "Validate first: Validator(results_filenames)",
        )
    return _validated[0]
