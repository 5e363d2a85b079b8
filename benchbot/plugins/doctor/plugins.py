"""Plug-ins: whether they load, their names and declarations, whether simulators start, and real robots by drivers."""

from collections.abc import Callable, Iterator

from benchbot.cli.kit import console
from benchbot.core import hookspecs, plugin_manager, records, resources
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.diagnosis import diagnose
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.platform import PlatformSpec


def installed(loaded: plugin_manager.Plugins) -> Iterator[Finding]:
    """Say which plug-ins are installed, and why some cannot be loaded."""
    broken = {(item.info.distribution, item.info.name): item.cause for item in loaded.broken}
    for info in plugin_manager.installed():
        subject = f"plug-in {info.name}"
        cause = broken.get((info.distribution, info.name))
        if cause is None:
            yield Finding(Level.OK, subject, f"{info.distribution} {info.version}")
        else:
            fix = f"pip install --force-reinstall {info.distribution}   or: benchbot uninstall {info.distribution}"
            yield Finding(Level.BROKEN, subject, f"{info.distribution} {info.version} cannot be loaded: {cause}", fix)


def names(catalog: Catalog) -> Iterator[Finding]:
    """Say which names are given twice, and what cannot be read at all."""
    clean = True
    readers: list[tuple[str, Callable[[str], object]]] = [(kind, catalog.plugins.pool) for kind in hookspecs.KINDS]
    readers += [(kind, catalog.pool) for kind in KINDS]
    for kind, read in readers:
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
            continue  # `names` reports it
        problems = [
            problem
            for declaration in pool.values()
            for problem in schema.problems(declaration.data, noun, declaration.path)
        ]
        for problem in problems:
            yield Finding(Level.BROKEN, noun, str(problem), f"Mend it, then run: benchbot check {problem.path}")
        if not problems:
            yield Finding(Level.OK, kind, f"{len(pool)} declared")


def simulators(loaded: plugin_manager.Plugins, *, warm: bool) -> Iterator[Finding]:
    """Say which simulators there are; `warm` has each prepare its caches, which also proves that it can start."""
    try:
        pool = loaded.pool("simulators")
    except BenchbotError:
        return  # `names` reports it
    if not pool:
        fix = "Install one: benchbot install benchbot-sim-taichi"
        yield Finding(Level.WARNING, "simulators", "none is installed: only real robots can be used", fix)
    for name, provided in sorted(pool.items()):
        simulator: records.Simulator = provided.value
        subject = f"simulator {name}"
        if not warm or simulator.warm is None:
            hint = "; benchbot doctor --warm starts it" if simulator.warm is not None else ""
            yield Finding(Level.OK, subject, f"{provided.distribution}{hint}")
            continue
        console.note(
            f"Starts {name} and fills its cache: about a minute where nothing is in it yet, seconds otherwise."
        )
        try:
            yield Finding(Level.OK, subject, simulator.warm(resources.cache_dir()))
        # A third party's code, its compiler and its driver may fail in any way at all, which this check finds out.
        except Exception as error:  # noqa: BLE001
            fix = f"pip install --force-reinstall {provided.distribution}"
            yield Finding(Level.BROKEN, subject, f"it cannot start: {type(error).__name__}: {error}", fix)


def diagnose_robot(catalog: Catalog, name: str) -> Iterator[Finding]:
    """Yield what a real robot's driver finds; raises BenchbotError for a robot without a diagnosis."""
    robot = catalog.get("robots", name)
    distribution, driver = _driver(catalog, name, robot.data["type"])
    if driver.diagnose is None:
        raise BenchbotError(
            f"The robot '{name}' cannot be looked at.",
            f"Its driver '{driver.name}' ({distribution}) offers no diagnosis.",
            f"Try it in a run, whose log says what goes wrong: benchbot run --robot {name} …",
        )
    yield from diagnose(driver, distribution, PlatformSpec(robot.data, "ground_truth", resources.cache_dir()))


def _driver(catalog: Catalog, name: str, kind: str) -> tuple[str, records.RobotDriver]:
    """Return the driver of a robot and the distribution that it comes from."""
    drivers = catalog.plugins.pool("robot_drivers")
    if kind in drivers:
        driver: records.RobotDriver = drivers[kind].value
        return drivers[kind].distribution, driver
    if kind in catalog.plugins.pool("simulators"):
        raise BenchbotError(
            f"The robot '{name}' is simulated.",
            f"It runs on the simulator '{kind}': there is no hardware to look at.",
            "Look at the simulators of this machine: benchbot doctor --warm",
        )
    raise BenchbotError(
        f"No driver for the robot '{name}' is installed.",
        f"It is of type '{kind}'. Installed drivers: {', '.join(sorted(drivers)) or 'none'}."
        f"{catalog.plugins.broken_hint()}",
        f"Install it: benchbot install benchbot-robot-{kind.replace('_', '-')}",
    )
