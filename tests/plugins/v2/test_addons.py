import json
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins, installed
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.plugins.v2 import addons, trust
from tests.plugin_factory import DECLARES, PluginFactory
from tests.v2_addon import make


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_ADDONS", "")
    return make(tmp_path / "addons")


def catalog(folder: Path, *distributions: str) -> Catalog:
    infos = [info for info in installed() if info.distribution in {"benchbot", "benchbot-sample", *distributions}]
    addons.use([folder])
    return Catalog(Plugins(infos))


def test_every_kind_joins_its_pool_with_the_folder_as_its_source(folder: Path) -> None:
    found = catalog(folder)

    assert found.pool("tasks")["count:passive:ground_truth"].distribution == str(folder)
    assert {"hall:1", "hall:2", "arena:1"} <= set(found.names("environments"))
    assert {"counts", "counts_ground_truth", "object_map"} <= set(found.names("formats"))
    assert "carter_of_old" in found.names("robots")
    assert "count_bottles" in found.names("examples")
    assert found.get("batches", "halls").data["environments"] == ["hall:1"]
    assert [path.name for path in found.ground_truth_files] == ["hall_1.json"]
    assert "count_error" in found.plugins.pool("evaluators")
    assert (found.broken, found.plugins.broken) == ([], [])


@pytest.mark.parametrize("where", ["episodes", "episodes/point_goal"])
def test_episodes_may_be_in_folders_of_their_tasks(where: str, folder: Path) -> None:
    (folder / "me" / where).mkdir(parents=True)
    (folder / "me" / where / "hall_1.json").write_text(json.dumps({"task": "point_goal", "environment": "hall:1"}))

    found = catalog(folder)

    assert found.pool("episodes")["point_goal:hall:1"].distribution == str(folder)
    assert found.broken == []


def test_declarations_need_no_trust(folder: Path) -> None:
    found = catalog(folder)

    assert found.get("tasks", "count:passive:ground_truth").data["scene_count"] == 1
    assert found.get("robots", "carter_of_old").data["type"] == "sim_omni"
    assert found.get("environments", "hall:1").data["robots"] == ["sample_robot"]


@pytest.mark.parametrize("what", ["format", "method"])
def test_code_needs_trust_and_is_not_touched_without_it(what: str, folder: Path) -> None:
    for file in folder.rglob("count*.py"):
        file.write_text(f"open({str(folder / 'executed')!r}, 'w')\n{file.read_text()}")
    found = catalog(folder)

    with pytest.raises(BenchbotError, match="is not trusted") as caught:
        found.get("formats", "counts") if what == "format" else found.plugins.record("evaluators", "count_error")

    assert "me/formats_count/formats/counts.py" in caught.value.why
    assert "--trust-addons" in caught.value.fix
    assert not (folder / "executed").exists()


def test_trusted_code_runs_until_it_changes(folder: Path) -> None:
    trust.remember(addons.find(folder))
    declared = catalog(folder).get("formats", "counts")
    assert formats.call(declared, "create", [], {}) == {"counts": {}, "class_list": ["bottle", "chair"]}
    formats.validate(declared, {"counts": {"chair": 2}, "class_list": ["chair"]})

    with (folder / "me/formats_count/formats/kinds.py").open("a") as file:
        file.write("KINDS.append('person')\n")
    with pytest.raises(BenchbotError, match="is not trusted"):
        catalog(folder).get("formats", "counts")


def test_who_is_asked_may_say_yes_or_no(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = [False, True]
    monkeypatch.setattr(trust, "_ask", lambda _: answers.pop(0))
    monkeypatch.setattr(trust, "_declined", set())
    for _ in range(2):  # a "no" is not asked for twice
        with pytest.raises(BenchbotError, match="is not trusted"):
            catalog(folder).get("formats", "counts")

    monkeypatch.setattr(trust, "_declined", set())
    assert catalog(folder).get("formats", "counts").name == "counts"
    monkeypatch.setattr(trust, "_ask", None)
    assert catalog(folder).get("formats", "counts").name == "counts"


def test_a_selection_says_what_is_missing_for_worlds_of_v2(folder: Path) -> None:
    trust.remember(addons.find(folder))

    with pytest.raises(BenchbotError) as caught:
        select(
            catalog(folder), RunRequest(task="count:passive:ground_truth", robot="carter_of_old", environment="hall:2")
        )
    assert "is of type 'sim_omni', which BenchBot v2 ran and this one does not" in caught.value.title
    with pytest.raises(BenchbotError) as caught:
        select(
            catalog(folder), RunRequest(task="count:passive:ground_truth", robot="sample_robot", environment="hall:2")
        )
    assert "environments of type sim_sample, this one is of type sim_omni" in caught.value.why


def test_a_selection_names_untrusted_code_before_anything_starts(folder: Path) -> None:
    with pytest.raises(BenchbotError, match="is not trusted"):
        select(
            catalog(folder), RunRequest(task="count:passive:ground_truth", robot="sample_robot", environment="hall:1")
        )


def test_a_name_that_a_plugin_has_is_an_error_that_names_both(folder: Path, plugin_factory: PluginFactory) -> None:
    text = (folder / "me/tasks_count/tasks/count.yaml").read_text()
    plugin_factory.make("acme-count", DECLARES.format(kind="tasks"), {"tasks/count.yaml": text})

    with pytest.raises(BenchbotError, match="Two tasks are called 'count:passive:ground_truth'") as caught:
        catalog(folder, "acme-count").names("tasks")

    assert f"'acme-count' and '{folder}'" in caught.value.why
    assert caught.value.fix == f"Keep one of them: leave out --addons {folder}   or: benchbot uninstall acme-count"


def test_what_is_broken_is_named_and_harms_no_other(folder: Path) -> None:
    (folder / "me/tasks_count/tasks/bad.yaml").write_text("name: x\nactions: [")
    (folder / "me/eval_count/evaluation_methods/bad.yaml").write_text("name: y\nfunctions: {evaluat: a.b}\n")
    found = catalog(folder)

    assert "count:passive:ground_truth" in found.names("tasks")
    assert found.broken[0].title.endswith("tasks/bad.yaml:3: not valid YAML.")
    assert "count_error" in found.plugins.pool("evaluators")
    hint = found.plugins.broken_hint()
    assert "evaluation_methods/bad.yaml:2: the key 'evaluate' is missing" in hint
    assert "the key 'valid_result_formats' is missing" in hint


@pytest.mark.parametrize("depth", ["", "me", "me/tasks_count", "me/tasks_count/tasks"])
def test_a_folder_may_be_named_at_any_height(depth: str, folder: Path) -> None:
    assert "count:passive:ground_truth" in catalog(folder / depth).names("tasks")


@pytest.mark.parametrize(
    ("make_folder", "why"),
    [
        (None, "There is no such folder."),
        ("", "None of its folders is called batches,"),
        ("task", "Did you mean 'tasks'?"),
        (".hidden/tasks", "None of its folders"),
    ],
)
def test_a_folder_without_addons_is_an_error(make_folder: str | None, why: str, tmp_path: Path) -> None:
    if make_folder is not None:
        (tmp_path / "x" / make_folder).mkdir(parents=True)

    with pytest.raises(BenchbotError, match="There are no add-ons in") as caught:
        addons.find(tmp_path / "x")

    assert why in caught.value.why


def test_the_variable_names_folders(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(addons.VARIABLE, str(folder / "me/batches"))
    addons.use([folder / "me/envs", folder / "me/batches"])

    assert [addon.name for addon in addons.from_environment()] == ["me/batches", "me/envs"]
    plugin_manager.load.cache_clear()
    assert "halls" in Catalog(plugin_manager.load()).names("batches")


def test_the_content_hash_changes_with_any_file(folder: Path) -> None:
    before = addons.find(folder).content_hash()
    (folder / "me/envs/environments/.maps/hall_1.yaml").write_text("other")

    assert addons.find(folder).content_hash() != before
