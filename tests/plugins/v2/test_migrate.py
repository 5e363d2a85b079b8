"""A folder of BenchBot v2's add-ons as a whole: `benchbot migrate` says what becomes of it, and so it does."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import Plugins, installed
from benchbot.plugins.v2 import addons, official
from tests.command_line import CommandLine, Here
from tests.plugins.v2 import official_addons
from tests.v2_addon import make

SHIPPING = "benchbot-task-semslam,benchbot-envs-bear,benchbot-sim-taichi,benchbot-eval-omq"


@pytest.fixture
def all_official(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_PLUGINS", SHIPPING)
    monkeypatch.setenv("BENCHBOT_ADDONS", "")
    return official_addons.make(tmp_path / "addons")


def rows(told: str) -> dict[tuple[str, str], dict[str, Any]]:
    return {(row["kind"], row["name"]): row for row in json.loads(told)["declarations"]}


def test_what_becomes_of_all_official_addons_together(all_official: Path, here: Here, cli: CommandLine) -> None:
    cli.variables["BENCHBOT_PLUGINS"] = SHIPPING
    with pytest.MonkeyPatch.context() as changed:
        changed.setenv("BENCHBOT_PLUGINS", SHIPPING)
        done = here("migrate", str(all_official), "--json")

    assert done.returncode == 0, done.stderr
    found = rows(done.stdout)
    assert Counter(row["verdict"] for row in found.values()) == {"shipped": 23, "runs": 4, "replaced": 1}
    runs = {name for (_, name), row in found.items() if row["verdict"] == "runs"}
    assert runs == {"hello_benchbot", "hello_scd", "hello_eval_scd", "aigym_scd"}
    assert "by benchbot-task-semslam" in found["tasks", "scd:passive:ground_truth"]["why"]
    assert "carter_omni collides, with v2's bias" in found["robots", "carter_omni"]["why"]
    assert "nothing here runs type 'sim_unreal'" in found["robots", "carter_remote"]["why"]
    assert "nothing looks as it did" in found["environments", "miniroom:1"]["why"]
    needs = "\n".join(json.loads(done.stdout)["needs"])
    assert "benchbot-addons/tasks_ssu: ships as benchbot-task-semslam" in needs
    assert "benchbot-addons/examples_ssu: is in this folder" in needs
    assert "Remote content of envs_isaac_develop: not needed" in needs
    assert not list(all_official.rglob("executed"))


def test_all_official_addons_together_can_be_used(all_official: Path) -> None:
    addons.use([all_official])
    found = Catalog(Plugins(installed()))

    assert found.pool("tasks")["scd:passive:ground_truth"].distribution == "benchbot-task-semslam"
    assert found.pool("examples")["hello_active"].distribution == "benchbot"
    assert found.pool("examples")["hello_benchbot"].distribution == str(all_official)
    assert found.pool("batches")["develop_1"].distribution == "benchbot-envs-bear"
    assert found.pool("robots")["carter_remote"].data["type"] == "sim_unreal"
    assert found.plugins.pool("evaluators")["omq"].distribution == "benchbot-eval-omq"
    assert not [path for path in found.ground_truth_files if path.is_relative_to(all_official)]
    assert (found.broken, found.plugins.broken) == ([], [])


def test_what_no_plugin_has_is_taken_from_an_official_addon(
    all_official: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample")
    addons.use(
        [all_official / "benchbot-addons/tasks_ssu", all_official / "benchbot-addons/ground_truths_bear_develop"]
    )
    found = Catalog(Plugins(installed()))

    assert found.pool("tasks")["scd:passive:ground_truth"].distribution.endswith("tasks_ssu")
    assert [path.name for path in found.ground_truth_files if path.is_relative_to(all_official)] == ["miniroom_1.json"]


def test_what_is_left_out_is_told_where_a_folder_is_named(all_official: Path, here: Here) -> None:
    done = here("list", "examples", "--addons", str(all_official / "benchbot-addons/examples_base"))

    assert done.returncode == 0, done.stderr
    assert "hello_benchbot" in done.stdout
    assert "What BenchBot ships is not taken from examples_base: benchbot migrate" in done.stderr


def test_addons_of_ones_own_are_judged(here: Here, cli: CommandLine) -> None:
    folder = make(cli.folder / "addons")
    (folder / "me/examples/examples/hello_active.yaml").write_text("name: hello_active\nnative_command: python3 x.py\n")
    (folder / "me/examples/.dependencies").write_text("you/things  # more\n")
    (folder / "me/tasks_count/tasks/bad.yaml").write_text("name: x\nactions: [")
    done = here("migrate", "addons", "--json")

    assert done.returncode == 2
    found = rows(done.stdout)
    assert found["tasks", "count:passive:ground_truth"]["verdict"] == "runs"
    assert found["environments", "hall:1"]["verdict"] == "runs"
    assert found["environments", "hall:2"]["verdict"] == "will not run"
    assert found["formats", "counts"] | {"path": ""} == {
        "kind": "formats", "name": "counts", "verdict": "runs", "why": "its code needs --trust-addons", "path": "",
    }  # fmt: skip
    assert found["examples", "hello_active"]["why"] == (
        "benchbot has one of that name: rename yours, or leave out its file"
    )
    assert found["tasks", "bad.yaml"]["verdict"] == "will not run"
    assert "you/things: is not here: benchbot install https://github.com/you/things" in json.loads(done.stdout)["needs"]
    assert not (folder / "executed").exists()
    table = here("migrate", "addons")
    assert ["robots", "carter_of_old", "will", "not", "run"] in [line.split()[:5] for line in table.stdout.splitlines()]


@pytest.mark.parametrize(
    ("name", "distributions"),
    [
        ("benchbot-addons/tasks_ssu", ("benchbot-task-semslam",)),
        ("https://github.com/benchbot-addons/eval_omq.git", ("benchbot-eval-omq",)),
        ("benchbot-addons/ssu", tuple(sorted(SHIPPING.split(",")))),
        ("somebody/tasks_ssu", None),
        ("tasks_ssu", None),
    ],
)
def test_official_names_lead_to_what_ships_in_their_place(name: str, distributions: tuple[str, ...] | None) -> None:
    found = official.replacement_of(name)
    assert (None if found is None else tuple(sorted(found.distributions))) == (
        None if distributions is None else tuple(sorted(distributions))
    )
