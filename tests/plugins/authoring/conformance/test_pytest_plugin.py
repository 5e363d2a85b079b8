"""The fixture `conforms` in real test runs: what is told, and that other runs are left alone."""

import subprocess
import sys
from pathlib import Path

TESTS = """
from benchbot.core.findings import Finding, Level

GOOD = Finding(Level.OK, "rest", "does not move")
ODD = Finding(Level.WARNING, "files", "has none", "Add some.")
BAD = Finding(Level.BROKEN, "drive", "goes backwards", "Turn it round.")

def test_good(conforms):
    conforms([GOOD, ODD])

def test_bad(conforms):
    conforms([GOOD, BAD])

def test_nothing(conforms):
    conforms([])

def test_other():
    assert 1 == 2
"""
PLAIN = """
import sys

def test_light():
    kit = "benchbot.plugins.authoring.conformance.properties"
    heavy = {"numpy", "benchbot.core.plugin_manager", kit, "yaml", "starlette"}
    assert heavy & set(sys.modules) == set()
"""


def run(folder: Path, code: str, *options: str) -> str:
    (folder / "test_it.py").write_text(code)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-p",
            "no:randomly",
            "-p",
            "no:xdist",
            "-p",
            "no:cacheprovider",
            *options,
            ".",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def test_a_report_is_all_there_is_to_read(tmp_path: Path) -> None:
    said = run(tmp_path, TESTS, "-rP")
    assert "3 failed, 1 passed" in said
    assert "One property does not hold.\nok      rest: does not move\nBROKEN  drive: goes backwards\n" in said
    assert "        fix: Turn it round.\n" in said
    assert "Nothing was checked." in said
    assert "properties.py" not in said
    # Other tests fail as they always do, and what was checked can be read of those that pass.
    assert "assert 1 == 2" in said
    assert "warning files: has none" in said


def test_runs_that_do_not_use_it_load_next_to_nothing(tmp_path: Path) -> None:
    assert "1 passed" in run(tmp_path, PLAIN, "-p", "no:hypothesispytest")
