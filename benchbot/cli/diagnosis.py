"""What `benchbot doctor` looks at: one function per question, each yielding what it found and how to mend it."""

import platform
import shutil
import socket
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from benchbot.core import hookspecs, plugins, resources, schema
from benchbot.core.catalog import KINDS, Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level

SUPPORTED_PYTHON = ((3, 11), (3, 13))
LITTLE_DISK_BYTES = 2**30
NO_DISK_BYTES = 50 * 2**20


def diagnose(catalog: Catalog, *, warm: bool) -> Iterator[Finding]:
    """Yield everything that is worth knowing of this installation and this machine; `warm` fills the caches, too."""
    yield from python()
    yield from installed(catalog.plugins)
    yield from names(catalog)
    yield from declarations(catalog)
    yield from simulators(catalog.plugins, warm=warm)
    yield from folders()
    yield from default_port()


def python() -> Iterator[Finding]:
    """Say which Python runs on which machine."""
    lowest, highest = SUPPORTED_PYTHON
    detail = f"{platform.python_version()} on {platform.platform()}, {sys.executable}"
    if lowest <= sys.version_info[:2] <= highest:
        yield Finding(Level.OK, "Python", detail)
    else:
        wanted = f"{lowest[0]}.{lowest[1]} to {highest[0]}.{highest[1]}"
        yield Finding(Level.WARNING, "Python", detail, f"BenchBot is tested with Python {wanted}: use one of these.")


def installed(loaded: plugins.Plugins) -> Iterator[Finding]:
    """Say which plug-ins are installed, and why some cannot be loaded."""
    broken = {(item.info.distribution, item.info.name): item.cause for item in loaded.broken}
    for info in plugins.installed():
        subject = f"plug-in {info.name}"
        cause = broken.get((info.distribution, info.name))
        if cause is None:
            yield Finding(Level.OK, subject, f"{info.distribution} {info.version}")
        else:
            fix = f"pip install --force-reinstall {info.distribution}   or: pip uninstall {info.distribution}"
            yield Finding(Level.BROKEN, subject, f"{info.distribution} {info.version} cannot be loaded: {cause}", fix)


def names(catalog: Catalog) -> Iterator[Finding]:
    """Say which names are given twice, and what cannot be read at all."""
    clean = True
    for kind, read in _pools(catalog):
        try:
            read(kind)
        except BenchbotError as error:
            clean = False
            yield Finding(Level.BROKEN, kind.replace("_", " "), f"{error.title} {error.why}", error.fix)
    if clean:
        yield Finding(Level.OK, "names", "no two plug-ins use the same one")


def declarations(catalog: Catalog) -> Iterator[Finding]:
    """Say which declarations are not valid."""
    for kind, noun in KINDS.items():
        try:
            pool = catalog.pool(kind)
        except BenchbotError:
            continue  # `names` has said it
        problems = [
            problem
            for declaration in pool.values()
            for problem in schema.problems(declaration.data, noun, declaration.path)
        ]
        for problem in problems:
            yield Finding(Level.BROKEN, noun, str(problem), f"Mend it, then run: benchbot check {problem.path}")
        if not problems:
            yield Finding(Level.OK, kind, f"{len(pool)} declared")


def simulators(loaded: plugins.Plugins, *, warm: bool) -> Iterator[Finding]:
    """Say which simulators there are; `warm` has each prepare its caches, which also proves that it can start."""
    try:
        pool = loaded.pool("simulators")
    except BenchbotError:
        return  # `names` has said it
    if not pool:
        fix = "Install one: pip install benchbot-sim-taichi"
        yield Finding(Level.WARNING, "simulators", "none is installed: only real robots can be used", fix)
    for name, provided in sorted(pool.items()):
        simulator: hookspecs.Simulator = provided.value
        subject = f"simulator {name}"
        if not warm or simulator.warm is None:
            hint = "; benchbot doctor --warm starts it" if simulator.warm is not None else ""
            yield Finding(Level.OK, subject, f"{provided.distribution}{hint}")
            continue
        try:
            yield Finding(Level.OK, subject, simulator.warm(resources.cache_dir()))
        # A third party's code, its compiler and its driver may fail in any way at all; that is what is asked here.
        except Exception as error:  # noqa: BLE001
            fix = f"pip install --force-reinstall {provided.distribution}"
            yield Finding(Level.BROKEN, subject, f"it cannot start: {type(error).__name__}: {error}", fix)


def folders() -> Iterator[Finding]:
    """Say whether BenchBot's own folders can be written, and how much room there is."""
    for subject, variable, find in (
        ("cache folder", "BENCHBOT_CACHE_DIR", resources.cache_dir),
        ("state folder", "BENCHBOT_STATE_DIR", resources.state_dir),
        ("data folder", "BENCHBOT_DATA_DIR", resources.data_dir),
    ):
        try:
            folder = find()
            with tempfile.TemporaryFile(dir=folder):
                pass
        except (OSError, BenchbotError) as error:
            detail = error.why if isinstance(error, BenchbotError) else f"{error.filename}: {error.strerror}"
            yield Finding(Level.BROKEN, subject, detail, f"Make it writable, or name another folder in {variable}.")
        else:
            yield _room(subject, folder)


def default_port() -> Iterator[Finding]:
    """Say whether benchbot run can listen where it does by default."""
    from benchbot.supervisor import run_state
    from benchbot.supervisor.backend import DEFAULT_PORT

    subject = f"port {DEFAULT_PORT}"
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", DEFAULT_PORT))
        except OSError as error:
            why = error.strerror
        else:
            yield Finding(Level.OK, subject, "free")
            return
    with suppress(OSError, BenchbotError):  # a state folder that cannot be read: `folders` has said it
        for run in run_state.live():
            if (run.connection.url or "").endswith(f":{DEFAULT_PORT}"):
                yield Finding(Level.OK, subject, f"used by your run of {run.task}; benchbot stop ends it")
                return
    fix = "Run with another port: benchbot run --port 0 …"
    yield Finding(Level.WARNING, subject, f"cannot be used: {why}", fix)


def _pools(catalog: Catalog) -> Iterator[tuple[str, Callable[[str], object]]]:
    yield from ((kind, catalog.plugins.pool) for kind in hookspecs.KINDS)
    yield from ((kind, catalog.pool) for kind in KINDS)


def _room(subject: str, folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free
    detail = f"{folder}, {free / 2**30:.1f} GiB free"
    if free < NO_DISK_BYTES:
        return Finding(Level.BROKEN, subject, detail, "Free some disk space: results cannot be written.")
    if free < LITTLE_DISK_BYTES:
        return Finding(Level.WARNING, subject, detail, "Free some disk space soon.")
    return Finding(Level.OK, subject, detail)
