"""What crosses a pane is cut at it: its outer half is lit by the day, its inner half by the room."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import parting
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.quality import PATH, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb

PANE = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
QUAD = np.array([[0, 1, 2], [0, 2, 3]])
EVEN_SKY = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=Sky((1, 1, 1), (1, 1, 1), (1, 1, 1)))


def beside_a_pane(corners: npt.NDArray[np.float64], folder: Path) -> SceneGeometry:
    """Triangles (T, 3, 3) and a pane of 2 x 2 m in the plane y = 0."""
    glb = Glb()
    glb.add("pane", PANE, QUAD, glb.material(glass=True))
    glb.add("surface", corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), glb.material())
    return load_scene(glb.write(folder / "scene.glb"))


def areas_m2(scene: SceneGeometry) -> npt.NDArray[np.float64]:
    corner = scene.vertices[scene.triangles].astype(np.float64)
    area: npt.NDArray[np.float64] = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    return area / 2


def dark_walls(glb: Glb, half_m: float, front_m: float) -> None:
    """A room 2 m high and open at y = `front_m`."""
    black, around_m = glb.material((0.01,) * 3), half_m + 0.1
    for name, low, high in (
        ("floor", (-half_m, -3, -1.1), (half_m, front_m, -1)),
        ("ceiling", (-half_m, -3, 1), (half_m, front_m, 1.1)),
        ("west", (-around_m, -3, -1.1), (-half_m, front_m, 1.1)),
        ("east", (half_m, -3, -1.1), (around_m, front_m, 1.1)),
        ("south", (-around_m, -3.1, -1.1), (around_m, -3, 1.1)),
    ):
        glb.box(name, low, high, black)


def green_of_columns(
    scene: SceneGeometry, quality: Quality, cache: Path, pose: npt.NDArray[np.float64], camera: Intrinsics
) -> npt.NDArray[np.float64]:
    frame = Renderer(scene, EVEN_SKY, cache_dir=cache, quality=quality).render(pose, camera)
    green: npt.NDArray[np.float64] = frame.rgb[:, :, 1].mean(axis=0)
    return green


hundredths = st.integers(-80, 80).map(lambda number: number / 100)
triangles = st.lists(st.tuples(*[st.tuples(hundredths, hundredths, hundredths)] * 3), min_size=1, max_size=6)


@given(triangles)
def test_pieces_cover_what_was_cut_and_none_crosses(
    tmp_path_factory: pytest.TempPathFactory, corners: list[tuple[tuple[float, float, float], ...]]
) -> None:
    scene = beside_a_pane(np.array(corners), tmp_path_factory.mktemp("scene"))

    parted = parting.parted(scene)

    for instance in scene.instances:
        before, after = (areas_m2(s)[s.triangle_instance == instance.index].sum() for s in (scene, parted))
        assert after == pytest.approx(before, abs=1e-5)
    of_surface = parted.triangle_material != parted.triangle_material[0]
    y = parted.vertices[parted.triangles[of_surface], 1]
    assert ((y >= -parting.THICKNESS_M).all(axis=1) | (y <= parting.THICKNESS_M).all(axis=1)).all()
    assert parting.parted(parted) is parted
    assert (np.diff(parted.triangle_instance) >= 0).all()


def test_what_is_beside_a_pane_stays_whole(tmp_path: Path) -> None:
    beside = np.array([[[1.5, -1, 0], [1.5, 1, 0], [1.5, 0, 1]], [[0, 0.1, 0], [0.5, 0.1, 0], [0, 0.1, 0.5]]])
    scene = beside_a_pane(beside, tmp_path)
    assert parting.parted(scene) is scene


def test_reveals_beside_a_window_s_frame_are_cut_and_walls_before_it_are_not_set_apart(tmp_path: Path) -> None:
    reveal = np.array([[[1.1, -0.15, -1], [1.1, 0.1, -1], [1.1, 0.1, 1]]])
    assert len(parting.parted(beside_a_pane(reveal, tmp_path)).triangles) == 2 + 3
    wall = np.array([[[1.1, -0.1, -1], [3.0, -0.1, -1], [1.1, -0.1, 1]]])
    assert not parting.sides(beside_a_pane(wall, tmp_path)).any()


@pytest.mark.xdist_group("renderer")
def test_a_reveal_gets_no_daylight_through_the_window_s_frame(tmp_path: Path, kernel_cache: Path) -> None:
    glb = Glb()
    white, frame = (glb.material((share,) * 3) for share in (0.8, 0.3))
    dark_walls(glb, 1.4, -0.15)
    for name, low, high in (
        ("left", (-1.5, -0.15, -1.1), (-0.67, 0.1, 1.1)),
        ("right", (0.67, -0.15, -1.1), (1.5, 0.1, 1.1)),
        ("below", (-0.67, -0.15, -1.1), (0.67, 0.1, -0.67)),
        ("above", (-0.67, -0.15, 0.67), (0.67, 0.1, 1.1)),
    ):
        glb.box(name, low, high, white)
    for side in (-1, 1):
        near, far = sorted((side * 0.6, side * 0.67))
        glb.box(f"post {side}", (near, -0.035, -0.67), (far, 0.035, 0.67), frame)
        glb.box(f"rail {side}", (-0.6, -0.035, near), (0.6, 0.035, far), frame)
    glb.add("pane", 0.6 * PANE, QUAD, glb.material((0.9,) * 3, glass=True, roughness=0.0))
    scene = load_scene(glb.write(tmp_path / "room.glb"))

    # From the room along the right reveal to the frame.
    camera = looking((-0.6, -0.9, 0.0), 33.0), Intrinsics.from_horizontal_fov(128, 24, 12.0)
    ours, paths = (green_of_columns(scene, quality, kernel_cache, *camera) for quality in (REALTIME, PATH))

    reveal = slice(52, 90)
    assert np.ptp(paths[reveal]) > 25
    assert np.abs(ours - paths)[reveal].mean() < 6  # 12 where the day's light is averaged with the room's


@pytest.mark.xdist_group("renderer")
def test_a_rail_is_lit_before_the_pane_by_the_day_and_behind_it_by_the_room(tmp_path: Path, kernel_cache: Path) -> None:
    glb = Glb()
    dark_walls(glb, 1.0, 0.0)
    glb.add("pane", PANE, QUAD, glb.material((0.2,) * 3, glass=True, roughness=0.0))
    glb.box("rail", (-0.03, -0.04, -1.0), (0.03, 0.04, 1.0), glb.material((0.8,) * 3))
    scene = load_scene(glb.write(tmp_path / "room.glb"))

    # The outer half of the rail is seen through the pane.
    camera = looking((-0.7, -0.7, 0.0), 45.0), Intrinsics.from_horizontal_fov(192, 32, 12.0)
    ours, paths = (green_of_columns(scene, quality, kernel_cache, *camera) for quality in (REALTIME, PATH))

    sides = slice(55, 100)
    assert np.ptp(paths[sides]) > 5
    # Denoising spreads the step at the pane over five columns; ours lies between two.
    step = sides.start + np.abs(np.diff(paths[sides])).argmax()
    columns = np.array([column for column in range(192)[sides] if abs(column - step) > 2])
    np.testing.assert_allclose(ours[columns], paths[columns], atol=2)
    assert ours[sides] == pytest.approx(np.clip(ours[sides], paths[sides].min(), paths[sides].max()), abs=2)
