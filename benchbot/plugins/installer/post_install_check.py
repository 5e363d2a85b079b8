"""Checks plug-ins that were just installed in a child process, where they can do no harm."""

import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchbot.core import entry_points
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.plugins.installer.distributions import GROUP
from benchbot.plugins.installer.subprocesses import Runner

TIMEOUT_S = 600.0
_MAX_SHOWN = 6


def check(names: Sequence[str]) -> None:
    """Import and check installed plug-ins in a child process; raises BenchbotError for what is broken.

    Without names, it only checks whether any two things have the same name.
    """
    # The child ends when its stdin, a pipe, ends: it does so with this process, however that ends.
    stdin, keep_open = os.pipe()
    with tempfile.TemporaryDirectory(prefix="benchbot-check-") as folder:
        report = Path(folder) / "report.json"
        # -P: no module in the user's folder is taken for one of ours. -B: no compiled files are left behind.
        words = [sys.executable, "-P", "-B", "-m", "benchbot.plugins.installer.post_install_probe", str(report), *names]
        variables = {"PYTHONDONTWRITEBYTECODE": "1"}
        if "BENCHBOT_PLUGINS" in os.environ:  # names must be unique among all plug-ins, not only those of this run
            variables["BENCHBOT_PLUGINS"] = ",".join(sorted({one.distribution for one in entry_points.find(GROUP)}))
        try:
            # The child changes nothing, so that nobody need wait for it: it does not inherit the lock.
            done = Runner().run(words, variables, timeout_s=TIMEOUT_S, stdin=stdin)
        finally:
            os.close(stdin)
            os.close(keep_open)
        if done.code is None:
            raise _broken([f"It was not done within {TIMEOUT_S:g} s."], names)
        try:
            found = [Finding(Level(item.pop("level")), **item) for item in json.loads(report.read_text("utf-8"))]
        except OSError as error:
            last = (done.err.strip() or done.out.strip() or "Nothing was said.").splitlines()[-1]
            cause = f"The process that looked at it ended with exit status {done.code}: {last}"
            raise _broken([cause], names) from error
    causes = [f"{one.subject}: {one.detail}" for one in found if one.level is Level.BROKEN]
    if causes:
        raise _broken(list(dict.fromkeys(causes)), names)


def _broken(causes: list[str], names: Sequence[str]) -> BenchbotError:
    more = [f"and {len(causes) - _MAX_SHOWN} more"] if len(causes) > _MAX_SHOWN else []
    return BenchbotError(
        f"{' and '.join(names) or 'The add-on'} cannot be used, so everything was put back to what it was.",
        "\n".join([*causes[:_MAX_SHOWN], *more]),
        "Report this to the author; 'benchbot.testing' shows them the same.",
    )
