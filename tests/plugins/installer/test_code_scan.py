"""What is said to bring declarations only cannot run anything of its own."""

import zipfile
from pathlib import Path

import pytest

from benchbot.plugins.installer.code_scan import code_in
from benchbot.plugins.installer.distributions import Distribution, found_in
from tests.plugins.installer import wheels
from tests.plugins.installer.wheels import HOOKS

FILES = """\
from collections.abc import Iterable
from importlib.resources import files
from typing import TYPE_CHECKING
from benchbot.plugin import hookimpl
if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
__version__ = "1.0"
@hookimpl
def benchbot_robots() -> "Iterable[Traversable]":
    \"\"\"Yield them.\"\"\"
    yield files(__name__) / "robots"
    yield files(__package__) / "robots" / "more.yaml"
@hookimpl
def benchbot_environments() -> Iterable[str | None]:
    return [Path(__file__).parent / "environments"]
"""
API = """\
from pathlib import Path

from benchbot.plugin import hookimpl

PLUGIN_API = 1
\"\"\"The major version of benchbot.plugin that this was made for.\"\"\"


@hookimpl
def benchbot_tasks():
    yield Path(__file__).parent / "tasks"
"""
YAML = {"acme/tasks/acme.yaml": "name: acme\n"}


def unpacked(wheel: Path, folder: Path) -> Distribution:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    (found,) = found_in([folder]).values()
    return found


@pytest.mark.parametrize("code", [HOOKS, FILES, API, f'"""What it is."""\n{HOOKS}'])
def test_hooks_that_yield_paths_are_declarations_only(code: str, tmp_path: Path) -> None:
    assert code_in(unpacked(wheels.make(tmp_path, "acme", code=code), tmp_path / "x")) == []


@pytest.mark.parametrize(
    "code",
    [
        "import os\n",
        "from os import system\n",
        "from . import helpers\n",
        "from pathlib import *\n",
        "from pathlib import Path as benchbot\n",
        "print('hello')\n",
        "x = [print() for _ in range(3)]\n",
        "__version__ = __import__('os').getcwd()\n",
        "PLUGIN_API = print()\n",
        "PLUGIN_API = hookimpl = 1\n",
        "from benchbot.plugin import target\n",
        "target('acme.tool:run')\n",
        "PLUGIN_API = target('acme.tool:run')\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield target('acme.tool:run')\n",
        "@hookimpl\ndef benchbot_recorders():\n    yield Recorder('acme', target('acme.tool:run'))\n",
        "class Path: pass\n",
        "lambda: 0\n",
        "if TYPE_CHECKING:\n    pass\nelse:\n    import os\n",
        "@hookimpl\ndef benchbot_examples():\n    yield Path(__file__).parent / 'examples'\n",
        "@hookimpl\ndef benchbot_formats():\n    yield Path(__file__).parent / 'formats'\n",
        "@hookimpl\ndef benchbot_tasks(x=print()):\n    yield Path(__file__).parent / 'tasks'\n",
        "@hookimpl\ndef benchbot_tasks() -> print():\n    yield Path(__file__).parent / 'tasks'\n",
        "@print\ndef benchbot_tasks():\n    yield Path(__file__).parent / 'tasks'\n",
        "@hookimpl(specname=print())\ndef benchbot_tasks():\n    yield Path(__file__).parent / 'tasks'\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield Path('/etc')\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield Path(__file__).parent / '../../other'\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield Path(__file__).parent / '/etc'\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield Path(__file__).parent.joinpath(print())\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield files('antigravity') / 'tasks'\n",
        "@hookimpl\ndef benchbot_tasks():\n    yield from __import__('os').listdir()\n",
        "@hookimpl\nasync def benchbot_tasks():\n    yield Path(__file__).parent / 'tasks'\n",
        "def broken(:\n",
    ],
)
def test_anything_else_in_the_entry_point_is_code(code: str, tmp_path: Path) -> None:
    found = code_in(unpacked(wheels.make(tmp_path, "acme", code=f"{HOOKS}{code}"), tmp_path / "x"))
    assert found == ["acme/__init__.py"]


@pytest.mark.parametrize(
    "path",
    [
        "acme/more.py",
        "acme/native.so",
        "acme/__init__.pyc",
        "acme/__pycache__/__init__.cpython-311.pyc",
        "acme.pth",
        "numpy/data.yaml",
        "sitecustomize.py",
        "acme-1.0.data/scripts/run",
        "acme/tasks/run.sh",
    ],
)
def test_other_files_are_code(path: str, tmp_path: Path) -> None:
    assert code_in(unpacked(wheels.make(tmp_path, "acme", files={**YAML, path: ""}), tmp_path / "x")) == [path]


def test_commands_and_other_entry_points_are_code_and_an_empty_init_is_not(tmp_path: Path) -> None:
    points = "[benchbot]\nacme = acme.plugin\n[console_scripts]\nacme = acme:main\n[pytest11]\nacme = acme\n"
    files = {**YAML, "acme/plugin.py": HOOKS, "acme-1.0.dist-info/entry_points.txt": points}
    wheel = wheels.make(tmp_path, "acme", code='"""Nothing."""\n__version__ = "1"\n', files=files, entry=False)
    assert code_in(unpacked(wheel, tmp_path / "x")) == ["the command acme", "an entry point in pytest11"]


@pytest.mark.parametrize("value", ["antigravity", "numpy", "acme:tasks", "acme.missing"])
def test_an_entry_point_elsewhere_is_code(value: str, tmp_path: Path) -> None:
    files = {**YAML, "acme-1.0.dist-info/entry_points.txt": f"[benchbot]\nacme = acme\nother = {value}\n"}
    wheel = wheels.make(tmp_path, "acme", files=files, entry=False)
    assert f"the entry point {value}" in code_in(unpacked(wheel, tmp_path / "x"))


def test_the_content_is_that_of_the_files_and_not_how_they_came_here(tmp_path: Path) -> None:
    first = unpacked(wheels.make(tmp_path, "acme"), tmp_path / "x")
    second = unpacked(wheels.make(tmp_path, "acme"), tmp_path / "y")
    (second.info / "INSTALLER").write_text("me")
    second.rewrite_origin({"url": "https://example.org/acme", "vcs_info": {"vcs": "git", "commit_id": "1"}})
    again = Distribution(second.name, second.version, second.info)
    assert again.content() == first.content()
    assert again.origin == {"url": "https://example.org/acme", "vcs_info": {"vcs": "git", "commit_id": "1"}}

    (first.info.parent / "acme" / "tasks" / "acme.yaml").write_text("other")
    assert again.content() != first.content()
