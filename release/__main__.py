"""`python -m release`: build everything, look at it, install it elsewhere, try it."""

import argparse
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from release import contents, environments, imports, metadata, smoke
from release.building import Built, build, differences_by_sdist
from release.projects import ROOT, projects

ALL_EXTRAS = "full,gym,mcap,ray,rerun,ros2,slurm,video,viz,web"


def main() -> int:
    """Return 0 when the distributions can be uploaded."""
    parser = argparse.ArgumentParser(prog="python -m release", description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "dist", metavar="DIR", help="where they are left")
    parser.add_argument("--final", action="store_true", help="the changelog must have a heading of this version")
    parser.add_argument("--try", dest="tried", choices=("none", "alone", "full"), default="full", help="what is tried")
    parser.add_argument("--python", action="append", metavar="X.Y", help="only these; by default all that are found")
    asked = parser.parse_args()
    built = build_all(asked.output)
    problems = {one.project.name: look_at(one, built) for one in built}
    problems["all of them"] = [*metadata.problems_together(built, ROOT / "CHANGELOG.md", final=asked.final)]
    relative = sum(len(metadata.relative_links(one)) for one in built)
    if relative:
        print(f"note: {relative} links in READMEs are relative to the repository and lead nowhere on PyPI")
    if asked.tried != "none":
        found = environments.interpreters()
        wanted = asked.python or environments.PYTHONS
        for version in wanted:
            if version not in found:
                print(f"note: Python {version} is not on this machine: not tried")
        for version in (version for version in wanted if version in found):
            problems |= try_on(version, found[version], built, full=asked.tried == "full")
    for name, wrong in problems.items():
        print(f"{name}: {'ok' if not wrong else ''}")
        for problem in wrong:
            print(f"  {problem}")
    return 1 if any(problems.values()) else 0


def build_all(folder: Path) -> list[Built]:
    """Build every distribution into a folder, which is emptied of former ones."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in [*folder.glob("benchbot*.whl"), *folder.glob("benchbot*.tar.gz")]:
        path.unlink()
    return [build(project, folder) for project in projects()]


def look_at(one: Built, all_built: list[Built]) -> list[str]:
    """Return what is wrong with a distribution as it is."""
    wrong: Iterable[str] = differences_by_sdist(one)
    return [
        *contents.problems(one),
        *metadata.problems(one, all_built),
        *imports.problems(one.project, [other.project for other in all_built]),
        *(f"{name} is another one in the wheel that the sdist makes" for name in wrong),
    ]


def try_on(version: str, python: str, built: list[Built], *, full: bool) -> dict[str, list[str]]:
    """Return what is wrong with installations on one Python: of benchbot alone and, if asked, with all plug-ins."""
    core, *others = built
    problems: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory(prefix="benchbot-release-") as temporary:
        for kind in ("alone", "full") if full else ("alone",):
            folder = Path(temporary, kind)
            folder.mkdir()
            environment = environments.create(folder / "venv", python)
            (folder / "home").mkdir()
            print(f"Python {version}, {kind}: installing and trying …", flush=True)
            if kind == "alone":
                environment.install([core.wheel])
                wrong = smoke.try_alone(environment, folder / "home", core.version)
            else:
                environment.install([core.wheel, *(one.wheel for one in others)], extra=ALL_EXTRAS)
                wrong = smoke.try_full(environment, folder / "home")
            problems[f"Python {version}, {kind}"] = wrong
    return problems


if __name__ == "__main__":
    sys.exit(main())
