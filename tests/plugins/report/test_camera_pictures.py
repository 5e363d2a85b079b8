import base64
import io
from pathlib import Path

import numpy as np
from PIL import Image

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.map_model import Box
from benchbot.plugins.report.camera_pictures import Budget, Camera, Frame, best_frame, crop, thumbnail
from tests.plugins.report.test_camera import ROBOT

BOX = Box((3.0, 0.0, 1.0), (0.4, 0.4, 0.4))


def camera() -> Camera:
    found = Camera.of(ROBOT)
    assert found is not None
    return found


def frame(folder: Path, x: float = 0.0, scene: int = 0) -> Frame:
    path = folder / f"{x}.png"
    Image.fromarray(np.full((180, 320, 3), 128, np.uint8)).save(path)
    return Frame(path, scene, Pose.planar(x, 0.0, 0.0))


def opened(uri: str | None) -> Image.Image:
    assert uri is not None
    return Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2])))


def test_the_best_frame_is_the_nearest_of_the_scene_that_shows_the_whole_box(tmp_path: Path) -> None:
    frames = [frame(tmp_path, x) for x in (-2.0, 1.0, 2.7, 5.0)] + [frame(tmp_path, 1.5, scene=1)]

    best = best_frame(frames, camera(), BOX, 0, [])

    assert best is frames[1]
    assert best_frame(frames[3:], camera(), BOX, 0, []) is None


def test_a_box_is_drawn_where_it_is_in_the_picture(tmp_path: Path) -> None:
    picture = np.asarray(opened(crop(frame(tmp_path), camera(), [(BOX, (255, 0, 0))], Budget())), int)

    assert picture.shape == (200, 300, 3)
    red = picture[..., 0] - picture[..., 1] > 100
    rows, columns = np.nonzero(red)
    assert abs(rows.mean() - 100) < 6
    assert abs(columns.mean() - 150) < 6
    assert not red[:30].any()


def test_a_page_has_no_more_pictures_than_it_may_weigh(tmp_path: Path) -> None:
    seen, budget = frame(tmp_path), Budget(left=1500)

    uris = [thumbnail(seen, budget) for _ in range(4)]

    assert uris[0] is not None
    assert uris[-1] is None
    assert budget.left >= 0
    assert budget.refused == uris.count(None) > 0
