"""`benchbot assets` at the command line."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from plugins.scenes.tests.asset_packs.furniture import box, entry, sh3f

Assets = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def assets() -> Assets:
    """Run the command in a process of its own."""

    def run(*words: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "benchbot", "assets", *words]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)

    return run


def test_a_pack_is_installed_listed_and_removed(assets: Assets, tmp_path: Path) -> None:
    files = {**box("chair"), **box("table4"), "models/table4/table4.obj": b"# torn\n"}
    source = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair") + entry(2, "Scopia#table4"), files)

    installed = assets("install", "sweethome3d", "--from", str(source))
    packs = json.loads(assets("list", "--json").stdout)
    models = assets("list", "sweethome3d").stdout
    (model,) = json.loads(assets("list", "sweethome3d", "--json").stdout)
    removed = assets("remove", "sweethome3d")

    assert (installed.returncode, installed.stdout) == (0, "")
    assert "Left out: Scopia#table4" in installed.stderr
    assert "1 models in" in installed.stderr
    (ours,) = (pack for pack in packs if pack["name"] == "sweethome3d")
    assert (ours["models"], ours["classes"], ours["distribution"]) == (1, 1, "benchbot-scenes")
    assert models.split()[:3] == ["scopia_chair", "chair", "chair"]
    assert "0.60 x 0.50 x 0.70" in models
    assert model["placement"] == "floor"
    assert removed.returncode == 0
    assert "sweethome3d" not in assets("list").stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["install", "sweethome4d"], "Did you mean 'sweethome3d'?"),
        (["install", "sweethome3d", "--from", "nowhere.deb"], "There is no file nowhere.deb."),
        (["list", "toys"], "There is no asset pack 'toys' here."),
        (["remove", "household"], "pip uninstall"),
    ],
)
def test_what_is_not_there_is_told_with_the_way_on(assets: Assets, words: list[str], message: str) -> None:
    done = assets(*words)

    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
