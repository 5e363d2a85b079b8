import json
import os
import stat
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection, select
from benchbot.core.session import Session


@pytest.fixture(scope="module")
def selection() -> Selection:
    return select(
        Catalog(load()), RunRequest(task="sample:passive", robot="sample_robot", environment="arena:1", seed=3)
    )


@pytest.fixture
def session(selection: Selection, tmp_path: Path) -> Session:
    return Session(selection, lambda: host(selection, tmp_path))


def host(selection: Selection, cache_dir: Path) -> InProcessHost:
    robot = selection.robot.data
    simulator = load().record("simulators", robot["type"])
    scenes = [Scene(scene.data, scene.path.parent) for scene in selection.environments]
    motion = MotionConfig.from_robot(robot, selection.localisation)
    return InProcessHost(simulator.create(PlatformSpec(robot, selection.localisation, cache_dir)), scenes, motion)


def chosen(settings: dict[str, Any]) -> Selection:
    return select(
        Catalog(load()),
        RunRequest(task="sample:passive", robot="sample_robot", environment="arena:1", settings=settings),
    )


def played(session: Session) -> dict[str, Any]:
    session.reset()
    while session.actions:
        session.step("move_next")
    return results.finish(results.empty_result(session.selection), session, solution={"command": ["me"]})


def test_an_empty_result_has_v2s_keys(selection: Selection) -> None:
    document = results.empty_result(selection)
    assert list(document) == ["task_details", "environment_details", "results"]
    assert document["task_details"]["name"] == "sample:passive"
    assert document["results"]["objects"] == []


def test_a_finished_result_says_what_it_came_from(session: Session) -> None:
    provenance = played(session)["provenance"]
    assert provenance["selection"] == {
        "task": "sample:passive",
        "robot": "sample_robot",
        "environment": "arena:1",
        "seed": 3,
    }
    assert provenance["failure"] is None
    assert provenance["steps"] == session.progress.steps > 0
    assert provenance["solution"] == {"command": ["me"]}
    assert {"benchbot", "benchbot-sample"} <= set(provenance["plugins"]) | {"benchbot-sample"}
    assert all(len(used["sha256"]) == 64 for used in provenance["plugins"].values())


def test_a_result_says_what_was_set_for_its_run(tmp_path: Path) -> None:
    selection = chosen({"options.tick_sleep_s": 0, "lighting.time": "21:30"})

    document = played(Session(selection, lambda: host(selection, tmp_path)))

    assert document["provenance"]["selection"]["settings"] == {"lighting.time": "21:30", "options.tick_sleep_s": 0}
    results.write_json(tmp_path / "result.json", document)
    assert results.read(tmp_path / "result.json") == document


def test_a_result_pins_the_asset_pack_by_the_content_of_its_catalogue(tmp_path: Path) -> None:
    selection = chosen({"assets": "sample_toys"})

    provenance = played(Session(selection, lambda: host(selection, tmp_path)))["provenance"]

    catalogue = load().record("asset_packs", "sample_toys").catalogue
    assert provenance["assets"] == {"sample_toys": {"sha256": sha256(catalogue.read_bytes()).hexdigest()}}
    assert provenance["selection"]["settings"] == {"assets": "sample_toys"}


def test_the_same_run_gives_the_same_bytes(selection: Selection, tmp_path: Path) -> None:
    paths = [tmp_path / "first.json", tmp_path / "second.json"]
    for path in paths:
        results.write_json(path, played(Session(selection, lambda: host(selection, tmp_path))))
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_what_a_solution_claims_about_the_run_is_replaced(session: Session) -> None:
    session.reset()
    claim = {"results": results.empty_result(session.selection)["results"], "task_details": {"name": "easier"}}
    document = results.finish({**claim, "provenance": {"failure": "none"}}, session)
    assert document["task_details"]["name"] == "sample:passive"
    assert document["provenance"]["selection"]["task"] == "sample:passive"


def test_a_result_that_breaks_its_format_is_the_agents_failure(session: Session) -> None:
    session.reset()
    document = results.empty_result(session.selection)
    document["results"]["objects"] = [{"centroid": [0, 0, 0]}]
    with pytest.raises(BenchbotError, match="breaks the format 'object_map'") as caught:
        results.finish(document, session)
    assert caught.value.failure is FailureClass.AGENT
    with pytest.raises(BenchbotError, match="no key 'results'"):
        results.finish({}, session)


def test_a_failed_episode_has_a_result_document_too(session: Session, tmp_path: Path) -> None:
    session.reset()
    session.fail(FailureClass.AGENT, "It crashed.")
    path = tmp_path / "result.json"
    results.write_json(path, results.failed(session))
    document = results.read(path)
    assert document["provenance"]["failure"] == {"class": "agent", "why": "It crashed."}
    assert "results" not in document


def test_writing_is_atomic_and_respects_the_umask(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "result.json"
    results.write_json(path, {"a": 1})
    results.write_json(path, {"a": 2})
    assert json.loads(path.read_text()) == {"a": 2}
    assert list(path.parent.iterdir()) == [path]
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {1, 2}, b"bytes"])
def test_what_json_cannot_hold_leaves_the_old_file_as_it_was(tmp_path: Path, value: object) -> None:
    path = tmp_path / "result.json"
    results.write_json(path, {"a": 1})
    with pytest.raises(BenchbotError, match="Cannot write"):
        results.write_json(path, {"a": value})
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written_is_named() -> None:
    with pytest.raises(BenchbotError, match=r"Cannot write /dev/null/result\.json") as caught:
        results.write_json(Path("/dev/null/result.json"), {})
    assert caught.value.failure is FailureClass.INFRASTRUCTURE


def test_a_device_is_not_replaced_by_a_file() -> None:
    with pytest.raises(BenchbotError, match="Cannot write /dev/null") as caught:
        results.write_json(Path("/dev/null"), {})
    assert "device" in caught.value.why


def test_a_result_of_an_unknown_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text('{"version": 2}')
    with pytest.raises(BenchbotError, match="is a result of version 2"):
        results.read(path)
    path.write_text('{"version": 1}')
    with pytest.raises(BenchbotError, match="is not a valid result"):
        results.read(path)
