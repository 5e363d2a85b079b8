"""Checking what was just installed, in a child process, so that it can do no harm here; what fails is an error."""

import json
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.plugins.installer.running import Runner

TIMEOUT_S = 600.0
_SHOWN = 6


def check(names: Sequence[str]) -> list[Finding]:
    """Import installed plug-ins in a child process and return what was found right.

    Raises BenchbotError for what is broken. Without names, it looks whether any two things have the same name.
    """
    with tempfile.TemporaryDirectory(prefix="benchbot-check-") as folder, _lifeline() as lifeline:
        report = Path(folder) / "report.json"
        # -P: a module in the user's folder is not to be taken for one of ours. -B: nothing compiled is left behind.
        words = [sys.executable, "-P", "-B", "-m", "benchbot.plugins.installer.probe", str(report), *names]
        # Whatever a run is restricted to, a name must be nobody else's.
        everything = {"BENCHBOT_PLUGINS": ",".join(_all_plugins())} if "BENCHBOT_PLUGINS" in os.environ else {}
        quiet = {"PYTHONDONTWRITEBYTECODE": "1", **everything}
        # It changes nothing, so that nobody need wait for it: no lock.
        done = Runner().run(words, quiet, timeout_s=TIMEOUT_S, lifeline=lifeline)
        if done.code is None:
            raise _broken([f"It was not done within {TIMEOUT_S:g} s."], names)
        try:
            found = [Finding(Level(item.pop("level")), **item) for item in json.loads(report.read_text("utf-8"))]
        except OSError as error:
            last = (done.err.strip() or done.out.strip() or "Nothing was said.").splitlines()[-1]
            raise _broken(
                [f"The process that looked at it ended with exit status {done.code}: {last}"], names
            ) from error
    wrong = [f"{one.subject}: {one.detail}" for one in found if one.level is Level.BROKEN]
    if wrong:
        raise _broken(list(dict.fromkeys(wrong)), names)
    return found


@contextmanager
def _lifeline() -> Iterator[int]:
    """Yield the end of a pipe to read from; the other one is closed with this process, however that ends."""
    ours, theirs = os.pipe()
    try:
        yield ours
    finally:
        os.close(ours)
        os.close(theirs)


def _all_plugins() -> list[str]:
    from benchbot.core import entry_points

    return sorted({point.distribution for point in entry_points.find("benchbot")})


def _broken(causes: list[str], names: Sequence[str]) -> BenchbotError:
    more = [f"and {len(causes) - _SHOWN} more"] if len(causes) > _SHOWN else []
    return BenchbotError(
        f"{' and '.join(names) or 'The add-on'} cannot be used, so everything was put back to what it was.",
        "\n".join([*causes[:_SHOWN], *more]),
        "Report this to the author; 'benchbot.testing' shows them the same.",
    )


def problems_in(folder: Path) -> list[str]:
    """Return what is wrong with the declarations in a folder of v2's add-ons."""
    from benchbot.core.declarations.catalog import KINDS
    from benchbot.core.resources import declaration_files
    from benchbot.plugins.v2 import addons

    addon = addons.find(folder)
    found = []
    for kind, noun in {**KINDS, "evaluation_methods": "evaluation_method"}.items():
        for path in declaration_files(addon.sources(kind)):
            try:
                found += [str(problem) for problem in schema.problems(schema.read(path), noun, path)]
            except BenchbotError as error:
                found.append(error.title)
    return [text.replace(f"{folder}{os.sep}", "") for text in found]
