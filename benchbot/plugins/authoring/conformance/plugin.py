"""The conformance of a whole plug-in: how it is installed and imported, and everything that it declares."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from typing import Any

from benchbot.core import records
from benchbot.core.declarations import formats, schema
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.plugin_manager import PluginInfo, Plugins, installed, load
from benchbot.plugins.authoring.conformance.environment import check_environment
from benchbot.plugins.authoring.conformance.properties import Wrong, look
from benchbot.plugins.authoring.conformance.robot import check_robot
from benchbot.plugins.authoring.conformance.task import check_task

IMPORT = """
import json, sys
before = set(sys.modules)
import benchbot.core.records
from pkgutil import resolve_name
resolve_name(sys.argv[1])
sys.stdout.flush()
print("\\n" + json.dumps(sorted({name.partition(".")[0] for name in set(sys.modules) - before})))
"""
HEAVY = frozenset({
    "numpy", "scipy", "taichi", "torch", "tensorflow", "jax", "cv2", "rclpy", "ray", "matplotlib", "pandas", "trimesh",
    "PIL", "starlette", "uvicorn", "textual", "gymnasium", "sklearn",
})  # fmt: skip
CHECKS: dict[str, Callable[..., list[Finding]]] = {
    "tasks": check_task,
    "robots": check_robot,
    "environments": check_environment,
}


def check_plugin(distribution: str) -> list[Finding]:
    """Return what is right and wrong with an installed plug-in, by the name of its distribution.

    Its tasks, robots and environments are checked, too; simulators, methods and the like have checks of their own.
    """
    infos = [info for info in installed() if info.distribution == distribution]
    findings = [look("entry point", partial(_is_found, distribution, infos))]
    for info in infos:
        findings += [
            look(f"{info.name}: import", partial(_imports_quietly, info)),
            look(f"{info.name}: hooks", partial(_has_sound_hooks, info)),
        ]
    if infos:
        findings.append(look("names", partial(_has_names_of_its_own, distribution)))
        findings += _look_at_declarations(distribution)
    return findings


def _is_found(distribution: str, infos: list[PluginInfo]) -> str:
    if not infos:
        near = sorted({info.distribution for info in installed()})
        raise Wrong(
            f"'{distribution}' is not installed, or has no entry point in the group 'benchbot'.",
            "Write [project.entry-points.benchbot] in its pyproject.toml and install it again. "
            f"Installed: {', '.join(near)}.",
        )
    return ", ".join(f"{info.name} = {info.module} ({info.version})" for info in infos)


def _imports_quietly(info: PluginInfo) -> str:
    """In a process of its own, since this one has imported everything already."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORT, info.module],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"exit status {done.returncode}"]
        raise Wrong(f"It cannot be imported: {last[0]}", f"Mend it: python -c 'import {info.module}'")
    said, _, modules = done.stdout.rstrip().rpartition("\n")
    if said.strip() or done.stderr.strip():
        raise Wrong(
            f"It prints at import: {(said.strip() or done.stderr.strip())[:100]!r}",
            "Print nothing: stdout is for data.",
        )
    heavy = sorted(HEAVY & set(json.loads(modules)))
    if heavy:
        raise Wrong(
            f"It imports {', '.join(heavy)} at once.",
            "Import it inside `create`, `evaluate` and the like: every command imports every plug-in.",
        )
    return "light and quiet"


def _has_sound_hooks(info: PluginInfo) -> str:
    alone = Plugins([info])
    _nothing_broken(alone)
    counts: dict[str, int] = {}
    for kind in (*KINDS, "ground_truths"):
        counts[kind] = len(alone.sources(kind))
    for kind in records.KINDS:
        counts[kind] = len(alone.pool(kind))
    _nothing_broken(alone)
    used = [kind for kind, count in counts.items() if count]
    if not used:
        raise Wrong(
            "It implements no hook.", "Mark one with @hookimpl, from benchbot.plugin: see docs/reference/hooks.md."
        )
    return ", ".join(used)


def _nothing_broken(plugins: Plugins) -> None:
    for broken in plugins.broken:
        raise Wrong(broken.cause, "Names of hooks and their arguments are in docs/reference/hooks.md.")


def _has_names_of_its_own(distribution: str) -> str:
    plugins = load()
    catalog = Catalog(plugins)
    names = [
        *(
            name
            for kind in records.KINDS
            for name, value in plugins.pool(kind).items()
            if value.distribution == distribution
        ),
        *(name for kind in KINDS for name, value in catalog.pool(kind).items() if value.distribution == distribution),
    ]
    for error in catalog.broken:
        if any(str(error.title).startswith(str(source.value)) for source in _sources(plugins, distribution)):
            raise error
    return f"{len(names)} names, nobody else's"


def _sources(plugins: Plugins, distribution: str) -> Iterator[Any]:
    every = chain.from_iterable(plugins.sources(kind) for kind in KINDS)
    return (source for source in every if source.distribution == distribution)


def _look_at_declarations(distribution: str) -> Iterator[Finding]:
    catalog = Catalog(load())
    for kind, singular in KINDS.items():
        for name, declaration in catalog.pool(kind).items():
            if declaration.distribution != distribution:
                continue
            subject = f"{singular} {name}"
            if kind in CHECKS:
                yield from _told(subject, CHECKS[kind](name, catalog=catalog))
            else:
                yield look(subject, partial(_is_declared_well, catalog, kind, name))


def _told(subject: str, findings: list[Finding]) -> Iterator[Finding]:
    """Yield what is wrong, or that nothing is: a plug-in may have many."""
    worse = [finding for finding in findings if finding.level is not Level.OK]
    for finding in worse:
        yield Finding(finding.level, f"{subject}: {finding.subject}", finding.detail, finding.fix)
    if not worse:
        yield Finding(Level.OK, subject, f"{len(findings)} properties")


def _is_declared_well(catalog: Catalog, kind: str, name: str) -> str:
    declaration = catalog.get(kind, name)
    schema.check(declaration.data, KINDS[kind], declaration.path)
    if kind == "formats":
        return ", ".join(formats.functions(declaration))
    return declaration.path.name
