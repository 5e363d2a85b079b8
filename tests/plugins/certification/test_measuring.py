"""The reference is the same robot in another simulator, and its scores are kept by what they depend on."""

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Level
from benchbot.core.plugin_manager import load
from benchbot.plugins.certification import measuring
from benchbot.plugins.certification.command import robot_to_certify

ROOMS = ["arena:1"]


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog(load())


def test_the_reference_has_the_same_robot_in_the_same_rooms(catalog: Catalog) -> None:
    robot = catalog.get("robots", "sample_robot")
    twin = measuring.in_the_reference(robot, "sim_taichi")
    assert twin["type"] == "sim_taichi"
    assert twin["runs_in"] == ["sim_sample", "sim_taichi"]
    changed = {"name", "type", "runs_in"}
    assert {key: value for key, value in twin.items() if key not in changed} == {
        key: value for key, value in robot.data.items() if key not in changed
    }


def test_of_several_robots_the_one_with_the_smallest_pictures_is_certified_and_none_with_an_arm(
    catalog: Catalog,
) -> None:
    chosen = robot_to_certify("sim_mujoco", None, catalog)
    arms = [name for name, robot in catalog.pool("robots").items() if "arm" in robot.data]

    assert chosen.name == "carter_lowres_mujoco"
    assert chosen.name not in arms
    assert arms


def test_scores_are_kept_under_what_they_depend_on(catalog: Catalog, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = measuring.in_the_reference(catalog.get("robots", "sample_robot"), "sim_taichi")
    quick, whole = (measuring.measurement(ROOMS, quick=quick) for quick in (True, False))
    kept = measuring.reference_folder(robot, quick, catalog)
    assert kept == measuring.reference_folder(robot, quick, catalog)
    others = {
        measuring.reference_folder(robot, whole, catalog),
        measuring.reference_folder(robot, measuring.measurement(["arena:2"], quick=True), catalog),
        measuring.reference_folder({**robot, "footprint": {"radius_m": 0.3}}, quick, catalog),
    }
    # Code may change under the same version, as that of an editable installation does.
    monkeypatch.setattr(measuring, "distribution_hash", lambda name: f"changed {name}")
    others.add(measuring.reference_folder(robot, quick, catalog))
    assert len({kept, *others}) == 5


def test_every_solution_in_every_room_has_a_row() -> None:
    measured = measuring.measurement(["miniroom:1", "miniroom:2"], quick=True)
    found = measuring.rows(measured, {("mapper", "miniroom:1"): 0.9}, {("mapper", "miniroom:1"): 0.8})
    assert [(row.solution, row.room) for row in found] == [
        (name, room) for name in ("mapper", "mapper_sparse") for room in ("miniroom:1", "miniroom:2")
    ]
    assert [row.difference is None for row in found] == [False, True, True, True]


def test_the_kit_runs_in_a_process_of_its_own() -> None:
    findings = measuring.conformance("sim_sample", "sample_robot", "arena:1")
    assert {"clean start", "golden room: load"} <= {one.subject for one in findings}
    assert Level.BROKEN not in {one.level for one in findings}


def test_a_simulator_that_ends_the_process_is_told() -> None:
    (found,) = measuring.conformance("sim_sample", "sample_robot", "faulty:crash")
    assert found.level is Level.BROKEN
    assert "ended the process that checked it, with status -6" in found.detail
