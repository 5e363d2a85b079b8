"""The distributions as they would be uploaded, built from this checkout."""

import shutil
from pathlib import Path

import pytest

from benchbot.plugins.authoring.scaffold.render import create
from release import contents, environments, imports, metadata, smoke
from release.building import Built, build, differences_by_sdist
from release.projects import ROOT, Project, projects

pytestmark = pytest.mark.xdist_group("release")  # all look at the same wheels, which are built once
CHANGELOG = ROOT / "CHANGELOG.md"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Built]:
    folder = tmp_path_factory.mktemp("dist")
    return {project.name: build(project, folder) for project in projects()}


@pytest.fixture
def faulty(tmp_path: Path) -> Project:
    """A project that builds, and that nobody should upload."""
    folder = create("task", "benchbot-faulty", tmp_path)
    package = folder / "src" / "benchbot_faulty"
    (package / "py.typed").unlink()
    (package / "more.py").write_text("import numpy as np\nimport no_such_thing\n")
    (package / "tests").mkdir()
    (package / "tests" / "test_it.py").touch()
    description = (folder / "pyproject.toml").read_text()
    for right, wrong in (
        ('"benchbot>=0.1,<0.2"', '"benchbot>=99", "benchbot-nothing"'),
        ("benchbot_faulty.plugin", "benchbot_faulty.plug_in"),
        ('readme = "README.md"', 'readme = {text = "= Title =", content-type = "text/plain"}'),
        ("[tool.hatch.build.targets.wheel]", '[tool.hatch.build.targets.wheel]\nexclude = ["*.yaml"]'),
    ):
        assert right in description
        description = description.replace(right, wrong)
    (folder / "pyproject.toml").write_text(description)
    return next(iter(projects(folder)))


def test_every_plug_in_is_among_them(built: dict[str, Built]) -> None:
    assert set(built) == {"benchbot"} | {f"benchbot-{path.name.replace('_', '-')}" for path in _plugins()}


def _plugins() -> list[Path]:
    return [path.parent for path in ROOT.glob("plugins/*/pyproject.toml")]


def test_they_can_be_uploaded(built: dict[str, Built]) -> None:
    every = list(built.values())

    wrong = {name: [*contents.problems(one), *metadata.problems(one, every)] for name, one in built.items()}

    assert wrong == {name: [] for name in built}
    assert list(metadata.problems_together(every, CHANGELOG, final=False)) == []


def test_they_require_what_they_import() -> None:
    every = projects()

    assert [f"{one.name}: {problem}" for one in every for problem in imports.problems(one, every)] == []


def test_an_sdist_makes_the_same_wheel(built: dict[str, Built]) -> None:
    assert {name: list(differences_by_sdist(one)) for name, one in built.items()} == {name: [] for name in built}


def test_benchbot_alone_works_outside_of_the_checkout(built: dict[str, Built], tmp_path: Path) -> None:
    environment = environments.create(tmp_path / "venv")
    (tmp_path / "home").mkdir()
    core = built["benchbot"]

    environment.install_alone(core.wheel)

    assert smoke.try_alone(environment, tmp_path / "home", core.version) == []
    assert not list(environment.packages.glob("benchbot_*.dist-info"))


def test_a_faulty_one_is_found_out(faulty: Project, built: dict[str, Built], tmp_path: Path) -> None:
    one = build(faulty, tmp_path)

    found = [*contents.problems(one), *metadata.problems(one, [built["benchbot"], one])]
    found += imports.problems(faulty, [faulty, built["benchbot"].project])

    for problem in (
        "benchbot_faulty/tasks/faulty.yaml is in the checkout and not in the wheel",
        "benchbot_faulty/tests/test_it.py is a test",
        "benchbot_faulty has no py.typed",
        "the licence is missing",
        "the entry point faulty is benchbot_faulty.plug_in, and there is no such module",
        "License-Expression is missing",
        "the README is not said to be Markdown",
        f"it needs benchbot>=99, and the version that is made here is {built['benchbot'].version}",
        "it needs benchbot-nothing, which is not made here",
        "src/benchbot_faulty/more.py:2 imports no_such_thing: nothing requires it",
    ):
        assert problem in found


def test_an_sdist_that_lacks_something_is_found_out(tmp_path: Path) -> None:
    folder = create("evaluator", "lacking", tmp_path)
    with (folder / "pyproject.toml").open("a") as file:
        file.write('\n[tool.hatch.build.targets.sdist]\nexclude = ["scoring.py"]\n')

    assert list(differences_by_sdist(build(projects(folder)[0], tmp_path))) == [
        "lacking-0.1.0.dist-info/RECORD",
        "lacking/scoring.py",
    ]


@pytest.mark.parametrize(
    ("headings", "final", "said"),
    [
        ("## Unreleased", False, ""),
        ("## Unreleased", True, "begins with 'Unreleased': call it '{version}', with the date"),
        ("## {version} - 2026-11-22", True, ""),
        ("## [{version}] - 2026-11-22\n## 0.0.1", True, ""),
        ("## Unreleased\n## {version} - 2026-11-22", False, "{version} is released already, says"),
        ("## 99.0.0 - 2026-11-22", True, "begins with 99.0.0, and the version is {version}"),
        ("# Changes", False, "has no heading of a version"),
    ],
)
def test_the_changelog_and_the_version_agree(
    headings: str, final: bool, said: str, built: dict[str, Built], tmp_path: Path
) -> None:
    version = built["benchbot"].version
    changelog = tmp_path / "CHANGELOG.md"
    changelog.write_text(headings.format(version=version))

    found = list(metadata.problems_together(list(built.values()), changelog, final=final))

    assert [said.format(version=version) in problem for problem in found] == ([True] if said else [])


def test_this_python_is_among_those_that_are_tried() -> None:
    found = environments.interpreters()

    assert found
    assert set(found) <= set(environments.PYTHONS)
    assert all(shutil.which(python) for python in found.values())
