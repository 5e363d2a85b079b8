"""Layouts that say how they differ from a base."""

from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import Catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import object_boxes
from benchbot_scenes.layout import Building, Layout, Move, Placement, read_layout, write_layout
from benchbot_scenes.scene import SceneGeometry
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import WEST

OBJECTS = (
    Placement("chair 1", "chair", (1.0, 2.0, 0.0)),
    Placement("chair 2", "chair", (3.0, 2.0, 0.0), yaw_deg=30.0),
    Placement("table 1", "table", (2.0, 1.0, 0.0)),
)
FIRST = Layout("blocks", Building(2.5, 0.3, (WEST,), ()), OBJECTS)


@pytest.fixture
def blocks(tmp_path: Path) -> Catalogue:
    return packs.pack(tmp_path / "blocks")


@pytest.fixture(params=["layout", "scene file"])
def base(request: pytest.FixtureRequest, tmp_path: Path, blocks: Catalogue) -> Path:
    """The same scene as a layout and as a finished file."""
    if request.param == "layout":
        write_layout(tmp_path / "first.yaml", FIRST)
        return tmp_path / "first.yaml"
    (tmp_path / "first.glb").write_bytes(compose(FIRST, {"blocks": blocks}))
    return tmp_path / "first.glb"


def composed(folder: Path, layout: Layout, blocks: Catalogue) -> SceneGeometry:
    path = folder / "changed.glb"
    path.write_bytes(compose(layout, {"blocks": blocks}))
    return load_scene(path)


def objects(scene: SceneGeometry) -> set[str]:
    return {instance.name for instance in scene.instances if instance.class_name is not None or "1" in instance.name}


def test_objects_are_removed_and_added(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    added = Placement("chair 3", "chair", (2.0, 2.0, 0.0))
    scene = composed(tmp_path, Layout("blocks", base=base, removed=("chair 1",), objects=(added,)), blocks)
    assert objects(scene) == {"chair 2", "chair 3", "table 1"}


def test_a_removed_object_may_be_replaced_under_its_name(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    table = Placement("chair 1", "table", (1.0, 1.0, 0.0))
    scene = composed(tmp_path, Layout("blocks", base=base, removed=("chair 1",), objects=(table,)), blocks)
    low, high = object_boxes(scene)["chair 1"]
    assert high - low == pytest.approx([0.8, 1.6, 0.7], abs=1e-4)


def test_a_moved_object_stands_elsewhere_and_is_turned_further(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    moves = (Move("chair 1", (3.0, 1.0, 0.0)), Move("table 1", (2.0, 2.2, 0.5), 90.0))
    scene = composed(tmp_path, Layout("blocks", base=base, moved=moves), blocks)
    low, high = object_boxes(scene)["chair 1"]
    assert (*low, *high) == pytest.approx((2.75, 0.8, 0.0, 3.25, 1.2, 0.9), abs=1e-4)
    low, high = object_boxes(scene)["table 1"]
    assert (*low, *high) == pytest.approx((1.2, 1.8, 0.5, 2.8, 2.6, 1.2), abs=1e-4)


def test_differences_pile_up(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    second = Layout("blocks", base=base, moved=(Move("table 1", (2.0, 2.0, 0.0), 45.0),), removed=("chair 2",))
    write_layout(tmp_path / "second.yaml", second)
    third = Layout("blocks", base=tmp_path / "second.yaml", moved=(Move("table 1", (1.0, 1.0, 0.0), 45.0),))
    scene = composed(tmp_path, third, blocks)
    assert objects(scene) == {"chair 1", "table 1"}
    low, high = object_boxes(scene)["table 1"]
    assert (*low, *high) == pytest.approx((0.2, 0.6, 0.0, 1.8, 1.4, 0.7), abs=1e-4)


@pytest.mark.parametrize(
    "changes",
    [
        {"removed": ("chiar 1",)},
        {"removed": ("chair 1", "chair 1")},
        {"moved": (Move("chiar 1", (0.0, 0.0, 0.0)),)},
        {"moved": (Move("chair 1", (0.0, 0.0, 0.0)),), "removed": ("chair 1",)},
    ],
)
def test_only_what_the_base_has_can_change(
    tmp_path: Path, base: Path, blocks: Catalogue, changes: dict[str, Any]
) -> None:
    with pytest.raises(BenchbotError, match="which its base does not have"):
        composed(tmp_path, Layout("blocks", base=base, **changes), blocks)


def test_the_nearest_name_is_offered(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    with pytest.raises(BenchbotError) as caught:
        composed(tmp_path, Layout("blocks", base=base, removed=("table_1",)), blocks)
    assert "Did you mean 'table 1'?" in caught.value.why


def test_an_id_names_one_object(tmp_path: Path, base: Path, blocks: Catalogue) -> None:
    again = Placement("table 1", "table", (1.0, 1.0, 0.0))
    with pytest.raises(BenchbotError, match="'table 1'"):
        composed(tmp_path, Layout("blocks", base=base, objects=(again,)), blocks)


def test_a_layout_cannot_be_its_own_base(tmp_path: Path, blocks: Catalogue) -> None:
    write_layout(tmp_path / "a.yaml", Layout("blocks", base=tmp_path / "b.yaml"))
    write_layout(tmp_path / "b.yaml", Layout("blocks", base=tmp_path / "a.yaml"))
    with pytest.raises(BenchbotError, match="difference to itself") as caught:
        compose(read_layout(tmp_path / "a.yaml"), {"blocks": blocks})
    assert "b.yaml → a.yaml → b.yaml" in caught.value.why


def test_a_missing_base_is_named(tmp_path: Path, blocks: Catalogue) -> None:
    for name in ("missing.yaml", "missing.glb"):
        with pytest.raises(BenchbotError, match=name):
            compose(Layout("blocks", base=tmp_path / name), {"blocks": blocks})
