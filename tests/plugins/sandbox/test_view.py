"""The view of a sandbox: it shows no installed file that tells what a solution is to find out."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import benchbot
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.plugins.sandbox.view import View, hidden_paths, view_of
from tests.plugin_factory import DECLARES, PluginFactory


@pytest.fixture(autouse=True)
def _all_plugins_and_folders_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("BENCHBOT_PLUGINS", "BENCHBOT_ADDONS"):
        monkeypatch.delenv(name, raising=False)
    for kind in ("STATE", "CACHE", "DATA"):
        monkeypatch.setenv(f"BENCHBOT_{kind}_DIR", str(tmp_path / "own" / kind))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    load.cache_clear()


def secrets(catalog: Catalog) -> Iterator[Path]:
    """Yield the files that tell what stands where: ground truths, environments, their scenes, episodes."""
    yield from catalog.ground_truth_files
    for kind in ("environments", "episodes"):
        for declaration in catalog.pool(kind).values():
            yield declaration.path
            if "map_path" in declaration.data:
                yield declaration.path.parent / declaration.data["map_path"]


def is_seen(path: Path, view: View) -> bool:
    real = path.resolve()
    return any(
        real.is_relative_to(shown.resolve())
        and not any(real.is_relative_to(hidden.resolve()) for hidden in view.hidden)
        for shown in view.shown
    )


def seen_by(folder: Path, catalog: Catalog, *readable: Path) -> View:
    hidden = hidden_paths(catalog, folder, readable)
    return view_of([sys.executable, "x.py"], folder, os.environ["PATH"], readable, hidden)


def test_no_secret_of_any_plugin_is_seen_by_any_solution(tmp_path: Path) -> None:
    catalog = Catalog(load())
    (tmp_path / "work").mkdir()
    examples = sorted({declaration.path.parent for declaration in catalog.pool("examples").values()})
    files = list(secrets(catalog))

    assert len(files) > 50
    for folder in (tmp_path / "work", *examples):
        view = seen_by(folder, catalog)
        assert [str(path) for path in files if is_seen(path, view)] == []
        assert is_seen(folder, view)
        assert is_seen(Path(benchbot.__file__), view)
        assert is_seen(Path(sys.executable), view)


def test_its_own_folders_and_those_beside_it_are_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work = tmp_path / "work"
    (work / "state").mkdir(parents=True)
    (work / "part").mkdir()
    (work / "link").symlink_to(tmp_path / "own")
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(work / "state"))

    view = seen_by(work, Catalog(load()))

    assert is_seen(work / "part", view)
    assert not is_seen(work / "state" / "runs", view)
    assert not is_seen(work / "link" / "CACHE", view)
    assert not is_seen(tmp_path, view)


@pytest.mark.parametrize("home", ["mine", "mine/home", "mine/../mine/home"])
def test_the_home_folder_is_never_shown(home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine" / "home").mkdir(parents=True)
    monkeypatch.setenv("HOME", str(tmp_path / home))

    with pytest.raises(BenchbotError, match="not keep the solution from what is yours"):
        seen_by(tmp_path / "mine", Catalog(load()))


def test_a_solution_among_ground_truths_is_told_to_move(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="cannot see itself"):
        view_of(["true"], tmp_path / "hidden" / "here", "", (), [tmp_path.resolve() / "hidden"])


TASK = """
name: acme
actions: [move_next]
observations: [laser]
"""
EXAMPLE = """
name: acme
description: Does nothing.
native_command: python acme.py
"""
ENVIRONMENT = """
name: {name}
variant: 1
type: sim_sample
start_pose: [1, 0, 0, 0, 0, 0, 0]
"""


def test_of_plugins_only_those_for_solutions_are_seen(
    tmp_path: Path, plugin_factory: PluginFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "work").mkdir()
    for_solutions = plugin_factory.make(
        "acme-task", DECLARES.format(kind="tasks"), {"tasks/acme.yaml": TASK, "mapping.py": ""}
    )
    with_examples = plugin_factory.make("acme-examples", DECLARES.format(kind="examples"), {"examples/a.yaml": EXAMPLE})
    place = {"environments/acme_1.yaml": ENVIRONMENT.format(name="acme")}
    with_places = plugin_factory.make(
        "acme-all", DECLARES.format(kind="tasks") + DECLARES.format(kind="environments"), {**place, "generator.py": ""}
    )
    command_only = plugin_factory.make("acme-generator", "")
    broken = plugin_factory.make("acme-broken", "raise RuntimeError")
    site = [for_solutions, with_examples, with_places, command_only, broken]

    def seen(*readable: Path) -> list[Path]:
        load.cache_clear()
        view = seen_by(tmp_path / "work", Catalog(load()), plugin_factory.folder, *readable)
        return [path for path in site if is_seen(path / "__init__.py", view)]

    assert seen() == [for_solutions, with_examples]
    assert seen(command_only) == [for_solutions, with_examples, command_only]
    assert not is_seen(with_places / place.popitem()[0], seen_by(tmp_path / "work", Catalog(load()), with_places))
    monkeypatch.setenv("BENCHBOT_PLUGINS", "")
    assert seen() == []


def test_a_package_of_the_solution_hides_none_that_is_installed(
    tmp_path: Path, plugin_factory: PluginFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed = plugin_factory.make("acme-generator", "")
    carried = tmp_path / "work" / "acme_generator"
    carried.mkdir(parents=True)
    (carried / "__init__.py").touch()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.syspath_prepend("")  # as of python -m benchbot

    view = seen_by(tmp_path / "work", Catalog(load()), plugin_factory.folder)

    assert is_seen(carried / "__init__.py", view)
    assert not is_seen(installed / "__init__.py", view)


def test_an_addon_with_places_is_hidden_whole_and_so_is_what_is_named_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = tmp_path / "lab"
    addon = lab / "held"
    for name, text in {"environments/held_1.yaml": ENVIRONMENT.format(name="held"), "maps/held_1.png": ""}.items():
        (addon / name).parent.mkdir(parents=True)
        (addon / name).write_text(text)
    beside = [lab / "held.origin.json", lab / "held.zip"]
    for path in (*beside, lab / "heldout.txt"):
        path.touch()
    monkeypatch.setenv("BENCHBOT_ADDONS", str(addon))

    view = seen_by(lab, Catalog(load()))
    within = seen_by(addon, Catalog(load()))

    assert [path for path in (addon / "maps" / "held_1.png", *beside) if is_seen(path, view)] == []
    assert is_seen(lab / "heldout.txt", view)
    assert is_seen(addon / "maps", within)
    assert not is_seen(addon / "environments" / "held_1.yaml", within)
