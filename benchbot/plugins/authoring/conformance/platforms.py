"""The conformance of platforms: simulators, and drivers of real robots."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchbot.core.findings import Finding
from benchbot.core.platform import Localisation, Platform
from benchbot.core.records import RobotDriver, Simulator
from benchbot.plugins.authoring.conformance import driving, leaks, repeating, seeing, starting
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, Declared, bench_of
from benchbot.plugins.authoring.conformance.properties import look

Property = Callable[[Bench, Platform], str]

ALWAYS: tuple[tuple[str, Property], ...] = (
    ("members", starting.has_every_member),
    ("control period", starting.ticks_sensibly),
    ("clean start", starting.starts_clean),
    ("rigid poses", starting.poses_are_rigid),
    ("rest", starting.rests_where_it_is),
    ("observe: what was asked", seeing.returns_what_is_asked),
    ("observe: one instant", seeing.is_of_one_instant),
    ("observe: frames", seeing.declares_its_frames),
    ("observe: left alone", seeing.stays_as_it_was),
    ("drive: straight", driving.drives_straight),
    ("drive: turns", driving.turns_left),
    ("drive: time", driving.keeps_time),
    ("drive: limits", driving.keeps_its_limits),
    ("drive: actions", driving.reaches_goals),
)
SIMULATED: tuple[tuple[str, Property], ...] = (
    ("drive: contact", driving.stops_at_contact),
    ("seeds: repeated", repeating.repeats_itself),
    ("seeds: another", repeating.seeds_change_nothing_else),
    ("many cameras", repeating.twins_see_the_same),
)
LAST: tuple[tuple[str, Property], ...] = (
    ("close", starting.closes_twice),
    ("halt", starting.halts_when_told),
)


def check_simulator(
    simulator: Simulator | str,
    robot: Declared,
    environment: Declared,
    *,
    localisation: Localisation = "ground_truth",
    cache_dir: Path | None = None,
) -> list[Finding]:
    """Return what a simulator does and does not as `benchbot.core.platform` asks, with one robot in one environment.

    All are given by name, or as they are declared. The robot needs half a metre of room ahead of its start or behind
    it, and something to hit within a minute straight ahead. `cache_dir` may hold compiled kernels.
    """
    record = _installed("simulators", simulator) if isinstance(simulator, str) else simulator
    bench = bench_of(record.create, robot, environment, localisation, cache_dir)
    return _look(bench, (*ALWAYS, *SIMULATED), LAST)


def check_robot_driver(
    driver: RobotDriver | str,
    robot: Declared,
    environment: Declared,
    *,
    position_tolerance_m: float = 0.05,
    angle_tolerance_rad: float = 0.1,
    cache_dir: Path | None = None,
) -> list[Finding]:
    """Return what a driver does and does not as `benchbot.core.platform` asks. THE ROBOT MOVES.

    By 0.2 m ahead or back and by 30 degrees; nothing is hit on purpose. It is to stand at the environment's start pose;
    what the operator is asked is printed. Tolerances are of what localisation tells.
    """
    record = _installed("robot_drivers", driver) if isinstance(driver, str) else driver
    bench = bench_of(
        record.create,
        robot,
        environment,
        "ground_truth",
        cache_dir,
        real=True,
        position_tolerance_m=position_tolerance_m,
        angle_tolerance_rad=angle_tolerance_rad,
    )
    return _look(bench, ALWAYS, LAST)


def _look(
    bench: Bench, properties: tuple[tuple[str, Property], ...], last: tuple[tuple[str, Property], ...]
) -> list[Finding]:
    made: list[Platform] = []

    def create() -> str:
        made.append(bench.create(bench.spec))
        return str(bench.spec.robot["name"])

    findings = [look("create", create)]
    if not made:
        return findings
    platform = made[0]
    try:
        findings += [look(name, partial(holds, bench, platform)) for name, holds in properties]
        findings += seeing.look_at_channels(bench, platform)
        findings.append(look("nothing left", lambda: leaks.leaves_nothing(partial(_use, bench))))
        findings += [look(name, partial(holds, bench, platform)) for name, holds in last]
    finally:
        findings.append(look("close at the end", partial(_close, platform)))
    return findings


def _close(platform: Platform) -> str:
    platform.close()
    return "closed"


def _use(bench: Bench) -> None:
    with bench.fresh() as platform:
        platform.load(bench.scene, SEED)
        platform.observe(bench.channels)
        platform.drive(0.0, 0.0, platform.control_period_s)


def _installed(kind: str, name: str) -> Simulator | RobotDriver:
    from benchbot.core.plugin_manager import load

    record: Simulator | RobotDriver = load().record(kind, name)
    return record
