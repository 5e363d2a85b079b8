"""Which files make a solution what it is."""

from pathlib import Path

import pytest

from benchbot.plugins.batch import source_files
from benchbot.plugins.batch.source_files import find

TREE = (
    *("run.py", "mapping/__init__.py", "mapping/models/net.py", "tools/plot.py", "notes.txt", "mapping/weights.bin"),
    *(".git/hooks/x.py", ".venv/lib/y.py", "env/pyvenv.cfg", "env/lib/z.py", "mapping/__pycache__/c.py"),
    *("batch-0123abcd/plan.json", "batch-0123abcd/episodes/e/written.py", "env2/lib/site-packages/p.py"),
)
SOURCES = {"run.py", "mapping/__init__.py", "mapping/models/net.py", "tools/plot.py"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a solution that is a package, with all that gathers in such folders."""
    for name in TREE:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("python run.py", SOURCES),
        ("python ./run.py --weights mapping/weights.bin", {*SOURCES, "./run.py", "mapping/weights.bin"}),
        ("python -m mapping", SOURCES),
        ("python -u -m mapping.models.net", SOURCES),
        ("python mapping/models/net.py", {"mapping/models/net.py"}),
        ("python -m elsewhere", set()),
        ("true", set()),
    ],
)
def test_what_python_may_import_counts_and_what_gathers_beside_it_does_not(
    words: str, found: set[str], folder: Path
) -> None:
    assert set(find(words.split(), folder).hashes) == found


def test_the_files_are_told_with_their_number(folder: Path) -> None:
    (folder / "mapping" / "models" / "net.py").unlink()
    told = find(["python", "run.py"], folder).text
    assert told == "3 files of the solution are part of the keys: run.py, mapping/__init__.py, tools/plot.py"


def test_a_folder_of_everything_is_not_searched_and_it_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_files, "FILES_LIMIT", 3)
    found = find(["python", "run.py"], folder)
    assert set(found.hashes) == {"run.py"}
    assert found.unread == (str(folder),)
    assert "put the solution into one of its own" in found.text


def test_a_solution_without_files_says_so(folder: Path) -> None:
    assert find(["true"], folder).text.startswith("No file of the solution is part of the keys")
