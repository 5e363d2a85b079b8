"""The manager of BenchBot v2's add-ons, by its import name, as scripts looked things up in it."""

from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2 import addons, trust
from benchbot_addons import manager
from tests.v2_addon import make


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample")
    made = make(tmp_path / "addons")
    monkeypatch.setenv("BENCHBOT_ADDONS", str(made))
    plugin_manager.load.cache_clear()
    return made


def test_environments_are_taken_apart_and_put_together() -> None:
    assert (manager.env_name("hall:1"), manager.env_variant("hall:1")) == ("hall", "1")
    assert manager.env_string({"name": "hall", "variant": 2}) == "hall:2"
    assert manager.env_string([{"name": "hall", "variant": 1}, {"name": "hall", "variant": 2}]) == "hall:1:2"


def test_what_there_is_is_found_by_its_values(folder: Path) -> None:
    task = str(folder / "me/tasks_count/tasks/count.yaml")
    assert manager.exists("tasks", [("name", "count:passive:ground_truth")])
    assert not manager.exists("environments", [("name", "hall"), ("variant", "9")])
    assert manager.get_match("tasks", [("name", "count:passive:ground_truth")]) == task
    found = manager.get_match("environments", [("name", "hall"), ("variant", "2")], return_data=True)
    assert isinstance(found, dict)
    assert (found["type"], found["_file_path"]) == ("sim_omni", str(folder / "me/envs/environments/hall_2.yaml"))
    assert task in manager.find_all("tasks")
    assert [Path(path).name for path in manager.find_all("ground_truths", "json")] == ["hall_1.json"]
    assert "count_error" in manager.get_field("evaluation_methods", "name")


def test_fields_are_read() -> None:
    assert ["hall", 2] in manager.get_fields("environments", ["name", "variant"])
    assert manager.get_value_by_name("environments", "hall:2", "type") == "sim_omni"
    assert manager.get_value_by_name("tasks", "count:passive:ground_truth", "scene_count") == 1
    with pytest.raises(BenchbotError, match="nothing called 'hall:7'"):
        manager.get_value_by_name("environments", "hall:7", "type")
    with pytest.raises(BenchbotError, match="no type of add-ons"):
        manager.find_all("task")


def test_functions_of_a_format_need_trust(folder: Path) -> None:
    counts = manager.get_match("formats", [("name", "counts")], return_data=True)
    assert isinstance(counts, dict)
    with pytest.raises(BenchbotError, match="is not trusted"):
        manager.load_functions(counts)
    trust.remember(addons.find(folder))
    plugin_manager.load.cache_clear()
    assert manager.load_functions(counts)["create_object"]() == {"bottle": 0, "chair": 0}
    assert manager.load_functions({}) == {}
