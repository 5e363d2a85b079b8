"""What `benchbot doctor --robot` looks at: a real robot, by the eyes of its driver."""

from collections.abc import Iterator

from benchbot.core import records, resources
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.platform import PlatformSpec


def diagnose_robot(catalog: Catalog, name: str) -> Iterator[Finding]:
    """Yield what a robot's driver finds; raises BenchbotError for a robot that nothing can look at."""
    robot = catalog.get("robots", name)
    distribution, driver = _driver(catalog, name, robot.data["type"])
    if driver.diagnose is None:
        raise BenchbotError(
            f"The robot '{name}' cannot be looked at.",
            f"Its driver '{driver.name}' ({distribution}) offers no diagnosis.",
            f"Try it in a run, whose log says what goes wrong: benchbot run --robot {name} …",
        )
    try:
        yield from driver.diagnose(PlatformSpec(robot.data, "ground_truth", resources.cache_dir()))
    except BenchbotError as error:
        yield Finding(Level.BROKEN, f"robot {name}", f"{error.title} {error.why}", error.fix)
    # A third party's code, its middleware and the robot may fail in any way at all; that is what is asked here.
    except Exception as error:  # noqa: BLE001
        fix = f"Report it to the author of {distribution}."
        yield Finding(Level.BROKEN, f"robot {name}", f"its diagnosis failed: {type(error).__name__}: {error}", fix)


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
