"""Noise has the published statistics, invalid is NaN, and the same instant of the same run has the same noise."""

import math
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.declarations import schema
from benchbot.core.digest import ObservationDigest
from benchbot.core.geometry import Pose
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.randomness import generator, scene_seed
from benchbot_sim_taichi.camera_noise import SATURATING, CameraNoise
from benchbot_sim_taichi.camera_response import exposed, filmic, srgb_bytes
from benchbot_sim_taichi.depth_noise import Stereo, StructuredLight, View, in_shadow, incidence_rad, read_depth_noise
from benchbot_sim_taichi.renderer import Frame
from benchbot_sim_taichi.scanners import Laser, RangeNoise
from benchbot_sim_taichi.sensors import Camera
from benchbot_sim_taichi.simulator import RayTracedSimulator
from benchbot_sim_taichi.textures import srgb_to_linear

REALISTIC = schema.read(Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter_realistic.yaml")
MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
FOCAL_PX = 200.0
STEREO = Stereo(baseline_m=0.05, disparity_sigma_px=0.2, disparity_step_px=0.0)
ray_traced = pytest.mark.xdist_group("renderer")


def view(width: int = 160, height: int = 120) -> View:
    u, v = np.meshgrid(np.arange(width) - width / 2 + 0.5, np.arange(height) - height / 2 + 0.5)
    return View(u / FOCAL_PX, v / FOCAL_PX, FOCAL_PX)


def wall(depth_m: float) -> np.ndarray:
    return np.full((120, 160), depth_m)


def random() -> np.random.Generator:
    return generator(0, "image_depth", 0)


@pytest.mark.parametrize("grey", [40, 118, 170])
def test_shot_and_read_noise_have_their_variance(grey: int) -> None:
    """In linear light: variance is the mean in electrons plus the read noise's."""
    noise = CameraNoise(saturation_electrons=20_000, read_electrons=20)
    picture = np.full((300, 300, 3), grey, np.uint8)
    linear = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    noisy = exposed(linear[noise.apply(picture, generator(1, "image_rgb", 0))])
    electrons = noisy / SATURATING * noise.saturation_electrons
    mean = float(exposed(linear[picture[:1, :1]])[0, 0, 0]) / SATURATING * noise.saturation_electrons
    assert electrons.mean() == pytest.approx(mean, rel=0.02)
    assert electrons.var() == pytest.approx(mean + noise.read_electrons**2, rel=0.1)


def test_a_sensor_without_noise_shows_every_colour_as_it_is() -> None:
    without = CameraNoise(saturation_electrons=1e8, read_electrons=0)
    brightness, tint = random().random((40, 40, 1)), random().random((40, 40, 3))
    colors = srgb_bytes(filmic((tint * 2.0 ** (12 * brightness - 7)).astype(np.float32)))
    error = np.abs(without.apply(colors, random()).astype(int) - colors)
    assert error.max() <= 2
    assert (error > 1).mean() < 0.001


def test_black_and_white_stay_possible() -> None:
    noise = CameraNoise(saturation_electrons=1000, read_electrons=5)
    ends = np.zeros((40, 40, 3), np.uint8)
    ends[20:] = 255
    seen = noise.apply(ends, random())
    assert (seen[20:] == 255).all()
    assert 0 < seen[:20].mean() < 40
    without = CameraNoise(saturation_electrons=1e8, read_electrons=0)
    steps = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, 2)
    assert np.abs(without.apply(steps, random()).astype(int) - steps).max() <= 1


@pytest.mark.parametrize("depth_m", [1.0, 2.0])
def test_the_error_of_stereo_grows_with_the_square_of_depth(depth_m: float) -> None:
    error_m = STEREO.apply(wall(depth_m), view(), random()) - depth_m
    assert np.nanstd(error_m) == pytest.approx(depth_m**2 * 0.2 / (FOCAL_PX * 0.05), rel=0.1)
    assert abs(np.nanmedian(error_m)) < 0.01 * depth_m
    assert np.isfinite(error_m).all()


def test_disparity_has_steps() -> None:
    noise = Stereo(0.05, disparity_sigma_px=0.5, disparity_step_px=0.125)
    steps = FOCAL_PX * 0.05 / noise.apply(wall(1.0), view(), random()) / 0.125
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert len(np.unique(np.round(steps))) > 10


@pytest.mark.parametrize("depth_m", [0.4, 1.5, 3.0])
def test_structured_light_errs_as_measured_on_a_kinect(depth_m: float) -> None:
    error_m = StructuredLight().apply(wall(depth_m), view(), random()) - depth_m
    assert np.std(error_m) == pytest.approx(0.0012 + 0.0019 * (depth_m - 0.4) ** 2, rel=0.05)
    assert abs(error_m.mean()) < 5e-4


def test_structured_light_frays_edges() -> None:
    step = wall(2.0)
    step[:, :80] = 1.0
    seen = StructuredLight(baseline_m=1e-6).apply(step, view(), random())
    strays = (seen[:, :80] > 1.5).mean(axis=0)
    assert strays[79] > 0.1
    assert strays[:70].max() == 0.0


def test_far_away_is_infinite_and_not_invalid() -> None:
    nothing = wall(math.inf)
    for model in (STEREO, StructuredLight()):
        assert (model.apply(nothing, view(), random()) == math.inf).all()


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 70.0, 85.0])
def test_the_incidence_on_a_plane_is_exact(angle_deg: float) -> None:
    """A wall turned about the vertical axis: normal (sin, 0, -cos)."""
    angle, seen = math.radians(angle_deg), view()
    depth = 2.0 * math.cos(angle) / (math.cos(angle) - seen.x * math.sin(angle))
    expected = (math.cos(angle) - seen.x * math.sin(angle)) / np.sqrt(1 + seen.x**2 + seen.y**2)
    in_front = depth > 0
    np.testing.assert_allclose(np.cos(incidence_rad(depth, seen))[in_front], expected[in_front], atol=1e-6)


@pytest.mark.parametrize("model", [Stereo(0.05, 0.1, max_incidence_deg=60), StructuredLight(max_incidence_deg=60)])
def test_grazing_surfaces_are_invalid(model: Stereo | StructuredLight) -> None:
    seen = view()
    floor = np.where(seen.y > 0, 1.0 / np.maximum(seen.y, 1e-9), math.inf)  # 1 m below
    valid = np.isfinite(model.apply(floor, seen, random()))
    # The floor's incidence is the angle from straight down.
    assert not valid[seen.y > 0].any()
    assert np.isfinite(model.apply(wall(1.0), seen, random())).all()


def test_the_shadow_of_an_object_is_as_wide_as_the_disparities_differ() -> None:
    post = wall(2.0)
    post[:, 80:100] = 0.5
    hidden = in_shadow(post, view(), 0.05)
    # 20 pixels' disparity at 0.5 m, 5 at 2 m: 15 pixels of the wall left of the post.
    assert hidden[:, 65:80].all()
    assert not hidden[:, :65].any()
    assert not hidden[:, 80:].any()
    assert np.isnan(STEREO.apply(post, view(), random())[:, 65:80]).all()


@pytest.mark.parametrize("model", [Stereo(0.05, 0.3), StructuredLight()])
def test_the_range_ends_in_infinities(model: Any) -> None:
    depth = np.repeat([[0.05, 0.3, 1.0, 4.0, 50.0, math.inf]], 40, axis=0).repeat(40, axis=1).astype(np.float32)
    camera = Camera("f", 240, 40, 200, 200, 120, 20, (0.1, 8.0), depth_noise=model)
    picture = Frame(np.zeros((40, 240, 3), np.uint8), depth, np.zeros((40, 240), np.int32))
    seen = camera.depth(picture, random)
    assert seen.dtype == np.float32
    assert (seen[:, :38] == -math.inf).all()
    assert (seen[:, 202:] == math.inf).all()
    finite = seen[np.isfinite(seen)]
    assert finite.min() >= 0.1
    assert finite.max() <= 8.0


def test_laser_ranges_have_constant_and_proportional_errors() -> None:
    ranges = np.repeat([1.0, 10.0, math.inf, -math.inf], 5000)
    error = (RangeNoise(0.03, 0.004).apply(ranges, random())[:10000] - ranges[:10000]).reshape(2, -1)
    assert error.std(axis=1) == pytest.approx([math.hypot(0.03, 0.004), math.hypot(0.03, 0.04)], rel=0.05)
    assert abs(error.mean(axis=1)).max() < 0.003
    np.testing.assert_array_equal(RangeNoise(0.03).apply(ranges, random())[10000:], ranges[10000:])


def test_noise_depends_on_seed_sensor_and_instant_alone() -> None:
    keys = [(0, "laser", 0), (1, "laser", 0), (0, "image_rgb", 0), (0, "laser", 1), (2**255, "laser", 0)]
    drawn = [tuple(generator(*key).random(3)) for key in keys]
    assert len(set(drawn)) == len(keys)
    assert drawn == [tuple(generator(*key).random(3)) for key in keys]


CAMERA: dict[str, Any] = {key: value for key, value in REALISTIC["camera"].items() if "noise" not in key}
LASER = {"frame": "lidar", "beams": 8, "range_m": [0.1, 9]}
MISFITS: dict[str, tuple[Callable[..., Any], dict[str, Any], str]] = {
    "no electrons": (
        Camera.from_mapping,
        CAMERA | {"rgb_noise": {"saturation_electrons": 0, "read_electrons": 1}},
        "rgb_noise",
    ),
    "half a noise": (Camera.from_mapping, CAMERA | {"rgb_noise": {"read_electrons": 1}}, "rgb_noise"),
    "an unknown model": (Camera.from_mapping, CAMERA | {"depth_noise": {"model": "radar"}}, "depth_noise.*radar"),
    "no baseline": (Camera.from_mapping, CAMERA | {"depth_noise": {"model": "stereo"}}, "depth_noise.*baseline_m"),
    "a negative baseline": (
        Camera.from_mapping,
        CAMERA | {"depth_noise": {"model": "structured_light", "baseline_m": -1}},
        "baseline_m",
    ),
    "an angle beyond 90": (
        Camera.from_mapping,
        CAMERA | {"depth_noise": {"model": "structured_light", "max_incidence_deg": 91}},
        "max_incidence_deg",
    ),
    "a misspelt key": (Camera.from_mapping, CAMERA | {"distorsion": {}}, "distorsion.*distortion"),
    "negative laser noise": (Laser.from_mapping, LASER | {"noise": {"sigma_m": -0.1}}, "noise"),
    "laser noise that is no mapping": (Laser.from_mapping, LASER | {"noise": 0.1}, "noise"),
    "an unknown key of a laser": (Laser.from_mapping, LASER | {"sigma_m": 0.1}, "sigma_m"),
}


@pytest.mark.parametrize(("read", "values", "said"), MISFITS.values(), ids=MISFITS.keys())
def test_misfits_name_the_key(read: Callable[..., Any], values: dict[str, Any], said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        read(values)


def test_there_are_no_two_models_of_one_name() -> None:
    assert isinstance(read_depth_noise({"model": "stereo", "baseline_m": 0.05, "disparity_sigma_px": 0.1}), Stereo)
    assert isinstance(read_depth_noise({"model": "structured_light"}), StructuredLight)


def digest(observed: Mapping[str, object]) -> str:
    found = ObservationDigest()
    found.update(observed)
    return found.hexdigest()


@ray_traced
def test_a_run_with_noise_can_be_repeated(kernel_cache: Path) -> None:
    camera = REALISTIC["camera"] | {"width": 64, "height": 48, "fx": 40, "fy": 40, "cx": 31.5, "cy": 23.5}
    spec = PlatformSpec(REALISTIC | {"camera": camera}, "ground_truth", kernel_cache)
    scene = Scene(schema.read(MINIROOM), MINIROOM.parent)
    first = RayTracedSimulator(spec)
    robots = [first, first.twin(), first.twin()]
    # Whoever knows the seed, but not the secret, can foresee no noise.
    for robot, secret in zip(robots, ("", "", 16 * "0f"), strict=True):
        robot.load(scene, scene_seed(secret, 0, 0))
        robot.drive(0.2, 0.0, robot.control_period_s)
    channels = ["image_rgb", "image_depth", "laser"]
    seen: Sequence[Mapping[str, object]] = first.observe_many(robots, channels)
    for name in channels:
        one, other, differently_seeded = (digest({name: observed[name]}) for observed in seen)
        assert one == other == digest(first.observe([name]))
        assert one != differently_seeded
    first.place(Pose.planar(*first.pose().translation_xyz[:2], first.pose().yaw_rad, first.pose().translation_xyz[2]))
    assert digest(first.observe(["laser"])) != digest({"laser": seen[0]["laser"]})
    assert digest(first.observe(["image_segment"])) == digest(robots[2].observe(["image_segment"]))
    assert first.odometry() != robots[2].odometry()
