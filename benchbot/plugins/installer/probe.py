"""Looks at freshly installed plug-ins, in a process of its own: python -m benchbot.plugins.installer.probe REPORT NAME…

It imports them, sees whether they leave the modules of others alone, and asks the conformance kit. The report is a JSON
file with a list of findings; there is none when a plug-in has ended the process.
"""

import json
import os
import sys
import threading
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from pkgutil import resolve_name

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.records import KINDS as RECORDS
from benchbot.plugins.installer.monkeypatch_check import Functions, functions, patched
from benchbot.testing import check_plugin


def probe(names: Sequence[str]) -> list[Finding]:
    """Return what is wrong and right with installed plug-ins, and with the names of all that is installed."""
    before = functions()
    findings = []
    for info in plugin_manager.installed():
        if info.distribution in names:
            findings += [_imports_and_leaves_others_alone(info, before)]
    findings += _clashes()
    if any(finding.level is Level.BROKEN for finding in findings):
        return findings  # what the kit would say of broken foundations is no help
    for name in names:
        findings += check_plugin(name)
    return findings


def _imports_and_leaves_others_alone(info: plugin_manager.PluginInfo, before: Functions) -> Finding:
    subject = f"{info.distribution}: import"
    try:
        resolve_name(info.module)
    # A third party's import may fail in any way at all; that is what is asked here.
    except (Exception, SystemExit) as error:  # noqa: BLE001
        return Finding(Level.BROKEN, subject, f"{type(error).__name__}: {error}", "Report it to its author.")
    changed = patched(before)
    if changed:
        detail = f"It changes the code of others: {', '.join(changed[:5])}."
        return Finding(Level.BROKEN, subject, detail, "Report it to its author: everything else runs differently.")
    return Finding(Level.OK, subject, "changes nothing of others")


def _clashes() -> list[Finding]:
    """Return the names that two things have, among all that is installed, add-ons of v2 included."""
    loaded = plugin_manager.load()
    catalog = Catalog(loaded)
    found = []
    for kind, read in [*((kind, catalog.pool) for kind in KINDS), *((kind, loaded.pool) for kind in RECORDS)]:
        try:
            read(kind)
        except BenchbotError as error:
            found.append(Finding(Level.BROKEN, "names", f"{error.title} {error.why}", error.fix))
    return found


def _end_with_the_one_who_asked() -> None:
    """Wait for the end of stdin, which is that of the process that wants to know."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with_the_one_who_asked, daemon=True).start()
    _report = json.dumps([asdict(finding) for finding in probe(sys.argv[2:])])
    Path(sys.argv[1]).write_text(_report, "utf-8")
