"""The import name of BenchBot v2: results read from files."""

from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError

__all__ = ["SKIP_KEY", "ZIP_IGNORE", "load_results"]

SKIP_KEY = "SKIP"
ZIP_IGNORE = ["submission.json"]


def load_results(results_filenames: str | PathLike[str] | Iterable[str | PathLike[str]]) -> dict[str, dict[str, Any]]:
    """Return the results in JSON files, ZIP archives (`archive:member`) and folders, by name.

    Raises BenchbotError for a file that holds none, and cannot be read.
    """
    from benchbot.evaluation import result_files
    from benchbot.evaluation.result_document import ResultDocument

    names = [results_filenames] if isinstance(results_filenames, str | PathLike) else results_filenames
    found: dict[str, dict[str, Any]] = {}
    for item in result_files.read([Path(name) for name in names]):
        if isinstance(item, result_files.Unreadable):
            raise BenchbotError(f"{item.source} is no result.", item.error.why, item.error.fix)
        if isinstance(item, ResultDocument):
            found[item.source] = dict(item.document)
    return found
