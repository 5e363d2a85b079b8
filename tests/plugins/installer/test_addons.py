"""Add-ons of BenchBot v2, a wheel, a project and a repository: everything that is no name in an index."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from benchbot.plugins.authoring.scaffold.render import create
from tests import v2_addon
from tests.plugins.installer import wheels
from tests.plugins.installer.environments import Environment
from tests.terminal import asked

pytestmark = [pytest.mark.xdist_group("installing"), pytest.mark.slow]


def committed(folder: Path, environment: Environment) -> None:
    """Make a git repository of a folder, or another commit in it."""
    who = ("-c", "user.name=me", "-c", "user.email=me@example.org")
    for words in (["init", "--quiet"], ["add", "."], [*who, "commit", "--quiet", "--message", "One"]):
        subprocess.run(["git", *words], cwd=folder, env=environment.environ(), check=True)


def test_addons_of_v2_are_found_without_being_named_until_they_are_uninstalled(
    shared: Environment, tmp_path: Path
) -> None:
    folder = v2_addon.make(tmp_path / "me" / "halls")
    before = shared.listing()
    restricted = {"BENCHBOT_PLUGINS": "benchbot-sample,me/halls"}

    installed = shared.run("install", str(folder))
    assert installed.returncode == 0, installed.stderr
    assert installed.stdout.startswith("+ me/halls ")
    assert "(add-on; code: me/eval_count/evaluation_methods/count_error.py" in installed.stdout
    shutil.rmtree(folder)

    tasks = shared.run("list", "tasks", "--json", changes=restricted)
    assert "count:passive:ground_truth" in [row["name"] for row in json.loads(tasks.stdout)], tasks.stderr
    assert "count:" not in shared.run("list", "tasks", changes={"BENCHBOT_PLUGINS": "benchbot-sample"}).stdout
    assert json.loads(shared.run("plugins", "show", "me/halls", "--json").stdout)["from"] == str(folder)

    assert "me/halls" in [row["name"] for row in json.loads(shared.run("plugins", "list", "--json").stdout)]

    # Installed is not trusted: its code waits for a yes, as that of any add-on does.
    selection = ("--task", "count:passive:ground_truth", "--robot", "sample_robot", "--env", "hall:1")
    refused = shared.run("submit", "--native", "true", *selection, changes=restricted)
    assert "is not trusted" in refused.stderr

    removed = shared.run("uninstall", "me/halls")
    assert removed.returncode == 0, removed.stderr
    assert "count:" not in shared.run("list", "tasks").stdout
    assert shared.listing() == before


def test_addons_from_a_repository_are_upgraded_and_unsound_ones_are_refused(
    shared: Environment, tmp_path: Path
) -> None:
    folder = v2_addon.make(tmp_path / "you" / "more")
    committed(folder, shared)
    url = f"git+file://{folder}"
    first = shared.run("install", url, "--json")
    assert first.returncode == 0, first.stderr
    assert json.loads(first.stdout)["changes"][0]["origin"] == url
    assert shared.run("install", url).stdout == ""
    before = shared.listing()

    task = folder / "me" / "tasks_count" / "tasks" / "count.yaml"
    text = task.read_text()
    for broken, said in ((text.replace("actions", "actoins"), "Did you mean 'actions'?"), (TAKEN, "Two tasks are")):
        task.write_text(broken)
        committed(folder, shared)
        refused = shared.run("upgrade", "you/more")
        assert (refused.returncode, said in refused.stderr) == (2, True), refused.stderr
        assert shared.listing() == before

    task.write_text(text.replace("given trajectory", "trajectory"))
    committed(folder, shared)
    trusted = {"BENCHBOT_PLUGINS": "benchbot-sample,you/more", "BENCHBOT_STATE_DIR": str(tmp_path / "state")}
    assert shared.run("upgrade", "you/more", "--trust", changes=trusted).stdout.startswith("~ you/more ")
    selection = ("--task", "count:passive:ground_truth", "--robot", "sample_robot", "--env", "hall:1")
    ran = shared.run("submit", "--native", "true", *selection, changes=trusted)
    assert "is not trusted" not in ran.stderr
    shared.run("uninstall", "you/more")


def test_what_addons_depend_on_comes_with_them(shared: Environment, tmp_path: Path) -> None:
    before = shared.listing()
    for name, needed in (
        ("base", ""),
        ("top", f"git+file://{tmp_path}/them/base  # first\nbenchbot-addons/formats_object_map\n"),
    ):
        folder = tmp_path / "them" / name
        (folder / "tasks").mkdir(parents=True)
        (folder / "tasks" / "task.yaml").write_text(wheels.TASK.format(name=f"{name}:task"))
        (folder / ".dependencies").write_text(needed)
        committed(folder, shared)

    done = shared.run("install", f"git+file://{tmp_path}/them/top")

    assert done.returncode == 0, done.stderr
    assert {line.split()[1] for line in done.stdout.splitlines()} == {"them/base", "them/top"}
    assert f"them/top needs git+file://{tmp_path}/them/base" in done.stderr
    shared.run("uninstall", "them/top", "them/base")
    assert shared.listing() == before


TAKEN = "name: sample:passive\nactions: [move_next]\nobservations: [poses]\nresults_format: object_map\n"


def test_a_wheel_a_project_and_a_repository_say_where_they_came_from(shared: Environment, tmp_path: Path) -> None:
    before = shared.listing()
    offline = ("--no-index", "--find-links", str(tmp_path))
    wheel = wheels.make(tmp_path / "dist", "from-wheel")
    done = shared.run("install", str(wheel), *offline)
    assert done.stdout == f"+ from-wheel 1.0  (plug-in; declarations only; from {wheel})\n", done.stderr
    assert shared.run("install", str(wheel), *offline).stdout == ""
    wheels.make(tmp_path / "dist", "from-wheel", files={"from_wheel/tasks/other.yaml": wheels.TASK.format(name="o")})
    assert "~ from-wheel 1.0 -> 1.0" in shared.run("install", str(wheel), *offline).stdout
    locked = shared.run("plugins", "lock", *offline, cwd=tmp_path)
    assert f'from = "{wheel}"\nhashes = ["sha256:' in (tmp_path / "benchbot.lock").read_text(), locked.stderr
    assert "stays: it came from a file" in shared.run("upgrade", "from-wheel", *offline).stderr
    shared.run("uninstall", "from-wheel")
    assert shared.run("plugins", "sync", *offline, cwd=tmp_path).stdout.startswith("+ from-wheel 1.0")
    wheel.write_bytes(wheels.make(tmp_path / "else", "from-wheel").read_bytes())
    shared.run("uninstall", "from-wheel")
    assert "its hash is wrong" in shared.run("plugins", "sync", *offline, cwd=tmp_path).stderr

    broken = wheels.make(tmp_path / "broken", "from-broken", code="raise ValueError('oops')")
    halls = v2_addon.make(tmp_path / "their" / "halls")
    both = shared.run("install", str(halls), str(broken), "--trust", *offline)
    assert (both.returncode, "ValueError: oops" in both.stderr) == (2, True), both.stderr
    assert shared.listing() == before

    project = create("task", "from-project", tmp_path)
    (tmp_path / "repository").mkdir()
    shutil.copytree(project, tmp_path / "repository" / "it")
    setup = tmp_path / "repository" / "it" / "setup.py"
    setup.write_text("raise SystemExit")
    (setup.parent / "pyproject.toml").write_text("")
    committed(setup.parent, shared)
    refused = shared.run("install", f"{tmp_path}/repository/it", *offline)
    assert "Building it runs its code with all your rights" in refused.stderr
    refused = shared.run("install", f"git+file://{tmp_path}/repository/it", *offline)
    assert "Building it runs its code with all your rights" in refused.stderr
    assert shared.listing() == before


@pytest.mark.parametrize(("answer", "allowed"), [("y", True), ("n", False)])
def test_on_a_terminal_the_user_is_asked(answer: str, allowed: bool, shared: Environment, tmp_path: Path) -> None:
    wheel = wheels.make(tmp_path, "asking", code=f"import json\n{wheels.HOOKS}")
    before = shared.listing()
    state = tmp_path / "state"
    words = shared.words("install", str(wheel), "--no-index")
    status, seen = asked(words, answer, shared.environ({"BENCHBOT_STATE_DIR": str(state)}))

    assert status == (0 if allowed else 2)
    assert "+ asking 1.0  (plug-in; code: asking/__init__.py" in seen
    assert [path.read_text() for path in state.glob("trusted/*")] == (["asking 1.0\n"] if allowed else [])
    assert (shared.listing() == before) is not allowed
    if allowed:
        shared.run("uninstall", "asking")
        assert shared.listing() == before
