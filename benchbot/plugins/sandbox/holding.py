"""The submission mode `sandbox` (`benchbot.submission.modes.Holder`): bubblewrap, or Landlock where there is none.

Its option is `readable`, the paths of this machine that a solution may read besides what it needs.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.sandbox.mode import Sandbox
from benchbot.submission.modes import SolutionSpec


def resolved(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with absolute paths; raises BenchbotError for one that is not there."""
    paths = [Path(path).absolute() for path in options.get("readable", ())]
    for path in paths:
        if not path.exists():
            raise BenchbotError(f"There is no {path}.", "--readable names it.", "Name a file or folder that is there.")
    return {"readable": [str(path) for path in paths]}


@contextmanager
def prepared(spec: SolutionSpec, options: Mapping[str, Any], tell: Callable[[str], object]) -> Iterator[SolutionSpec]:
    """Yield the order held by a sandbox; raises BenchbotError when there can be none on this machine."""
    sandbox = Sandbox(tuple(map(Path, options["readable"])))
    sandbox.check()
    yield replace(spec, mode=sandbox)


def files(options: Mapping[str, Any]) -> Mapping[str, str] | None:
    """Return None: the command of a solution names its files."""
    return None
