"""A plug-in's life: generated, built, published, installed by name, used, upgraded, uninstalled; with uv and pip."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.plugins.authoring.scaffold.render import create
from tests.plugins.installer import wheels
from tests.plugins.installer.environments import Environment
from tests.plugins.installer.wheels import Index

# One worker has the environment; the two installers share it, one after the other.
pytestmark = pytest.mark.xdist_group("installing")

SOLUTION = """\
import os, json
from benchbot_api import Agent, ActionResult, BenchBot

class Walker(Agent):
    def is_done(self, result):
        return result != ActionResult.SUCCESS
    def pick_action(self, observations, actions):
        return "move_next", {}
    def save_result(self, filename, empty_results, functions):
        json.dump(empty_results, open(filename, "w"))

BenchBot(agent=Walker()).run()
"""


@pytest.fixture(scope="module")
def published(index: Index, tmp_path_factory: pytest.TempPathFactory) -> Index:
    """`benchbot new task story-task`, in two versions, as an author would publish them."""
    project = create("task", "story-task", tmp_path_factory.mktemp("projects"))
    settings = project / "pyproject.toml"
    for version in ("0.1.0", "0.2.0"):
        settings.write_text(settings.read_text().replace('version = "0.1.0"', f'version = "{version}"'))
        words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
        built = subprocess.run(words, cwd=project, capture_output=True, text=True, check=False)
        assert built.returncode == 0, built.stderr
    for wheel in sorted((project / "dist").glob("*.whl")):
        index.publish(wheel)
    return index


@pytest.mark.slow
@pytest.mark.parametrize("installer", ["uv", "pip"])
def test_a_generated_plugin_is_installed_used_upgraded_and_uninstalled(
    installer: str, published: Index, shared: Environment, tmp_path: Path
) -> None:
    where = ("--index-url", published.url, "--installer", installer)
    before = shared.listing()

    # Only looked at: nothing changes, and what would is told as data.
    looked = shared.run("install", "story-task==0.1.0", *where, "--dry-run", "--json")
    assert looked.returncode == 0, looked.stderr
    plan = json.loads(looked.stdout)
    assert (plan["installer"], plan["done"]) == (installer, False)
    (change,) = plan["changes"]
    assert (change["name"], change["from"], change["to"]) == ("story-task", None, "0.1.0")
    assert (change["kind"], change["brings"], change["trusted"]) == ("plug-in", "declarations", True)
    assert shared.listing() == before

    # It only declares, so nobody need be asked.
    installed = shared.run("install", "story-task==0.1.0", *where)
    assert installed.returncode == 0, installed.stderr
    assert installed.stdout == "+ story-task 0.1.0  (plug-in; declarations only)\n"

    listed = shared.run("plugins", "list", "--json")
    assert {"name": "story_task", "module": "story_task.plugin", "distribution": "story-task", "version": "0.1.0"} in (
        json.loads(listed.stdout)
    )

    (tmp_path / "solution.py").write_text(SOLUTION)
    ran = shared.run(
        *("submit", "--task", "story_task", "--robot", "sample_robot", "--env", "arena:1", "-r", "result.json"),
        *("--native", str(shared.python), "solution.py"),
        cwd=tmp_path,
    )
    assert ran.returncode == 0, ran.stderr
    provenance = json.loads((tmp_path / "result.json").read_text())["provenance"]
    assert provenance["plugins"]["story-task"]["version"] == "0.1.0"

    again = shared.run("install", "story-task", *where)
    assert (again.returncode, again.stdout) == (0, "")
    assert "everything is there already" in again.stderr

    upgraded = shared.run("upgrade", *where, "--json")
    assert upgraded.returncode == 0, upgraded.stderr
    assert [(row["action"], row["from"], row["to"]) for row in json.loads(upgraded.stdout)["changes"]] == [
        ("upgrade", "0.1.0", "0.2.0")
    ]
    shown = json.loads(shared.run("plugins", "show", "Story_Task", "--json").stdout)
    assert (shown["version"], shown["from"], shown["brings"]) == ("0.2.0", "index", "declarations")

    removed = shared.run("uninstall", "story-task", "--installer", installer)
    assert (removed.returncode, removed.stdout) == (0, "- story-task 0.2.0  (plug-in)\n"), removed.stderr
    assert shared.listing() == before


@pytest.mark.slow
def test_what_nothing_else_needs_is_named_and_goes_if_that_is_wanted(
    index: Index, shared: Environment, tmp_path: Path
) -> None:
    index.publish(wheels.make(tmp_path, "story-maths", entry=False))
    index.publish(wheels.make(tmp_path, "story-method", requires=["story-maths"]))
    before = shared.listing()
    installed = shared.run("install", "story-method", "--index-url", index.url, "--trust")
    assert installed.returncode == 0, installed.stderr
    looked = shared.run("uninstall", "story-method", "--dry-run")
    assert looked.stdout == "- story-method 1.0  (plug-in)\n"
    assert "Nothing else here needs story-maths 1.0: --with-unused uninstalls that, too." in looked.stderr
    removed = shared.run("uninstall", "story-method", "--with-unused")
    assert removed.returncode == 0, removed.stderr
    assert removed.stdout == "- story-method 1.0  (plug-in)\n- story-maths 1.0  (dependency)\n"
    assert shared.listing() == before
