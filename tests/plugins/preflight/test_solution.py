"""The code of a solution is read by its own interpreter, and never run."""

import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from benchbot.cli.kit.holding import CONTAINER, NATIVE
from benchbot.cli.kit.preflight import Intent, Submission
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.plugin_manager import load
from benchbot.plugins.preflight.solution import find
from benchbot.submission.modes import SolutionSpec

PYTHON = sys.executable


def looked_at(folder: Path, *command: str, executor: str | None = None, mode: str = NATIVE) -> list[Finding]:
    submission = Submission(SolutionSpec(list(command), folder), mode)
    return list(find(Catalog(load()), Intent(submissions=[submission], executor=executor)))


def test_what_is_fine_is_said_to_be(tmp_path: Path) -> None:
    (tmp_path / "s.py").write_text(
        '"""It."""\nfrom __future__ import annotations\nimport json, numpy\nopen("ran", "w")\n'
    )
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "__init__.py").write_text('open("ran", "w")\n')
    (tmp_path / "package" / "__main__.py").write_text('open("ran", "w")\n')
    (tmp_path / "run.sh").write_text("exit 1\n")

    with ZipFile(tmp_path / "app.pyz", "w") as archive:
        archive.writestr("__main__.py", "")

    for command in (
        [PYTHON, "s.py"],
        [PYTHON, "app.pyz"],
        [PYTHON, "-W", "ignore", "-um", "package"],
        ["bash", "run.sh"],
        ["true"],
    ):
        assert [finding.level for finding in looked_at(tmp_path, *command)] == [Level.OK]
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("import no_such_module_xyz", "'no_such_module_xyz'"),
        ("from no_such_module_xyz.inner import a", "'no_such_module_xyz'"),
        ("def (", "s.py:1: invalid syntax"),
        ("\n  x = 1", "s.py:2: unexpected indent"),
        ("\0", "s.py:"),
    ],
)
def test_code_that_cannot_begin_is_refused(source: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "s.py").write_text(source)

    (finding,) = looked_at(tmp_path, PYTHON, "s.py")

    assert finding.level is Level.BROKEN
    assert said in finding.detail


@pytest.mark.parametrize(
    "source",
    [
        "import sys\nsys.path.insert(0, 'elsewhere')\nimport no_such_module_xyz",
        "import paths\nimport no_such_module_xyz",
        "try:\n    import no_such_module_xyz\nexcept ImportError:\n    pass",
        "if False:\n    import no_such_module_xyz",
        "from . import sibling",
    ],
)
def test_an_import_that_may_succeed_when_it_is_reached_is_not_judged(source: str, tmp_path: Path) -> None:
    (tmp_path / "s.py").write_text(source)
    (tmp_path / "paths.py").write_text("import sys\nsys.path.insert(0, 'elsewhere')\n")

    assert [finding.level for finding in looked_at(tmp_path, PYTHON, "s.py")] == [Level.OK]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([PYTHON, "-m", "no_such_module_xyz"], "no module no_such_module_xyz"),
        ([PYTHON, "-m", "json.nothing"], "no module json.nothing"),
        ([PYTHON, "-m", "json"], "without a module __main__"),
        ([PYTHON, "none.py"], "There is no"),
        (["bash", "none.sh"], "There is no"),
        (["./none"], "is not there"),
        (["./s.py"], "may not be executed"),
        (["no_such_program_xyz"], "is not there"),
    ],
)
def test_a_command_that_cannot_begin_is_refused(command: list[str], said: str, tmp_path: Path) -> None:
    (tmp_path / "s.py").write_text("")

    (finding,) = looked_at(tmp_path, *command)

    assert finding.level is Level.BROKEN
    assert said in finding.detail
    assert finding.fix


def test_nodes_of_a_cluster_may_have_what_is_not_here(tmp_path: Path) -> None:
    (tmp_path / "s.py").write_text("import no_such_module_xyz")

    assert [finding.level for finding in looked_at(tmp_path, PYTHON, "s.py", executor="slurm")] == [Level.WARNING]
    assert [finding.level for finding in looked_at(tmp_path, PYTHON, "s.py", executor="local")] == [Level.BROKEN]


def test_what_runs_in_a_container_is_not_looked_for_here(tmp_path: Path) -> None:
    assert looked_at(tmp_path, "none.py", mode=CONTAINER) == []
