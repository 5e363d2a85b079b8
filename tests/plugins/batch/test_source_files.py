"""Which files make a solution what it is."""

import os
from pathlib import Path

import pytest

import benchbot
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import source_files, source_tree
from benchbot.plugins.batch.source_files import SourceFiles, find

RUN = """\
import os
import os
from pathlib import Path

import numpy
import yaml
from mapping import fusion

HERE = Path(__file__).parent
settings = yaml.safe_load(open("settings.yaml"))
weights = numpy.load(HERE / "weights" / "net.npy")
maps = [HERE / "maps" / name for name in ("a", "b")]
level = open(os.path.join(HERE, f"level_{maps}.txt"))
"""
TREE = {
    "run.py": RUN,
    "settings.yaml": "colours: lists/colours.csv",
    "lists/colours.csv": "red",
    "weights/net.npy": "1",
    "weights/older.npy": "1",
    "maps/a.map": "1",
    "maps/b.map": "1",
    "level_1.txt": "1",
    "mapping/__init__.py": "",
    "mapping/fusion.py": "from . import depth\nfrom .net.layers import Layer",
    "mapping/depth.py": "",
    "mapping/net/__init__.py": "",
    "mapping/net/layers.py": "",
    "mapping/unused.py": "",
    "mapping/__main__.py": "import mapping.unused",
    "scratch.py": "import mapping.unused",
    "notes.txt": "scratch",
    ".git/hooks/x.py": "",
    ".venv/lib/y.py": "",
    "env/pyvenv.cfg": "",
    "env/lib/z.py": "",
    "mapping/__pycache__/c.py": "",
    "batch-0123abcd/plan.json": "",
    "batch-0123abcd/episodes/e/written.py": "",
}
FUSION = {
    "mapping/__init__.py",
    "mapping/fusion.py",
    "mapping/depth.py",
    "mapping/net/__init__.py",
    "mapping/net/layers.py",
}
DATA = {"settings.yaml", "lists/colours.csv", "weights/net.npy", "maps/a.map", "maps/b.map", "level_1.txt"}
SOURCES = {"run.py", *FUSION, *DATA}
ALL_PYTHON = {"run.py", *FUSION, "mapping/unused.py", "mapping/__main__.py", "scratch.py"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a solution with a package and data, and all that gathers in such folders."""
    write(tmp_path, TREE)
    return tmp_path


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def names(found: SourceFiles) -> set[str]:
    return set(found.content.files)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("python run.py", SOURCES),
        ("python ./run.py --weights weights/older.npy", {*SOURCES, "weights/older.npy"}),
        ("python run.py --weights=weights/older.npy", {*SOURCES, "weights/older.npy"}),
        ("python run.py lists weights", {*SOURCES, "weights/older.npy"}),
        ("python -m run", SOURCES),
        ("python -m mapping", {"mapping/__init__.py", "mapping/__main__.py", "mapping/unused.py"}),
        ("python -u -m mapping.fusion", FUSION),
        ("python mapping/depth.py", {"mapping/depth.py"}),
        ("python -m elsewhere", set()),
        ("true", set()),
    ],
)
def test_what_a_solution_imports_and_names_counts_and_what_lies_beside_it_does_not(
    words: str, found: set[str], folder: Path
) -> None:
    assert names(find(words.split(), folder)) == found


def test_a_scratch_file_is_no_other_solution_and_an_edited_helper_or_data_file_is(folder: Path) -> None:
    def now() -> str:
        return find(["python", "run.py"], folder).content.hash

    before = now()
    write(folder, {"scratch.py": "edited", "notes.txt": "edited", "new.py": "", "weights/newer.npy": "2"})
    assert now() == before
    for name in sorted(SOURCES - {"run.py"}):
        write(folder, {name: TREE[name] + "\n"})
        assert now() != before, name
        write(folder, {name: TREE[name]})
        assert now() == before


def test_what_a_file_of_the_solution_is_called_and_where_it_runs_is_part_of_it(folder: Path) -> None:
    here = find(["python", "mapping/depth.py"], folder).content
    beside = find(["python", "../mapping/depth.py"], folder / "lists").content
    assert list(here.files) == list(beside.files) == ["mapping/depth.py"]
    assert (here.folder, beside.folder) == (".", "lists")
    assert here.hash != beside.hash


def test_where_nothing_of_the_solution_lies_it_does_not_matter_where_the_command_is_typed(folder: Path) -> None:
    command = ["python", str(folder / "mapping" / "depth.py"), "--fast"]
    contents = [find(command, folder / name).content for name in ("lists", "weights", "..")]
    assert {content.hash for content in contents[:2]} == {contents[0].hash}
    assert (list(contents[0].files), contents[0].folder) == (["depth.py"], ".elsewhere")
    assert contents[2].folder == "."


@pytest.mark.parametrize(
    ("code", "found"),
    [
        (
            "import importlib\nimportlib.import_module(f'mapping.net.{name}')",
            {"mapping/__init__.py", "mapping/net/__init__.py", "mapping/net/layers.py"},
        ),
        (
            "import importlib\nimportlib.import_module('mapping.' + name)",
            {*FUSION, "mapping/unused.py", "mapping/__main__.py"},
        ),
        ("__import__(name)", {*ALL_PYTHON, *DATA}),
        ("import glob\nglob.glob('*.txt')", {"notes.txt", "level_1.txt"}),
        ("import os\n[n for n in os.listdir() if n.endswith('.txt')]", {"notes.txt", "level_1.txt"}),
        ("open('{}.txt'.format(1))\nprint(d['maps'], {'weights': 1})", {"notes.txt", "level_1.txt"}),
        ('"""See notes.txt."""', set()),
        ("image = f'{name}_{number}.{ending}'", set()),
        ("open('notes.txt', 'w')\nopen('notes.txt', mode='ab')\nnp.save(HERE / 'weights' / 'net.npy', a)", set()),
        ("Path('notes.txt').write_text(open('settings.yaml').read())", {"settings.yaml", "lists/colours.csv"}),
        ("Path('notes.txt').open('w')\nopen('level_1.txt', 'r')", {"level_1.txt"}),
    ],
)
def test_what_is_only_known_at_run_time_counts_as_far_as_it_may_be_meant(
    code: str, found: set[str], folder: Path
) -> None:
    write(folder, {"s.py": code})
    assert names(find(["python", "s.py"], folder)) - {"s.py"} == found


def test_of_what_no_parser_here_understands_all_that_may_be_imported_counts(folder: Path) -> None:
    write(folder, {"s.py": "def f[T](: settings.yaml"})
    assert names(find(["python", "s.py"], folder)) == {"s.py", *ALL_PYTHON, *DATA}


def test_programs_and_scripts_of_a_shell_count_with_the_files_that_they_name(folder: Path) -> None:
    write(
        folder,
        {"go.sh": "cd $(dirname $0) && exec python mapping/depth.py notes.txt", "a.out": "\0lists/colours.csv\0"},
    )
    (folder / "a.out").chmod(0o755)
    assert names(find(["bash", "go.sh"], folder)) == {"go.sh", "mapping/depth.py", "notes.txt"}
    found = find(["./a.out"], folder).content
    assert set(found.files) == {"a.out", "lists/colours.csv"}
    assert found.executable == ("a.out",)


def test_a_script_that_is_a_link_imports_from_beside_what_it_stands_for(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    place = tmp_path_factory.mktemp("bin")
    (folder / "start.py").write_text("import mapping.depth")
    (place / "go.py").symlink_to(folder / "start.py")
    content = find(["python", "go.py"], place).content
    assert {name.split("/")[-1] for name in content.files} == {"go.py", "__init__.py", "depth.py"}
    assert len(content.search) == 1


def test_globs_add_files_and_an_ignore_file_takes_them_away(folder: Path) -> None:
    assert names(find(["python", "run.py"], folder, ["*.txt", "weights"])) == {
        *SOURCES,
        "notes.txt",
        "weights/older.npy",
    }
    write(folder, {".benchbotignore": "maps/\n*.csv\n!keep.csv\n"})
    assert names(find(["python", "run.py"], folder)) == SOURCES - {"maps/a.map", "maps/b.map", "lists/colours.csv"}
    with pytest.raises(BenchbotError, match=r"--source \*\.pt names no file"):
        find(["python", "run.py"], folder, ["*.pt"])


def test_a_package_that_is_being_developed_counts_where_python_finds_it(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path_factory.mktemp("libraries")
    write(elsewhere, {"lib/tools/__init__.py": "import tools.inner", "lib/tools/inner.py": "", "lib/other.py": ""})
    write(
        elsewhere,
        {"venv/pyvenv.cfg": "", "venv/lib/python3.11/site-packages/e.pth": f"{elsewhere}/lib\n", "venv/bin/python": ""},
    )
    write(folder, {"s.py": "import tools, benchbot.api, os"})
    tools = {"tools/__init__.py", "tools/inner.py"}

    def found(python: str) -> set[str]:
        files = find([python, "s.py"], folder)
        assert (len(files.content.search) == 1) == (len(files.content.files) == 3)
        return {name.partition("/lib/")[2] for name in files.content.files if "/lib/" in name}

    assert found("python") == set()
    assert found(str(elsewhere / "venv/bin/python")) == tools
    monkeypatch.setenv("PYTHONPATH", str(elsewhere / "lib"))
    assert found("python") == tools


def test_the_files_are_told_and_those_that_are_none_of_it(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    weights = tmp_path_factory.mktemp("data") / "w.npy"
    weights.touch()
    write(folder, {"mapping/depth.py": f"open({str(weights)!r}); open('/usr/bin/env')"})
    told = find(["python", "mapping/depth.py"], folder / "mapping").lines
    assert (
        told[0] == "No file of the solution is part of the keys: its command names none that is in a folder of its own."
    )
    told = find(["python", "depth.py"], folder / "mapping").lines
    assert told[0] == "1 file of the solution is part of the keys: depth.py"
    assert told[1].startswith(
        "Not part of it, and not there when it runs: __init__.py, __main__.py, fusion.py, unused.py"
    )
    assert told[2] == f"It names what is elsewhere, which stays as it is and counts for nothing: {weights}"


def test_a_folder_of_everything_is_not_searched_and_it_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_files, "FILES_LIMIT", 3)
    write(folder, {"s.py": "__import__(name)"})
    found = find(["python", "s.py"], folder)
    assert found.unread == (str(folder),)
    assert "put the solution into one of its own" in "\n".join(found.lines)


def test_a_folder_that_is_named_and_holds_too_much_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_tree, "ENTRIES_LIMIT", 1)
    with pytest.raises(BenchbotError, match="holds too many files") as caught:
        find(["python", "run.py", "weights"], folder)
    assert ".benchbotignore" in caught.value.fix


def test_a_client_that_a_solution_brings_counts_and_the_installed_one_does_not(tmp_path: Path) -> None:
    """Else a copy of the solution would find BenchBot's own in its place."""
    (tmp_path / "run.py").write_text("import benchbot_api, benchbot_eval")
    assert set(find(["python", "run.py"], tmp_path, ()).content.files) == {"run.py"}
    (tmp_path / "benchbot_api").mkdir()
    (tmp_path / "benchbot_api/__init__.py").write_text("from . import agent")
    (tmp_path / "benchbot_api/agent.py").write_text("")
    found = find(["python", "run.py"], tmp_path, ())
    assert set(found.content.files) == {"run.py", "benchbot_api/__init__.py", "benchbot_api/agent.py"}


def test_another_copy_behind_the_installed_one_is_not_what_is_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "run.py").write_text("import benchbot")
    (tmp_path / "copy/benchbot").mkdir(parents=True)
    (tmp_path / "copy/benchbot/__init__.py").touch()
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(benchbot.__file__).parents[1]), str(tmp_path / "copy")]))
    assert set(find(["python", "run.py"], tmp_path, ()).content.files) == {"run.py"}
