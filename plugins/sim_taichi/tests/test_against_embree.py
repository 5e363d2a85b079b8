"""Whatever the scene and the pose: planar depth and ids are Embree's, and nothing that a mesh holds stops a kernel."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.renderer import Frame, Intrinsics, Renderer
from benchmarks.rays.scene import DEPTH_M, HEIGHT_M, WIDTH_M, generate
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.embree import Embree, Seen

pytestmark = pytest.mark.xdist_group("renderer")

CAMERA = Intrinsics.from_horizontal_fov(160, 90, 90.0)
DARK = (0.0, 0.0, 0.0)
NIGHT = Lighting(sun=Sun(irradiance=DARK), sky=Sky(DARK, DARK, DARK))
STEPS = (-1e-3, -3e-4, 0.0, 3e-4, 1e-3)
AROUND = [(x, y) for x in STEPS for y in STEPS]
Corners = list[tuple[float, float, float]]

poses = st.builds(
    looking,
    st.tuples(st.floats(0.1, WIDTH_M - 0.1), st.floats(0.1, DEPTH_M - 0.1), st.floats(0.1, HEIGHT_M - 0.1)),
    st.floats(-180, 180),
    st.floats(-85, 85),
)


@pytest.fixture(scope="module", params=[20_000, 200_000])
def both(request: pytest.FixtureRequest, kernel_cache: Path) -> tuple[Renderer, Embree]:
    scene = generate(request.param, seed=3)
    return Renderer(scene, NIGHT, cache_dir=kernel_cache), Embree(scene)


@settings(max_examples=25, deadline=None)
@given(pose=poses)
def test_depth_and_ids_are_embrees_from_anywhere(both: tuple[Renderer, Embree], pose: np.ndarray) -> None:
    renderer, embree = both
    frame = renderer.render(pose, CAMERA, rgb=False)
    seen = embree.see(pose, CAMERA)
    # A camera in a surface may see either side of it.
    assume(min(frame.depth_m.min(), seen[0].min()) > 1e-3)
    equal = agree(frame, seen)
    # An edge may run through the middles of a whole diagonal of pixels: 1.1 % of them.
    assert equal.mean() >= 0.98
    # A ray along an edge may meet either side of it: what Embree sees a thousandth of a pixel aside.
    for aside in AROUND if not equal.all() else ():
        equal |= agree(frame, embree.see(pose, CAMERA, aside))
    # Seen edge-on, depth changes by more than a millimetre even in so small a step: one pixel of 14400.
    assert equal.mean() >= 0.9999
    assert np.array_equal(np.isinf(frame.depth_m), frame.instance == 0)


def agree(frame: Frame, seen: Seen) -> np.ndarray:
    depth, instance = seen
    far = np.isinf(depth) & np.isinf(frame.depth_m)
    close = np.abs(np.where(far, 0, frame.depth_m) - np.where(far, 0, depth)) < 1e-3
    equal: np.ndarray = (frame.instance == instance) & close
    return equal


def triangles(corners: list[Corners]) -> SceneGeometry:
    """Each three corners are an instance of their own."""
    vertices = np.array(corners, np.float32).reshape(-1, 3)
    count = len(corners)
    return SceneGeometry(
        vertices=vertices,
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        triangle_instance=np.arange(1, count + 1, dtype=np.int32),
        triangle_material=np.zeros(count, np.int32),
        normals=np.tile(np.array([[0, 0, 1]], np.float32), (3 * count, 1)),
        uvs=np.zeros((3 * count, 2), np.float32),
        materials=(Material(),),
        instances=tuple(Instance(i + 1, f"triangle {i}", None) for i in range(count)),
    )


GOOD = [(2.0, -9.0, -9.0), (2.0, 9.0, -9.0), (2.0, 0.0, 9.0)]


NONE: dict[str, Corners] = {
    "a point": [(1.0, 0.0, 0.0)] * 3,
    "a line": [(1.0, -1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)],
    "nan": [(np.nan, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 1.0)],
    "inf": [(1.0, -np.inf, -1.0), (1.0, np.inf, -1.0), (1.0, 0.0, 1.0)],
    "tiny": [(1e-30, 0.0, 0.0), (1e-30, 1e-30, 0.0), (0.0, 0.0, 1e-30)],
    "huge": [(1.0, -1e20, -1e20), (1.0, 1e20, -1e20), (1.0, 0.0, 1e20)],
}


@pytest.mark.parametrize(
    ("name", "rgb"), [*((name, False) for name in NONE), *((name, True) for name in ("nan", "a point", "huge"))]
)
def test_a_triangle_that_is_none_is_not_there(name: str, rgb: bool, kernel_cache: Path) -> None:
    renderer = Renderer(triangles([NONE[name], GOOD, NONE[name]]), Lighting(exposure=1.0), cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, 0.0, 0.0), 0.0), CAMERA, rgb=rgb)
    assert frame.instance[45, 80] == 2
    assert frame.depth_m[45, 80] == pytest.approx(2.0, abs=1e-5)
    assert set(np.unique(frame.instance)) <= {0, 2}


@pytest.mark.parametrize("corners", [[], [[(0.0, 0.0, 0.0)] * 3]], ids=["no triangle", "none with an area"])
@pytest.mark.parametrize("rgb", [False, True])
def test_an_empty_scene_is_the_sky(corners: list[Corners], rgb: bool, kernel_cache: Path) -> None:
    renderer = Renderer(triangles(corners), Lighting(exposure=1.0), cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, 0.0, 0.0), 0.0, 30.0), CAMERA, rgb=rgb)
    assert np.isinf(frame.depth_m).all()
    assert not frame.instance.any()
    assert frame.rgb.all() == rgb


@settings(max_examples=50, deadline=None)
@given(
    origin=st.tuples(*[st.floats(width=32)] * 3),
    direction=st.tuples(*[st.floats(width=32)] * 3),
    reach=st.sampled_from([1.0, 1e4]),
)
def test_any_ray_has_an_answer(
    both: tuple[Renderer, Embree],
    origin: tuple[float, float, float],
    direction: tuple[float, float, float],
    reach: float,
) -> None:
    distance = both[0].cast(np.array([origin]), np.array([direction]), reach)
    assert distance.shape == (1,)
    assert 0 <= distance[0] < reach or distance[0] == np.inf


@pytest.mark.parametrize("entry", [np.nan, np.inf, -np.inf, 1e30, 0.0])
@pytest.mark.parametrize("place", [(0, 0), (1, 2), (0, 3), (2, 3)])
def test_any_pose_has_a_picture(both: tuple[Renderer, Embree], entry: float, place: tuple[int, int]) -> None:
    pose = looking((3.0, 2.5, 1.4), 30.0)
    pose[place] = entry
    frame = both[0].render(pose, replace(CAMERA, width=16, height=9), rgb=False)
    assert np.array_equal(np.isinf(frame.depth_m), frame.instance == 0)
    assert not np.isnan(frame.depth_m).any()


def points_of_inner_edges(scene: SceneGeometry) -> np.ndarray:
    """Points (N, 3) of edges that two triangles of one flat surface share."""
    corners = scene.vertices[scene.triangles].astype(np.float64)
    _, place = np.unique(np.round(corners.reshape(-1, 3), 6), axis=0, return_inverse=True)
    ends = np.sort(place.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    pairs = np.argsort(edge, kind="stable")[count[np.sort(edge)] == 2].reshape(-1, 2)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    flat = np.abs((normals[pairs[:, 0] // 3] * normals[pairs[:, 1] // 3]).sum(axis=1)) > 0.999
    triangle, side = np.divmod(pairs[flat, 0], 3)
    first, last = corners[triangle, side], corners[triangle, (side + 1) % 3]
    return np.concatenate([first + (last - first) * part for part in (0.21, 0.5, 0.83)])


@pytest.mark.parametrize("eye", [(3.0, 2.5, 1.4), (1.0, 1.0, 0.5), (0.5, 4.0, 2.0)])
def test_no_ray_slips_between_two_triangles(both: tuple[Renderer, Embree], eye: tuple[float, float, float]) -> None:
    points = points_of_inner_edges(both[0].scene)
    assert len(points) > 10_000
    directions = points - eye
    reach = both[0].cast(np.tile(eye, (len(points), 1)), directions, 30.0)
    assert not (reach > both[1].cast(eye, directions) + 1e-3).any()
