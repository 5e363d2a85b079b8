"""What `benchbot new` can make."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A kind of project: what it is, what it needs, where to look first. `{package}` stands for the package's name."""

    name: str
    summary: str
    dependencies: tuple[str, ...]
    schemas: tuple[str, ...]
    commands: tuple[str, ...]
    places: tuple[tuple[str, str], ...]


_PLUGIN = ("src/{package}/plugin.py", "the hooks that BenchBot finds")

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "plugin",
            "A plug-in for BenchBot that records what solutions do.",
            ("benchbot>=0.1",),
            (),
            ("benchbot submit … --record {package}=FOLDER",),
            (_PLUGIN, ("src/{package}/recording.py", "the recorder: one example of what a plug-in can bring")),
        ),
        Kind(
            "task",
            "A task for BenchBot.",
            ("benchbot>=0.1",),
            ("task",),
            ("benchbot show task {package}",),
            (_PLUGIN, ("src/{package}/tasks/{package}.yaml", "the task: what a solution may observe and do")),
        ),
        Kind(
            "robot",
            "A simulated robot for BenchBot.",
            ("benchbot>=0.1", "benchbot-sim-taichi>=0.1"),
            ("robot",),
            ("benchbot show robot {package}",),
            (_PLUGIN, ("src/{package}/robots/{package}.yaml", "the robot: frames, sensors, size, limits")),
        ),
        Kind(
            "environment",
            "An environment for BenchBot.",
            ("benchbot>=0.1", "benchbot-assets-household>=0.1", "benchbot-scenes>=0.1", "benchbot-sim-taichi>=0.1"),
            ("environment",),
            ("benchbot map --env {package}:1",),
            (
                _PLUGIN,
                ("src/{package}/environments/", "places: where a robot starts and drives, and the light"),
                ("src/{package}/layouts/", "what they are built and furnished with"),
            ),
        ),
        Kind(
            "evaluator",
            "A method of evaluation for BenchBot.",
            ("benchbot>=0.1",),
            (),
            ("benchbot eval RESULT.json --method {package}",),
            (_PLUGIN, ("src/{package}/scoring.py", "the method: one result, and the summary of many")),
        ),
        Kind(
            "simulator",
            "A simulator for BenchBot.",
            ("benchbot>=0.1", "numpy>=2.0"),
            ("robot", "environment"),
            ("benchbot run --task TASK --robot {package}_robot --env {package}_room:1",),
            (
                _PLUGIN,
                ("src/{package}/simulator.py", "the simulator, with all that a platform has to do"),
                ("src/{package}/robots/", "a robot for it"),
                ("src/{package}/environments/", "a place for it"),
            ),
        ),
        Kind(
            "driver",
            "A driver of a real robot for BenchBot.",
            ("benchbot>=0.1",),
            ("robot", "environment"),
            ("benchbot doctor --robot {package}_robot",),
            (
                _PLUGIN,
                ("src/{package}/base.py", "what talks to the robot: put yours here"),
                ("src/{package}/driver.py", "the driver, with all that a platform has to do"),
                ("src/{package}/robots/", "the robot"),
                ("src/{package}/environments/", "the place that it is in"),
            ),
        ),
        Kind(
            "agent",
            "A solution for BenchBot.",
            ("benchbot>=0.1", "numpy>=2.0"),
            ("example",),
            ("benchbot submit --example {package}",),
            (_PLUGIN, ("src/{package}/agent.py", "the solution"), ("src/{package}/examples/", "how it is run by name")),
        ),
    )
}
