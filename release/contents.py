"""What has to be in a wheel, and what must not."""

import configparser
import os
from collections.abc import Iterator
from pathlib import Path

from release.building import Built

SCRIPTS = frozenset({
    "benchbot", "benchbot-stop",
    "benchbot_batch", "benchbot_eval", "benchbot_install", "benchbot_run", "benchbot_submit",
})  # fmt: skip
LARGEST_BYTES = 100_000_000
"""What PyPI takes, for one file: https://docs.pypi.org/project-management/storage-limits/"""

_PASSED_OVER = {"__pycache__"}


def problems(built: Built) -> Iterator[str]:
    """Yield what is wrong with the files of a wheel."""
    files = built.files()
    expected = set(_sources(built))
    there = {name for name in files if ".dist-info/" not in name}
    yield from (f"{name} is in the checkout and not in the wheel" for name in sorted(expected - there))
    yield from (f"{name} is in the wheel and not in the checkout" for name in sorted(there - expected))
    yield from (f"{name} is a test" for name in sorted(there) if "tests" in Path(name).parts[:2])
    for package in built.project.packages:
        if f"{package.name}/py.typed" not in there:
            yield f"{package.name} has no py.typed"
    if not built.of_info("licenses/LICENSE"):
        yield "the licence is missing"
    for archive in (built.wheel, built.sdist):
        if archive.stat().st_size > LARGEST_BYTES:
            yield f"{archive.name} is larger than PyPI allows"
    yield from _entry_points(built)


def _sources(built: Built) -> Iterator[str]:
    for package in built.project.packages:
        # The schemas lie at the top of the tree, and the package holds a link to them.
        for folder, _, names in os.walk(package, followlinks=True):
            for path in (Path(folder, name) for name in names):
                if not _PASSED_OVER & set(path.parts):
                    yield path.relative_to(package.parent).as_posix()


def _entry_points(built: Built) -> Iterator[str]:
    points = configparser.ConfigParser(delimiters="=")
    points.read_string(built.of_info("entry_points.txt").decode())
    if not points.has_section("benchbot"):
        yield "there is no entry point in the group benchbot"
    scripts = set(points["console_scripts"]) if points.has_section("console_scripts") else set()
    wanted = SCRIPTS if built.project.name == "benchbot" else frozenset()
    if scripts != wanted:
        yield f"its commands are {sorted(scripts)}, not {sorted(wanted)}"
    modules = {name.removesuffix("/__init__.py").removesuffix(".py").replace("/", ".") for name in built.files()}
    for section in points.sections():
        for name, value in points[section].items():
            if value.partition(":")[0] not in modules:
                yield f"the entry point {name} is {value}, and there is no such module"
