import base64
import io
from pathlib import Path

import numpy as np
from PIL import Image

from benchbot.core.geometry import Pose
from benchbot.evaluation.evidence import Boxes, Scene
from benchbot.evaluation.frames import Frame
from benchbot.plugins.drawing.map_model import Box
from benchbot.plugins.report.camera_pictures import Budget, Outline, Shot, crop, thumbnail, tile
from tests.plugins.report.test_camera import camera

BOX = Box((3.0, 0.0, 1.0), (0.4, 0.4, 0.4))


def frame(folder: Path, x: float = 0.0) -> Frame:
    path = folder / f"{x}.png"
    Image.fromarray(np.full((180, 320, 3), 128, np.uint8)).save(path)
    return Frame(path, 0, Pose.planar(x, 0.0, 0.0))


def shot(folder: Path, *hiding: Box) -> Shot:
    return Shot(frame(folder), camera(), Scene(Boxes.of([(box.centroid, box.extent) for box in hiding])))


def opened(uri: str | None) -> Image.Image:
    assert uri is not None
    return Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2])))


def test_a_box_is_drawn_where_it_is_in_the_picture(tmp_path: Path) -> None:
    picture = np.asarray(opened(crop(shot(tmp_path), [Outline(BOX, (255, 0, 0))], Budget())), int)

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


def test_hidden_edges_are_dashed_and_texts_do_not_cover_one_another(tmp_path: Path) -> None:
    red = Outline(BOX, (255, 0, 0), "cup")
    screen = Box((1.5, 0.0, 1.0), (0.1, 3.0, 3.0))

    def count(shown: Shot, *outlines: Outline) -> int:
        picture = tile(shown, outlines)
        assert picture is not None
        pixels = np.asarray(picture, int)
        return int((pixels[..., 0] - pixels[..., 1] > 100).sum())

    whole, dashed = (count(shot(tmp_path, *hiding), Outline(BOX, (255, 0, 0))) for hiding in ((), (screen,)))
    assert 0.2 * whole < dashed < 0.7 * whole
    # Two texts of one box stand apart, or the second would hide the first.
    one, two = count(shot(tmp_path), red), count(shot(tmp_path), red, Outline(BOX, (0, 0, 255), "bottle? 0.71"))
    assert two > 0.2 * (one - whole)
