"""Environments of a set are made by several processes at once."""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot.cli.kit import making
from benchbot.cli.kit.preflight import scenes_of
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins, installed
from tests.command_line import CommandLine
from tests.plugin_factory import PluginFactory

TOWNS = """
import os, time
from pathlib import Path
from benchbot.plugin import BenchbotError, EnvironmentSet, hookimpl

FOLDER = Path(__file__).parent

def folder(number):
    return FOLDER / "made" / str(number)

def is_made(number):
    return folder(number).exists()

def make(number):
    if is_made(number):
        return folder(number)
    with (FOLDER / "begun").open("a") as file:
        file.write(f"{number} {os.getpid()}\\n")
    if number == 4:
        raise BenchbotError("town_4:1 came out different.", "It was frozen by another version.", "Install that.")
    deadline_s = time.monotonic() + 60
    while not (FOLDER / "gate").exists() and len((FOLDER / "begun").read_text().splitlines()) < WANTED:
        assert time.monotonic() < deadline_s, "nothing else is made meanwhile"
        time.sleep(0.01)
    part = FOLDER / f"part_{number}"
    (part / "environments").mkdir(parents=True)
    about = f"name: town_{number}\\nvariant: 1\\ntype: sim_none\\nstart_pose: [1, 0, 0, 0, 0, 0, 0]\\n"
    (part / "environments" / f"town_{number}_1.yaml").write_text(about)
    folder(number).parent.mkdir(exist_ok=True)
    return part.rename(folder(number))

@hookimpl
def benchbot_environment_sets():
    yield EnvironmentSet("town", 4, make, is_made=is_made)
"""
TOWN = [f"town_{number}:1" for number in range(1, 5)]
PLANS = f"""
from benchbot.cli.kit import making, preflight
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load

making.processors = lambda: 2
preflight.scenes_of(Catalog(load()), {TOWN[:3]})
"""


@pytest.fixture
def towns(plugin_factory: PluginFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a plug-in whose towns are there when two have begun."""
    monkeypatch.setattr(making, "processors", lambda: 2)
    return plugin_factory.make("acme-towns", TOWNS.replace("WANTED", "2"))


def catalog() -> Catalog:
    return Catalog(Plugins(installed()))


def begun(towns: Path) -> list[str]:
    return (towns / "begun").read_text().splitlines()


def test_as_many_are_made_at_once_as_there_are_processors(towns: Path) -> None:
    scenes = scenes_of(catalog(), ["arena:1", *TOWN[:3]])

    assert [scene.name for scene in scenes] == ["arena:1", *TOWN[:3]]
    assert sorted(line.partition(" ")[0] for line in begun(towns)) == ["1", "2", "3"]
    assert len({line.partition(" ")[2] for line in begun(towns)}) == 2
    scenes_of(catalog(), TOWN[:3])
    assert len(begun(towns)) == 3


def test_one_that_cannot_be_made_is_told_to_who_asks_for_it(towns: Path) -> None:
    there = catalog()
    assert [scene.name for scene in scenes_of(there, TOWN)] == TOWN[:3]
    with pytest.raises(BenchbotError, match="town_4:1 came out different"):
        there.environments("town_4:1")


def test_one_process_makes_what_is_not_more_than_that(towns: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (towns / "gate").touch()
    with making.making({"town_1:1": ("town", 1)}) as one:
        assert one == {}
    monkeypatch.setattr(making, "processors", lambda: 1)
    with making.making({"town_1:1": ("town", 1), "town_2:1": ("town", 2)}) as both:
        assert both == {}
    assert not (towns / "begun").exists()


def test_who_is_killed_leaves_whole_environments_and_no_process(
    cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    towns = make_plugin("acme-towns", TOWNS.replace("WANTED", "4"))
    planning = subprocess.Popen([sys.executable, "-c", PLANS], env=cli.variables, cwd=cli.folder)
    cli.processes.append(planning)  # type: ignore[arg-type]
    deadline_s = time.monotonic() + 60
    while not (towns / "begun").exists() or len(begun(towns)) < 2:
        assert time.monotonic() < deadline_s
        time.sleep(0.01)
    planning.kill()
    planning.wait()
    (towns / "gate").touch()

    assert cli.no_process_is_left(), cli.processes_left()
    assert len(begun(towns)) == 2
    assert sorted(path.name for path in (towns / "made").iterdir()) == ["1", "2"]
    assert not list(towns.glob("part_*"))
