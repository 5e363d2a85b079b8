"""Light that can be checked by hand, and bytes that must not change."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _ti, camera_response, irradiance, light_process, lightmap
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.quality import PATH, REALTIME
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb

pytestmark = pytest.mark.xdist_group("renderer")

SMALL = Intrinsics.from_horizontal_fov(96, 54, 90.0)
ABOVE = looking((0.0, 0.0, 0.5), 90.0, -90.0)


def test_the_sun_casts_the_poles_shadow_away_from_itself(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.plaza(tmp_path / "plaza.glb"))
    sun = Sun(azimuth_deg=90.0, elevation_deg=45.0)
    renderer = Renderer(scene, Lighting(sun=sun, exposure=0.1), cache_dir=kernel_cache)
    above = looking((0.0, 0.0, 6.0), 90.0, -90.0)  # up in the picture is +y, towards the sun
    picture = renderer.render(above, Intrinsics(121, 121, 120.0, 120.0, 60.5, 60.5)).rgb.mean(axis=2)
    pixels_per_metre = 20
    shadow = picture[60 + pixels_per_metre // 2, 60]
    assert shadow < 0.7 * picture[60 - pixels_per_metre // 2, 60]
    assert shadow < 0.7 * picture[60 + pixels_per_metre * 3 // 2, 60]
    assert picture[60, 60 - pixels_per_metre] == pytest.approx(picture[60, 60 + pixels_per_metre], abs=3)


def test_the_edge_of_a_shadow_is_soft_and_even(tmp_path: Path, kernel_cache: Path) -> None:
    """Seen from above, 1 mm a pixel, where the half-shadow beside the pole's is 12 mm wide."""
    scene = load_scene(rooms.plaza(tmp_path / "plaza.glb"))
    sun = Sun(azimuth_deg=90.0, elevation_deg=45.0)
    renderer = Renderer(scene, Lighting(sun=sun, exposure=0.1), cache_dir=kernel_cache)
    camera = Intrinsics(96, 64, 6000.0, 6000.0, 48.0, 32.0)
    picture = renderer.render(looking((0.1, -0.8, 6.0), 90.0, -90.0), camera).rgb.mean(axis=2)
    across = np.median(picture, axis=0)
    contrast = across[-1] - across[0]

    soft = (across > across[0] + 0.1 * contrast) & (across < across[-1] - 0.1 * contrast)

    assert 6 <= soft.sum() <= 14
    assert np.abs(picture - across).max() < 0.18 * contrast


def test_a_sunlit_sills_light_does_not_come_through_the_slot_below_it(tmp_path: Path, kernel_cache: Path) -> None:
    """The sill's top and the bottom of the slot face the same way within a cell."""
    scene = load_scene(rooms.sill_above_a_slot(tmp_path / "sill.glb"))
    sun = Sun(azimuth_deg=90.0, elevation_deg=50.0)
    lighting = Lighting(sun=sun, sky=Sky(*[(0.0,) * 3] * 3), exposure=1.0)
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)

    wall_below = renderer.render(looking((1.0, -0.5, 0.6), 90.0, 15.0), SMALL).rgb[20:]

    assert wall_below.max() < 20


def test_an_inner_shell_does_not_darken_the_outer_one(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.ball_of_two_shells(tmp_path / "ball.glb"))
    even = Sky(*[(1.0,) * 3] * 3)
    lighting = Lighting(sun=Sun(irradiance=(0.0,) * 3), sky=even, exposure=0.2)
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)

    ball = renderer.render(looking((-0.4, 0.0, 0.0), 0.0), SMALL).rgb[17:37, 38:58]

    assert ball.mean() > 0.9 * ball.max()


def test_the_same_camera_gives_the_same_bytes_twice(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    first = Renderer(scene, Lighting(), cache_dir=kernel_cache, seed=3)
    second = Renderer(scene, Lighting(), cache_dir=tmp_path / "other", seed=3)
    pose = looking((0.6, 0.4, 1.05), 50)
    one, two, three = first.render(pose, SMALL), first.render(pose, SMALL), second.render(pose, SMALL)
    for other in (two, three):
        assert one.rgb.tobytes() == other.rgb.tobytes()
        assert one.depth_m.tobytes() == other.depth_m.tobytes()
        assert one.instance.tobytes() == other.instance.tobytes()


PICTURE_HASH = """
import hashlib, sys
from pathlib import Path
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchbot_scenes.gltf import load_scene
from plugins.sim_taichi.tests.cameras import looking
renderer = Renderer(load_scene(Path(sys.argv[1])), Lighting(), cache_dir=Path(sys.argv[2]))
frame = renderer.render(looking((0.6, 0.4, 1.05), 50), Intrinsics.from_horizontal_fov(96, 54, 90.0))
print(hashlib.sha256(frame.rgb.tobytes() + frame.depth_m.tobytes()).hexdigest())
"""


def test_another_process_gives_the_same_bytes(tmp_path: Path, kernel_cache: Path) -> None:
    glb = rooms.furnished_room(tmp_path / "room.glb")
    frame = Renderer(load_scene(glb), Lighting(), cache_dir=tmp_path).render(looking((0.6, 0.4, 1.05), 50), SMALL)
    here = hashlib.sha256(frame.rgb.tobytes() + frame.depth_m.tobytes()).hexdigest()
    there = subprocess.run(
        [sys.executable, "-c", PICTURE_HASH, str(glb), str(kernel_cache)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[3],
    )
    assert there.stdout.split() == [here]


def test_a_process_that_has_compiled_lights_its_next_scenes_by_itself(
    tmp_path: Path, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Renderer(load_scene(rooms.plaza(tmp_path / "plaza.glb")), Lighting(), cache_dir=kernel_cache).render(ABOVE, SMALL)
    monkeypatch.setattr(light_process, "is_of_use", lambda *_: True)
    monkeypatch.setattr(light_process, "lighting_up", lambda *_: pytest.fail("another process was started"))
    box = load_scene(rooms.lit_box(tmp_path / "box.glb", 0.5, 100.0, 0.05, 2.0))
    assert Renderer(box, Lighting(exposure=0.1), cache_dir=tmp_path / "new").render(ABOVE, SMALL).rgb.any()
    assert len(list((tmp_path / "new").glob("lightmap-*.npz"))) == 1


def test_a_damaged_cache_is_worked_out_anew(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.plaza(tmp_path / "plaza.glb"))
    cache = tmp_path / "cache"
    good = Renderer(scene, Lighting(), cache_dir=cache).irradiance
    stored = list(cache.glob("*.npz"))
    assert len(stored) == 2
    for path in stored:
        damaged = path.read_bytes()[:100]
        path.unlink()  # the whole one is mapped here
        path.write_bytes(damaged)
    again = Renderer(scene, Lighting(), cache_dir=cache).irradiance
    assert np.array_equal(good.cells, again.cells)


def test_exposure_is_the_scenes_not_the_pictures(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    automatic = Renderer(scene, Lighting(), cache_dir=kernel_cache)
    darker = Renderer(scene, Lighting(exposure=float(automatic.exposure.mean()) / 4), cache_dir=kernel_cache)
    pose = looking((0.6, 0.4, 1.05), 50)
    mean = automatic.render(pose, SMALL).rgb.mean()
    assert 60 < mean < 200
    assert darker.render(pose, SMALL).rgb.mean() < 0.75 * mean


def test_a_picture_looks_like_the_path_traced_one(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache)
    pose = looking((0.6, 0.4, 1.05), 50)
    reference = path_trace(renderer, pose, SMALL, samples_per_pixel=64)
    expected = camera_response.develop_on_host(reference).reshape(6, 9, 16, 6, 3)
    picture = renderer.render(pose, SMALL).rgb.reshape(6, 9, 16, 6, 3)
    difference = picture.mean(axis=(1, 3)) - expected.mean(axis=(1, 3))
    assert np.abs(difference).mean() < 6
    assert np.abs(difference).max() < 30


@pytest.mark.parametrize("gap_m", [0.01, 0.06])
def test_the_light_between_a_lamp_and_the_ceiling_stays_there(tmp_path: Path, kernel_cache: Path, gap_m: float) -> None:
    """What is behind a lamp is very bright, and hidden from the room by the lamp itself."""
    scene = load_scene(rooms.ceiling_lamp(tmp_path / "room.glb", gap_m))
    renderer = Renderer(scene, Lighting(exposure=1.0), cache_dir=kernel_cache)
    pose = looking((-2.5, -2.0, 1.0), 40)
    reference = path_trace(renderer, pose, SMALL, samples_per_pixel=256)
    expected = camera_response.develop_on_host(reference)[30:].mean()
    assert renderer.render(pose, SMALL).rgb[30:].mean() == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize(
    ("y_m", "yaw_deg", "pitch_deg"),
    [
        pytest.param(2.2, -90, 20, id="walls and ceiling"),
        pytest.param(0.3, 100, -35, id="floor at the pane"),
        pytest.param(2.7, -90, -50, id="floor that mirrors the lamp"),
    ],
)
def test_a_lamps_light_comes_back_from_the_lamp_itself_from_panes_and_from_smooth_floors(
    tmp_path: Path, kernel_cache: Path, y_m: float, yaw_deg: float, pitch_deg: float
) -> None:
    renderer = Renderer(load_scene(rooms.room_by_night(tmp_path / "room.glb")), rooms.NIGHT, cache_dir=kernel_cache)
    pose = looking((2.4, y_m, 1.4), yaw_deg, pitch_deg)

    picture = renderer.render(pose, SMALL).rgb

    expected = camera_response.develop_on_host(path_trace(renderer, pose, SMALL, samples_per_pixel=512))
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.07)


def test_a_glossy_floor_mirrors_a_bright_sky_as_bright_as_it_is(tmp_path: Path, kernel_cache: Path) -> None:
    """Windows by day are a dozen times as bright as what is white in the room."""
    glb = Glb()
    glb.box("floor", (-4, -4, -0.1), (4, 4, 0), glb.material((0.02,) * 3, roughness=0.35))
    sky = Sky((1, 1, 1), (1, 1, 1), (1, 1, 1))
    lighting = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=sky, exposure=19.0)
    scene = load_scene(glb.write(tmp_path / "floor.glb"))
    ours, paths = (
        Renderer(scene, lighting, cache_dir=kernel_cache, quality=quality).render(
            looking((-2.0, 0.0, 0.8), 0.0, -25.0), SMALL
        )
        for quality in (REALTIME, PATH)
    )
    floor = paths.depth_m < 3.0
    assert ours.rgb[floor].mean(axis=0) == pytest.approx(paths.rgb[floor].mean(axis=0), abs=3)


def test_what_dark_furniture_mirrors_of_a_window_is_not_spotted(tmp_path: Path, kernel_cache: Path) -> None:
    """It mirrors little, but next to its colour that is all there is to be seen."""
    scene = load_scene(rooms.room_with_a_dark_board(tmp_path / "room.glb"))
    lighting = Lighting(sun=Sun(irradiance=(0,) * 3), sky=Sky(*[(1.0,) * 3] * 3), exposure=4.0)
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
    pose = looking((0.3, 0.0, 1.2), 90.0)
    camera = Intrinsics.from_horizontal_fov(96, 54, 60.0)

    squares = renderer.render(pose, camera).rgb.reshape(9, 6, 16, 6, 3).mean(axis=(1, 3))

    paths = path_trace(renderer, pose, camera, samples_per_pixel=2048, brightest=np.inf)
    expected = camera_response.develop_on_host(paths).reshape(9, 6, 16, 6, 3).mean(axis=(1, 3))
    assert squares.mean() == pytest.approx(expected.mean(), rel=0.05)
    assert np.abs(squares - expected).max() < 9


def test_small_brass_things_have_no_black_pixels(tmp_path: Path, kernel_cache: Path) -> None:
    """Every other pixel leaves it to those beside it to trace what it mirrors, which on a knob face elsewhere."""
    glb = Glb()
    brass = glb.material((0.8, 0.6, 0.3), roughness=0.3, metallic=1.0)
    for index in range(5):
        glb.sphere(f"knob {index}", (0.6, 0.05 * (index - 2), 0.013 * index), 0.012, brass)
    lighting = Lighting(sun=Sun(irradiance=(0.0,) * 3), sky=Sky(*[(1.0,) * 3] * 3), exposure=0.5)
    renderer = Renderer(load_scene(glb.write(tmp_path / "knobs.glb")), lighting, cache_dir=kernel_cache)

    frame = renderer.render(looking((0.0, 0.0, 0.02), 0.0), SMALL)

    knobs = frame.rgb[np.isfinite(frame.depth_m)].min(axis=1)
    assert len(knobs) >= 10
    assert knobs.min() > 0.8 * np.median(knobs)


@pytest.mark.parametrize(("y", "yaw_deg"), [(0.4, 75.0), (2.6, -75.0)], ids=["towards the window", "away from it"])
def test_dull_walls_are_brighter_in_the_direction_that_light_comes_from(
    tmp_path: Path, kernel_cache: Path, y: float, yaw_deg: float
) -> None:
    """As if light came from all around, this wall would be a sixth darker towards the window, 8 % brighter away."""
    scene = load_scene(rooms.short_corridor(tmp_path / "corridor.glb"))
    lighting = Lighting(sun=Sun(irradiance=(0.0,) * 3), exposure=0.5)
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
    pose = looking((0.4, y, 1.0), yaw_deg)

    picture = renderer.render(pose, SMALL)
    paths = camera_response.develop_on_host(path_trace(renderer, pose, SMALL, samples_per_pixel=128))

    east = picture.instance == [instance.name for instance in scene.instances].index("east") + 1
    assert east.mean() > 0.3
    assert picture.rgb[east].mean() == pytest.approx(paths[east].mean(), rel=0.03)


@pytest.mark.parametrize("what", ["floor", "walls"])
def test_dull_surfaces_mirror_a_lamp_from_where_it_hangs(tmp_path: Path, kernel_cache: Path, what: str) -> None:
    """Light comes to the floor from above, and who looks along it sees little of that, though dull surfaces shine."""
    scene = load_scene(rooms.dull_room(tmp_path / "room.glb"))
    renderer = Renderer(scene, rooms.NIGHT, cache_dir=kernel_cache)
    pose = looking((0.0, -2.4, 1.3), 90.0, -20.0)

    picture = renderer.render(pose, SMALL)
    paths = camera_response.develop_on_host(path_trace(renderer, pose, SMALL, samples_per_pixel=256))

    seen = picture.instance == [instance.name for instance in scene.instances].index(what) + 1
    assert seen.mean() > 0.2
    assert picture.rgb[seen].mean() == pytest.approx(paths[seen].mean(), rel=0.03)


def test_a_picture_throws_its_narrow_shadow_on_the_wall(tmp_path: Path, kernel_cache: Path) -> None:
    """It is 3 cm thick; the shadow below it, of a lamp above, is about as wide, and has four rows of pixels."""
    renderer = Renderer(load_scene(rooms.picture_on_a_wall(tmp_path / "wall.glb")), rooms.NIGHT, cache_dir=kernel_cache)
    pose = looking((0.0, -0.5, 1.2), 90.0)

    rows = renderer.render(pose, SMALL).rgb[27:48, 24:72].mean(axis=(1, 2))

    paths = camera_response.develop_on_host(path_trace(renderer, pose, SMALL, samples_per_pixel=1024))
    expected = paths[27:48, 24:72].mean(axis=(1, 2))
    assert expected[:4].max() < 0.5 * expected[8:].min()
    assert np.abs(rows - expected)[:4].mean() < 11
    assert rows[4:] == pytest.approx(expected[4:], abs=5)


def test_a_small_place_in_the_sun_lights_what_is_beside_it_evenly(tmp_path: Path, kernel_cache: Path) -> None:
    """The same all along a sill, of which only the outer part is in the sun and few of the rays about meet it."""
    sun = Sun(azimuth_deg=270.0, elevation_deg=60.0)
    lighting = Lighting(sun=sun, sky=Sky(*[(0.0,) * 3] * 3), exposure=3.0)
    renderer = Renderer(load_scene(rooms.sill_below_a_roof(tmp_path / "sill.glb")), lighting, cache_dir=kernel_cache)
    pose = looking((0.0, -0.5, 1.25), 90.0)

    wall = renderer.render(pose, SMALL).rgb[4:36, 16:80].mean(axis=2)

    paths = camera_response.develop_on_host(path_trace(renderer, pose, SMALL, samples_per_pixel=512))
    squares = wall.reshape(8, 4, 16, 4).mean(axis=(1, 3))
    assert squares.std(axis=1).max() < 4
    assert wall.mean() == pytest.approx(paths[4:36, 16:80].mean(), abs=8)


@pytest.mark.parametrize(
    ("sun", "sky"),
    [
        pytest.param(Sun(irradiance=(0.0,) * 3), Sky((1.0,) * 3, (1.0,) * 3, (0.0,) * 3), id="the sky"),
        pytest.param(Sun(azimuth_deg=90.0, elevation_deg=55.0), Sky((0.0,) * 3, (0.0,) * 3, (0.0,) * 3), id="the sun"),
    ],
)
def test_a_smooth_floor_lights_the_ceiling_with_what_it_mirrors_of(
    tmp_path: Path, kernel_cache: Path, sun: Sun, sky: Sky
) -> None:
    lighting = Lighting(sun=sun, sky=sky, exposure=20.0)
    renderer = Renderer(load_scene(rooms.polished_room(tmp_path / "room.glb")), lighting, cache_dir=kernel_cache)
    up = looking((2.0, 1.5, 0.1), 90.0, 90.0)
    wide = Intrinsics.from_horizontal_fov(48, 36, 70.0)

    picture = renderer.render(up, wide).rgb

    expected = camera_response.develop_on_host(path_trace(renderer, up, wide, samples_per_pixel=512, brightest=np.inf))
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.05)


def test_panes_that_show_the_sky_are_windows_and_glasses_are_not(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache)
    inner_faces_of_the_pane = 2
    assert renderer.device.lights[2] == inner_faces_of_the_pane
    assert renderer.irradiance.cells.any()


def test_the_light_is_worked_out_alike_every_time(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    scene = replace(scene, vertices=scene.vertices / np.float32(2))  # a quarter as many points, twelve times
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache)

    solved = {irradiance.solve(renderer.scene, renderer.device, seed=3)[0].cells.tobytes() for _ in range(12)}

    assert len(solved) == 1


def test_light_that_another_kind_of_device_has_worked_out_is_not_loaded(
    tmp_path: Path, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A GPU's light differs in its last digits: a run on a processor is not to depend on who was there before."""
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    Renderer(scene, Lighting(), cache_dir=kernel_cache)
    names = {lightmap.cache_key(1, scene, Lighting(), 0)}
    monkeypatch.setattr(_ti, "_started", "cuda")
    names.add(lightmap.cache_key(1, scene, Lighting(), 0))
    assert len(names) == 2
