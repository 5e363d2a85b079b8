"""Plain walls are found, and the waves on them measured, in pictures of which both are known."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_sim_taichi.renderer import Frame, Intrinsics
from benchmarks import plain_walls
from benchmarks.bench_quality import LUMA

CAMERA = Intrinsics.from_horizontal_fov(160, 120, 90.0)
POSE = np.array([[0.0, 0.0, 1.0, 1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]])
COLUMN, ROW = np.meshgrid(np.arange(160), np.arange(120))
GREY = np.full((120, 160, 3), 128.0)
WALL = np.ones((120, 160), np.int32)
PAINT = Material("paint")
CORNER_COLUMN = 80


def room(*materials: Material, images: tuple[npt.NDArray[np.uint8], ...] = ()) -> tuple[SceneGeometry, Frame]:
    """Two walls that meet in a corner before the camera, the left one instance 1, and the picture of them."""
    corners = np.array([(4, 0), (1, 3), (1, -3)], float)
    vertices = np.array([(*corner, z) for corner in corners for z in (-9, 9)], np.float32)
    triangles = np.array([(0, 1, 2), (1, 2, 3), (0, 1, 4), (1, 4, 5)], np.int32)
    scene = SceneGeometry(
        vertices=vertices,
        triangles=triangles,
        triangle_instance=np.array([1, 1, 2, 2], np.int32),
        triangle_material=np.array([0, 0, 1, 1], np.int32),
        normals=np.zeros((6, 3), np.float32),
        uvs=np.zeros((6, 2), np.float32),
        materials=materials,
        instances=(Instance(1, "left", None), Instance(2, "right", None)),
        images=images,
    )
    # A ray (1, y) meets x + |y| = 3 in the camera's frame, where x points forwards.
    sideways = (CAMERA.cx - COLUMN - 0.5) / CAMERA.fx
    depth_m = (3.0 / (1.0 + np.abs(sideways))).astype(np.float32)
    instance = np.where(sideways > 0, 1, 2).astype(np.int32)
    return scene, Frame(GREY.astype(np.uint8), depth_m, instance)


def found(scene: SceneGeometry, frame: Frame, reference: npt.NDArray[np.float64] = GREY) -> npt.NDArray[np.int32]:
    return plain_walls.find(scene, frame, POSE, CAMERA, reference)


def test_both_walls_of_a_corner_are_found_and_the_corner_is_not() -> None:
    walls = found(*room(PAINT, PAINT))
    assert walls.max() == 2
    left, right = walls[:, 5:60], walls[:, 100:155]
    assert {1, 2} == {*left.ravel().tolist(), *right.ravel().tolist()}
    assert (left == left[0, 0]).all()
    assert (right == right[0, 0]).all()
    assert not walls[:, CORNER_COLUMN - plain_walls.MARGIN_PX : CORNER_COLUMN + plain_walls.MARGIN_PX].any()


def test_walls_of_one_instance_end_at_the_corner_too() -> None:
    scene, frame = room(PAINT, PAINT)
    one = replace(scene, triangle_instance=np.ones(4, np.int32))
    assert found(one, replace(frame, instance=np.ones_like(frame.instance))).max() == 2


NOISE = np.random.default_rng(0).integers(0, 256, (16, 16, 4)).astype(np.uint8)


@pytest.mark.parametrize(
    "material",
    [
        Material("wallpaper", base_color_image=0),
        Material("plaster", normal_image=0),
        Material("lamp", emission=(1.0, 1.0, 1.0)),
        Material("pane", transmission=1.0),
        Material("lacquer", roughness=0.1),
        Material("lattice", alpha_cutoff=0.5),
    ],
)
def test_what_is_not_plain_is_left_out(material: Material) -> None:
    walls = found(*room(material, PAINT, images=(NOISE,)))
    assert walls.max() == 1
    assert not walls[:, :CORNER_COLUMN].any()


def test_a_painted_wall_may_have_an_image_of_next_to_no_contrast() -> None:
    grain = np.full((16, 16, 4), 200, np.uint8) + (NOISE % 3)
    assert found(*room(Material("roller", base_color_image=0), PAINT, images=(grain,))).max() == 2


def test_a_wall_with_a_strip_of_another_material_in_its_plane_is_left_out() -> None:
    scene, frame = room(PAINT, PAINT, Material("wallpaper", base_color_image=0), images=(NOISE,))
    striped = replace(scene, triangle_material=np.array([0, 2, 1, 1], np.int32))
    assert found(striped, frame).max() == 1


def test_an_edge_of_a_shadow_in_the_reference_is_left_out_and_a_soft_gradient_is_not() -> None:
    shadow = np.where(COLUMN[..., None] < 40, 60.0, 128.0) * np.ones(3)
    walls = found(*room(PAINT, PAINT), shadow)
    assert not walls[:, 40 - plain_walls.MARGIN_PX : 40 + plain_walls.MARGIN_PX].any()
    assert walls.max() == 3
    soft = 60.0 + 0.7 * COLUMN[..., None] * np.ones(3)
    assert (found(*room(PAINT, PAINT), soft) == found(*room(PAINT, PAINT))).all()


def test_a_curved_surface_is_no_wall() -> None:
    scene, frame = room(PAINT, PAINT)
    pillar = 3.0 - np.sqrt(1.0 - ((COLUMN - 80) / 200.0) ** 2)
    assert not found(scene, replace(frame, depth_m=pillar.astype(np.float32))).any()


def test_a_sky_of_no_depth_is_no_wall() -> None:
    scene, frame = room(PAINT, PAINT)
    nothing = Frame(frame.rgb, np.full_like(frame.depth_m, np.inf), np.zeros_like(frame.instance))
    assert not found(scene, nothing).any()


def wave(length_px: float, angle_deg: float, amplitude: float) -> npt.NDArray[np.float64]:
    angle = np.radians(angle_deg)
    along = COLUMN * np.cos(angle) + ROW * np.sin(angle)
    waves: npt.NDArray[np.float64] = GREY + amplitude * np.sin(2 * np.pi * along / length_px)[..., None]
    return waves


@settings(max_examples=30, deadline=None)
@given(length_px=st.floats(7, 15), angle_deg=st.floats(0, 180), amplitude=st.floats(0.5, 10))
def test_waves_within_the_band_pass_nearly_whole(length_px: float, angle_deg: float, amplitude: float) -> None:
    picture = wave(length_px, angle_deg, amplitude)
    sigma = np.sqrt(plain_walls.covariance(picture, picture, WALL))
    assert sigma == pytest.approx(amplitude / np.sqrt(2), rel=0.25)


@settings(max_examples=20, deadline=None)
@given(length_px=st.one_of(st.floats(2, 2.3), st.floats(150, 1000)), angle_deg=st.floats(0, 180))
def test_grain_and_the_falling_off_of_light_do_not(length_px: float, angle_deg: float) -> None:
    picture = wave(length_px, angle_deg, 10.0)
    assert plain_walls.covariance(picture, picture, WALL) < 0.1 * 10.0**2 / 2


@pytest.mark.parametrize("length_px", plain_walls.BAND_PX)
def test_half_of_the_amplitude_is_left_at_the_ends_of_the_band(length_px: float) -> None:
    narrow = np.zeros_like(WALL)
    narrow[30:90, 40:120] = 1
    picture = wave(length_px, 0.0, 8.0)
    inner = plain_walls.band(picture @ LUMA, WALL).reshape(WALL.shape)[narrow > 0]
    assert inner.std() == pytest.approx(0.5 * 8.0 / np.sqrt(2), rel=0.1)


@settings(max_examples=20, deadline=None)
@given(offset=st.floats(-100, 100), gain=st.floats(0.1, 5), seed=st.integers(0, 2**31))
def test_the_measure_ignores_brightness_and_grows_with_contrast(offset: float, gain: float, seed: int) -> None:
    picture = np.random.default_rng(seed).normal(128.0, 3.0, GREY.shape)
    before = plain_walls.covariance(picture, picture, WALL)
    assert plain_walls.covariance(picture + offset, picture + offset, WALL) == pytest.approx(before, rel=1e-6)
    assert plain_walls.covariance(gain * picture, gain * picture, WALL) == pytest.approx(gain**2 * before, rel=1e-6)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_independent_noise_of_two_pictures_averages_out_and_what_they_share_stays(seed: int) -> None:
    random = np.random.default_rng(seed)
    shared = wave(10.0, 30.0, 2.0)
    one, other = (shared + random.normal(0.0, 5.0, GREY.shape) for _ in range(2))
    clean = plain_walls.covariance(shared, shared, WALL)
    assert plain_walls.covariance(one, one, WALL) > 1.3 * clean
    assert plain_walls.covariance(one, other, WALL) == pytest.approx(clean, rel=0.25)


@settings(max_examples=10, deadline=None)
@given(brightness=st.floats(0, 255))
def test_what_lies_beside_a_wall_does_not_count(brightness: float) -> None:
    walls = np.zeros_like(WALL)
    walls[20:100, 20:70], walls[20:100, 72:140] = 1, 2
    picture = np.where((walls == 2)[..., None], 200.0, 100.0) * np.ones(3)
    picture[walls == 0] = brightness
    assert plain_walls.covariance(picture, picture, walls) == pytest.approx(0.0, abs=1e-12)
