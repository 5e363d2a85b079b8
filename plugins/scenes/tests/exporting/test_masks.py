"""What exported files show: the same object in each pixel, but for pixels whose middle is on a contour."""

from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot_scenes.exporting import mjcf, sdf, usd
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
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
