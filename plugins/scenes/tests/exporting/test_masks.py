"""What exported files show: the same object in each pixel, but for pixels whose middle is on a contour."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.exporting import mjcf, sdf, usd
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import Instance, Material, SceneGeometry
from plugins.scenes.tests.exporting import masks, opened, rooms


@pytest.mark.parametrize(
    ("files", "drawn", "suffix"),
    [(mjcf.files, masks.of_mjcf, "xml"), (usd.files, masks.of_usd, "usdc"), (sdf.files, masks.of_sdf, "sdf")],
    ids=["mjcf by MuJoCo", "usd by Embree", "sdf by Drake"],
)
def test_the_masks_are_those_of_the_scene(
    tmp_path: Path,
    files: Callable[[SceneGeometry, str], dict[str, bytes]],
    drawn: Callable[[Path, masks.Eye], masks.Mask],
    suffix: str,
) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    path = opened.written(files(geometry, "room_1"), tmp_path) / f"room_1.{suffix}"
    eye = masks.Eye(160, 90, 80.0, masks.looking((1.0, 1.0, 1.9), yaw_deg=34.0, down_deg=10.0))
    own = masks.of_geometry(geometry, eye)
    assert len(set(own.ravel().tolist())) > 8
    assert (drawn(path, eye) == own).mean() > 0.999


@pytest.mark.parametrize("from_x_m", [0.0, 4.0], ids=["the front", "the back"])
def test_mujoco_draws_both_sides_of_what_has_two(tmp_path: Path, from_x_m: float) -> None:
    pane = SceneGeometry(
        vertices=np.array([[2, -1, 0], [2, 1, 0], [2, 1, 2], [2, -1, 2]], np.float32),
        triangles=np.array([[0, 2, 1], [0, 3, 2]], np.int32),
        triangle_instance=np.ones(2, np.int32),
        triangle_material=np.zeros(2, np.int32),
        normals=np.tile(np.array([-1, 0, 0], np.float32), (4, 1)),
        uvs=np.zeros((4, 2), np.float32),
        materials=(Material(double_sided=True),),
        instances=(Instance(1, "pane", None),),
    )
    path = opened.written(mjcf.files(pane, "room_1"), tmp_path) / "room_1.xml"
    eye = masks.Eye(40, 30, 20.0, masks.looking((from_x_m, 0.0, 1.0), yaw_deg=45.0 * from_x_m, down_deg=0.0))
    mask = masks.of_mjcf(path, eye)
    assert (mask == masks.of_geometry(pane, eye)).all()
    assert {"pane", ""} == set(mask.ravel().tolist())
