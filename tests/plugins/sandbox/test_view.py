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


def seen_by(folder: Path, catalog: Catalog) -> View:
    hidden = hidden_paths(catalog, folder)
    return view_of([sys.executable, "x.py"], folder, os.environ["PATH"], (), hidden)


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
