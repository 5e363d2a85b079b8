"""The child process of `post_install_check`: python -m benchbot.plugins.installer.post_install_probe REPORT NAME…

It imports plug-ins, checks whether that patches the modules of others, and runs the conformance kit. The report is a
JSON file with a list of findings; it is not written when a plug-in ends the process.
"""

import json
import os
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.hookspecs import KINDS as RECORDS
from benchbot.plugins.authoring.conformance.plugin import check_plugin

Functions = Mapping[tuple[str, str], object]


def probe(names: Sequence[str]) -> list[Finding]:
    """Return findings about installed plug-ins, and about the names of all that is installed."""
    before = loaded_functions()
    findings = [_check_import(info, before) for info in plugin_manager.installed() if info.distribution in names]
    findings += _clashes()
    if any(finding.level is Level.BROKEN for finding in findings):
        return findings  # the conformance kit would only repeat them
    for name in names:
        findings += check_plugin(name)
    return findings


def _check_import(info: plugin_manager.PluginInfo, before: Functions) -> Finding:
    subject = f"{info.distribution}: import"
    try:
        resolve_name(info.module + ":" * (":" not in info.module))
    # A plug-in's import may fail in any way.
    except (Exception, SystemExit) as error:  # noqa: BLE001
        return Finding(Level.BROKEN, subject, plugin_manager.cause_of(error), "Report it to its author.")
    changed = monkeypatched(before)
    if changed:
        detail = f"It changes the code of others: {', '.join(changed[:5])}."
        return Finding(Level.BROKEN, subject, detail, "Report it to its author: everything else runs differently.")
    return Finding(Level.OK, subject, "changes nothing of others")


def _clashes() -> list[Finding]:
    """Return a finding for each name that two installed things have, add-ons of v2 included."""
    loaded = plugin_manager.load()
    catalog = Catalog(loaded)
    found = []
    for kind, read in [*((kind, catalog.pool) for kind in KINDS), *((kind, loaded.pool) for kind in RECORDS)]:
        try:
            read(kind)
        except BenchbotError as error:
            found.append(Finding(Level.BROKEN, "names", f"{error.title} {error.why}", error.fix))
    return found


def loaded_functions() -> Functions:
    """Return every function and method of the imported modules by module and name."""
    modules = [(name, module) for name, module in [*sys.modules.items()] if isinstance(module, ModuleType)]
    return {(name, path): value for name, module in modules for path, value in _functions(name, module)}


def monkeypatched(before: Functions) -> list[str]:
    """Return the names of the functions in `before` that have been replaced or deleted since."""
    after = loaded_functions()
    missing = object()
    return sorted(
        {
            f"{module}.{path}"
            for (module, path), value in before.items()
            if module in sys.modules and after.get((module, path), missing) is not value
        }
    )


def _functions(name: str, module: ModuleType) -> Iterator[tuple[str, object]]:
    # Python itself writes these into a class when it is first used.
    hidden = ("_abc_impl", "__abstractmethods__", "__weakref__", "__dict__", "__annotations__")
    for attribute, value in [*vars(module).items()]:
        if callable(value):
            yield attribute, value
        if isinstance(value, type) and value.__module__ == name:
            for key, member in [*vars(value).items()]:
                is_code = callable(member) or isinstance(member, classmethod | staticmethod | property)
                if key not in hidden and is_code:
                    yield f"{attribute}.{key}", member


def _exit_at_end_of_stdin() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_exit_at_end_of_stdin, daemon=True).start()
    _report = json.dumps([asdict(finding) for finding in probe(sys.argv[2:])])
    Path(sys.argv[1]).write_text(_report, "utf-8")
