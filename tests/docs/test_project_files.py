"""The files for those who work on the project, or cite it: they name commands, paths and papers that exist."""

import os
import re
import shlex
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from docs.tools.links import targets
from tests.docs.blocks import ROOT

TEMPLATES = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.md"))


def read(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text("utf-8"))


def typed(command: str) -> list[str]:
    """Return what a command of make would run, besides what it installs."""
    program, *arguments = shlex.split(command)
    # These tests are run by make themselves, which would have it tell of folders.
    variables = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    words = [program, "--dry-run", *arguments]
    told = subprocess.run(words, cwd=ROOT, env=variables, capture_output=True, text=True, check=True)
    return told.stdout.replace("\\\n", "").splitlines()


def test_a_commit_passes_what_make_lint_runs_and_installs_nothing() -> None:
    (repository,) = read(".pre-commit-config.yaml")["repos"]
    (hook,) = repository["hooks"]
    run = typed(hook["entry"])

    assert repository["repo"] == "local"
    assert [shlex.split(line)[0] for line in run] == [
        f".venv/bin/{tool}" for tool in ("ruff", "ruff", "lint-imports", "mypy")
    ]
    assert typed("make --no-print-directory lint")[-len(run) :] == run


def test_the_workflow_calls_what_ci_runs_on_linux_and_macos() -> None:
    runs = read(".github/workflows/ci.yml")["jobs"]["tests"]["strategy"]["matrix"]["include"]

    assert {run["system"].partition("-")[0] for run in runs} == {"ubuntu", "macos"}
    for run in runs:
        assert (ROOT / shlex.split(run["command"])[-1]).samefile(ROOT / ".ci" / "run")


def test_the_quick_tests_are_folders_and_files_that_exist() -> None:
    arguments = shlex.split(typed("make --old-file=.venv/.installed-test test-quick")[-1])
    chosen = [Path(argument) for argument in arguments if argument.startswith("tests")]

    assert Path("tests/core") in chosen
    assert all((ROOT / path).exists() for path in chosen)


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_an_issue_template_has_what_the_list_of_them_shows(template: Path) -> None:
    _, head, body = template.read_text("utf-8").split("---\n", 2)

    assert yaml.safe_load(head).keys() == {"name", "about", "labels"}
    assert body.strip()


def test_what_the_security_page_rests_on_is_there() -> None:
    links = [target.partition("#")[0] for target in targets((ROOT / "SECURITY.md").read_text("utf-8"))]

    assert [link for link in links if not (ROOT / link).is_file()] == []
    assert {"docs/sandbox.md", "docs/attacks.md"} <= set(links)


def test_the_citation_names_the_papers_that_the_readme_names() -> None:
    citation = read("CITATION.cff")
    readme = (ROOT / "README.md").read_text("utf-8")

    assert {paper["doi"] for paper in citation["references"]} == set(re.findall(r"https://doi\.org/([^)\s]+)", readme))
    assert citation["preferred-citation"]["url"] == "https://arxiv.org/abs/2008.00635"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert citation["abstract"] == project["description"]
    assert citation["license"] == project["license"]
