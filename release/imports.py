"""Whether each distribution says what it needs: every import in its sources, against its requirements."""

import ast
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from release.projects import Project

OPTIONAL: dict[str, dict[str, str]] = {
    "benchbot": {
        "IPython": "the notebook that a solution runs in has it",
        "pytest": "only pytest reads its plug-in",
        "stable_baselines3": "whoever trains with it has it; without it, an error says how to install it",
        "torch": "who asks for its tensors has the build for their GPU; without it, an error says so",
    },
    "benchbot-baselines": {"torch": "only who trains needs it; without it, an error says how to install it"},
    "benchbot-replay": {
        "benchbot_robot_ros2": "without it, an error says that bags need it",
        "rclpy": "benchbot_robot_ros2 brings it",
    },
    "benchbot-robot-ros2": {
        "nav2_msgs": "not on PyPI; without it, an error says which package of ROS brings it",
        "tf2_msgs": "not on PyPI; without it, there are no transforms",
    },
    "benchbot-scenes": {
        "benchbot_sim_taichi": "without it, the report of an import has no ray-traced pictures",
    },
    "benchbot-sim-taichi": {"torch": "only who asks for its tensors comes there, and has it"},
}
"""Distribution to imports that it goes without where they are missing, and why that is right."""


def problems(project: Project, siblings: Sequence[Project]) -> Iterator[str]:
    """Yield the imports of what neither a project nor anything required by it or by one of its extras brings."""
    packages = {package.name: one.name for one in siblings for package in one.packages}
    brought = _required(project, {one.name: one for one in siblings})
    for package in project.packages:
        for path in sorted(package.rglob("*.py")):
            for name, line in _imported(path):
                if name in sys.stdlib_module_names or name in OPTIONAL.get(project.name, {}):
                    continue
                givers = {packages[name]} if name in packages else _givers().get(name, set())
                if not givers & brought:
                    by = f", which {' or '.join(sorted(givers))} brings" if givers else ""
                    yield f"{path.relative_to(project.folder)}:{line} imports {name}{by}: nothing requires it"


def _required(project: Project, siblings: Mapping[str, Project]) -> set[str]:
    """Return a project's name and those of all that it requires, with all of its own extras."""
    found: set[tuple[str, str]] = set()
    left = {(project.name, ""), *((project.name, extra) for extra in project.extras)}
    while left:
        name, extra = left.pop()
        found.add((name, extra))
        for requirement in _requirements(name, extra, siblings):
            needed = canonicalize_name(requirement.name)
            left |= {(needed, ""), *((needed, one) for one in requirement.extras)} - found
    return {name for name, _ in found}


def _requirements(name: str, extra: str, siblings: Mapping[str, Project]) -> list[Requirement]:
    """Return what a distribution requires, or one of its extras; an empty `extra` stands for none."""
    if name in siblings:
        return siblings[name].extras[extra] if extra else siblings[name].requirements
    try:
        texts = requires(name) or []
    except PackageNotFoundError:  # of another system
        return []
    requirements = map(Requirement, texts)
    return [one for one in requirements if one.marker is None or one.marker.evaluate({"extra": extra})]


@cache
def _givers() -> dict[str, set[str]]:
    return {name: {canonicalize_name(one) for one in givers} for name, givers in packages_distributions().items()}


def _imported(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the first parts of the names of the modules that a file imports anywhere, but for types alone."""
    tree = ast.parse(path.read_text("utf-8"))
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name.partition(".")[0], node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.partition(".")[0], node.lineno
