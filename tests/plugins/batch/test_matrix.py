from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits
from benchbot.plugins.batch import matrix
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.folder import Folder, prepare
from benchbot.plugins.batch.plan import Hold, Plan
from benchbot.plugins.batch.request import BatchRequest
from benchbot.submission.modes import ProcessLimits

Make = Callable[..., Plan]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Plans episodes of a small solution in the sample's arenas."""
    (tmp_path / "solution.py").write_text("import beside, mapping.deep.er.model\nopen('weights.bin')\n")
    catalog = Catalog(plugin_manager.load())

    def plan(**changes: Any) -> Plan:
        request = BatchRequest("sample:passive", ["sample_robot"], ["arena:1", "arena:2"], native="python solution.py")
        return matrix.make(replace(request, **changes), catalog, tmp_path)[0]

    return plan


def keys(plan: Plan) -> set[str]:
    return {episode.key for episode in plan.episodes}


def test_every_combination_is_an_episode_of_its_own(make: Make) -> None:
    plan = make(robots=["sample_robot", "sample_careful_robot"], seeds=[0, 1, 2], repeats=2)
    assert len(plan.episodes) == 2 * 2 * 3 * 2
    assert len(keys(plan)) == len({episode.name for episode in plan.episodes}) == len(plan.episodes)


def test_episodes_of_one_scene_follow_one_another(make: Make) -> None:
    scenes = [episode.scene for episode in make(seeds=[0, 1, 2]).episodes]
    assert scenes == sorted(scenes, key=scenes.index)


def test_the_same_request_gives_the_same_plan(make: Make) -> None:
    assert make(seeds=[1]) == make(seeds=[1])


def test_a_device_makes_it_another_plan_where_it_is_asked_for_and_is_kept_with_it(make: Make, tmp_path: Path) -> None:
    left_open, chosen = make(), make(device="cpu")
    assert left_open.device == "auto"
    assert not keys(left_open) & keys(chosen)
    plans.write(tmp_path / "plan.json", chosen)
    again = plans.read(tmp_path / "plan.json")
    assert {again.request_of(episode).device for episode in again.episodes} == {"cpu"}


def test_a_secret_makes_it_another_plan_and_is_kept_with_it(make: Make, tmp_path: Path) -> None:
    plain, hidden = make(), make(secret=16 * "0f")
    assert not keys(plain) & keys(hidden)
    for plan in (plain, hidden):
        plans.write(tmp_path / "plan.json", plan)
        again = plans.read(tmp_path / "plan.json")
        assert {again.request_of(episode).secret for episode in again.episodes} == {plan.secret}
    assert "0f0f" not in repr(hidden)


def test_episodes_of_a_task_with_a_list_are_told_apart(make: Make) -> None:
    plan = make(task="sample:goal", environments=["arena:1"], episodes=[0, 2])
    assert [episode.episode for episode in plan.episodes] == [0, 2]
    assert len(keys(plan)) == 2


@pytest.mark.parametrize(
    "change",
    [
        {"seeds": [1]},
        {"limits": Limits(steps=1)},
        {"timeout_s": 10.0},
        {"words": ("more",)},
        {"robots": ["sample_careful_robot"]},
        {"repeats": 2},
        {"hold": Hold(sandboxed=True)},
        {"hold": Hold(sandboxed=True, limits=ProcessLimits(processes=7))},
    ],
)
def test_whatever_determines_a_result_is_in_its_key(change: dict[str, Any], make: Make) -> None:
    assert keys(make()).isdisjoint(keys(make(**change)))


@pytest.mark.parametrize(
    "name", ["solution.py", "beside.py", "mapping/__init__.py", "mapping/deep/er/model.py", "weights.bin"]
)
def test_an_edited_solution_is_another_one(name: str, make: Make, tmp_path: Path) -> None:
    before = make()
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text("print('goodbye')\n")
    assert keys(make()).isdisjoint(keys(before))


def test_scoring_and_recording_change_no_key(make: Make) -> None:
    assert make(method="omq", record=["frames"]).hash == make().hash


def test_all_reasons_why_it_is_impossible_are_named_at_once(make: Make) -> None:
    with pytest.raises(BenchbotError) as caught:
        make(robots=["sample_robot", "roomba"], environments=["arena:1", "moon:3"])
    assert caught.value.title == "This batch is not possible, for 2 reasons."
    assert "'roomba' is not a known robot" in caught.value.why
    assert "'moon:3' is not a known environment" in caught.value.why


def test_a_real_robot_is_not_moved_unattended(make: Make) -> None:
    with pytest.raises(BenchbotError, match="The robot 'sample_real_robot' is a real one"):
        make(robots=["sample_real_robot"])


def test_a_plan_is_read_as_it_was_written(make: Make, tmp_path: Path) -> None:
    hold = Hold(sandboxed=True, readable=("/data",), limits=ProcessLimits(memory_bytes=2**30))
    plan = make(seeds=[0, 5], repeats=2, record=["frames"], method="omq", limits=Limits(steps=3), hold=hold)
    plans.write(tmp_path / "plan.json", plan)
    assert plans.read(tmp_path / "plan.json") == plan


def test_a_plan_that_somebody_edited_is_refused(make: Make, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    plan = make(seeds=[0, 1])
    plans.write(path, replace(plan, episodes=plan.episodes[:1]))
    with pytest.raises(BenchbotError, match="changed by hand"):
        plans.read(path)


def test_a_folder_with_another_batch_is_left_alone_until_it_is_to_be_updated(make: Make, tmp_path: Path) -> None:
    folder = Folder(tmp_path / "batch")
    before = make(seeds=[0, 1])
    assert prepare(folder, before).before is None
    assert not prepare(folder, before).is_changed
    (tmp_path / "solution.py").write_text("print('goodbye')\n")
    changed = make(seeds=[0, 1])

    with pytest.raises(BenchbotError) as caught:
        prepare(folder, changed)

    assert "the file solution.py of the solution" in caught.value.why
    assert "0 of 4 episodes would stay, 4 would be computed" in caught.value.why
    assert plans.read(folder.plan) == before
    assert len(prepare(folder, changed, update=True).dropped) == 4
    assert plans.read(folder.plan) == changed
    assert plans.read(folder.path / f"plan-{before.hash[:8]}.json") == before


def test_a_folder_of_something_else_is_refused(make: Make, tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="not the folder of a batch"):
        prepare(Folder(tmp_path), make())
