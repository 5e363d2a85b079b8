"""The conformance of a whole plug-in: how it is installed and imported, and everything that it declares."""

import json
import os
import pkgutil
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial

from benchbot.core import hookspecs
from benchbot.core.declarations import formats, schema
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.light_records import TuiScreen
from benchbot.core.plugin_manager import PluginInfo, Plugins, installed, load
from benchbot.plugins.authoring.conformance.declarations import check_environment, check_robot, check_task
from benchbot.plugins.authoring.conformance.properties import Violation, check_property

IMPORT = """
import json, sys
before = set(sys.modules)
import benchbot.core.hookspecs
from pkgutil import resolve_name
resolve_name(sys.argv[1] + ':' * (':' not in sys.argv[1]))
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
    """Return findings on an installed plug-in, by the name of its distribution.

    Its tasks, robots and environments are checked, too; its simulators, methods and the like have their own checks.
    """
    infos = [info for info in installed() if info.distribution == distribution]
    findings = [check_property("entry point", partial(_has_an_entry_point, distribution, infos))]
    for info in infos:
        findings.append(check_property(f"{info.name}: import", partial(_imports_quietly, info)))
        findings.append(check_property(f"{info.name}: hooks", partial(_has_sound_hooks, info)))
    if infos:
        catalog = Catalog(load())
        findings.append(check_property("names", partial(_has_names_of_its_own, catalog, distribution)))
        findings += _check_declarations(catalog, distribution)
        findings += _check_screens(catalog, distribution)
    return findings


def _check_screens(catalog: Catalog, distribution: str) -> Iterator[Finding]:
    for name, provided in catalog.plugins.pool("screens").items():
        if provided.distribution == distribution:
            yield check_property(f"screen {name}", partial(_is_a_screen, provided.value))


def _is_a_screen(record: TuiScreen) -> str:
    """Make a screen of benchbot tui, as opening it does; it is not shown."""
    from textual.screen import Screen

    made = pkgutil.resolve_name(record.target)()
    if not isinstance(made, Screen):
        raise Violation(
            f"{record.target} gives {type(made).__name__}, which is no Textual screen.",
            "Name a class derived from benchbot.screens.CommandScreen or textual.screen.Screen.",
        )
    if not record.summary:
        raise Violation("It has no summary.", "Say in a few words what it is for: the palette shows it.")
    return f"{type(made).__name__}, {record.key or 'without a key'}"


def _has_an_entry_point(distribution: str, infos: list[PluginInfo]) -> str:
    if not infos:
        near = sorted({info.distribution for info in installed()})
        raise Violation(
            f"'{distribution}' is not installed, or has no entry point in the group 'benchbot'.",
            "Write [project.entry-points.benchbot] in its pyproject.toml and install it again. "
            f"Installed: {', '.join(near)}.",
        )
    return ", ".join(f"{info.name} = {info.module} ({info.version})" for info in infos)


def _imports_quietly(info: PluginInfo) -> str:
    """Import the plug-in in a new process, since this one has imported everything already."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORT, info.module],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1:] or [f"exit status {done.returncode}"]
        places = re.findall(r'File "([^<].*?)", line (\d+)', done.stderr)
        where = f" ({':'.join(places[-1])})" if places else ""
        raise Violation(f"It cannot be imported: {last[0]}{where}", f"Mend it: python -c 'import {info.module}'")
    said, _, modules = done.stdout.rstrip().rpartition("\n")
    if said.strip() or done.stderr.strip():
        raise Violation(
            f"It prints at import: {(said.strip() or done.stderr.strip())[:100]!r}",
            "Print nothing: stdout is for data.",
        )
    heavy = sorted(HEAVY & set(json.loads(modules)))
    if heavy:
        raise Violation(
            f"It imports {', '.join(heavy)} at once.",
            "Import it inside `create`, `evaluate` and the like: every command imports every plug-in.",
        )
    return "light and quiet"


def _has_sound_hooks(info: PluginInfo) -> str:
    alone = Plugins([info])
    _require_nothing_broken(alone)
    declared = [kind for kind in (*KINDS, "ground_truths") if alone.sources(kind)]
    used = declared + [kind for kind in hookspecs.KINDS if alone.pool(kind)]
    _require_nothing_broken(alone)
    if not used:
        raise Violation(
            "It implements no hook.", "Mark one with @hookimpl, from benchbot.plugin: see docs/reference/hooks.md."
        )
    return ", ".join(used)


def _require_nothing_broken(plugins: Plugins) -> None:
    for broken in plugins.broken:
        raise Violation(broken.cause, "Names of hooks and their arguments are in docs/reference/hooks.md.")


def _has_names_of_its_own(catalog: Catalog, distribution: str) -> str:
    plugins = catalog.plugins
    givers = [provided.distribution for kind in hookspecs.KINDS for provided in plugins.pool(kind).values()]
    givers += [declared.distribution for kind in KINDS for declared in catalog.pool(kind).values()]
    sources = [source for kind in KINDS for source in plugins.sources(kind)]
    own = tuple(str(source.value) for source in sources if source.distribution == distribution)
    for error in catalog.broken:
        if error.title.startswith(own):
            raise error
    return f"{givers.count(distribution)} names, nobody else's"


def _check_declarations(catalog: Catalog, distribution: str) -> Iterator[Finding]:
    for kind, singular in KINDS.items():
        for name, declaration in catalog.pool(kind).items():
            if declaration.distribution != distribution:
                continue
            subject = f"{singular} {name}"
            if kind in CHECKS:
                yield from _summary(subject, CHECKS[kind](name, catalog=catalog))
            else:
                yield check_property(subject, partial(_is_declared_well, catalog, kind, name))


def _summary(subject: str, findings: list[Finding]) -> Iterator[Finding]:
    """Yield what is wrong with a declaration, or one finding that nothing is: a plug-in may have many declarations."""
    wrong = [finding for finding in findings if finding.level is not Level.OK]
    for finding in wrong:
        yield Finding(finding.level, f"{subject}: {finding.subject}", finding.detail, finding.fix)
    if not wrong:
        yield Finding(Level.OK, subject, f"{len(findings)} properties")


def _is_declared_well(catalog: Catalog, kind: str, name: str) -> str:
    declaration = catalog.get(kind, name)
    schema.check(declaration.data, KINDS[kind], declaration.path)
    if kind == "formats":
        return ", ".join(formats.functions(declaration))
    return declaration.path.name
