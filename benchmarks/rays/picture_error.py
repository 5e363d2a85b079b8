"""How far pictures are from what they approximate: `realtime` from path tracing, and path tracing from Mitsuba's.

By the mean of radiance, and after the camera's tone curve by root mean square error (of 0 … 1) and structural
similarity, of pictures shrunk four times. Where Mitsuba takes part windows are open, without panes: its path tracer
finds no light behind them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import camera_response
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays import cornell
from benchmarks.rays.mitsuba_scene import without_panes
from benchmarks.rays.workload import look

Picture = npt.NDArray[np.floating]
SHIPPED = Path(__file__).parents[2] / "plugins/envs_bear/src/benchbot_envs_bear/scenes/miniroom_1.glb"
WIDTH, HEIGHT = 384, 256
SHRINK = 4
VIEWS = [("bed", (1.2, 1.5, 1.05), 60.0), ("chest", (1.2, 1.5, 1.05), 200.0), ("table", (1.8, 1.9, 1.05), -60.0)]
REFLECTIONS = 12
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (ITU-R BT.709)
NO_LIMIT = 1e30


@dataclass(frozen=True)
class Asked:
    """A view of a scene."""

    name: str
    scene: SceneGeometry
    lighting: Lighting
    pose: npt.NDArray[np.float64]
    camera: Intrinsics


@dataclass(frozen=True)
class Difference:
    """`picture` against `yardstick`: relative difference of means, error and similarity after the tone curve."""

    scene: str
    picture: str
    yardstick: str
    mean: float
    rmse: float
    ssim: float


def compare(cache: Path, samples: int, folder: Path | None = None) -> Iterator[Difference]:
    """`realtime` against our path tracer, and both against Mitsuba where it is installed, at equal samples.

    `folder` gets the pictures side by side, if given.
    """
    room = load_scene(SHIPPED)
    camera = Intrinsics.from_horizontal_fov(WIDTH, HEIGHT, 90.0)
    box = Asked("Cornell box", cornell.cornell(), cornell.NIGHT, cornell.POSE, cornell.CAMERA)
    rooms = [
        Asked(f"miniroom:1, {name}{suffix}", scene, Lighting(), look(place, yaw_deg, 0.0), camera)
        for suffix, scene in (("", room), (", open", without_panes(room)))
        for name, place, yaw_deg in VIEWS
    ]
    for asked in (box, *rooms):
        pictures = _pictures(asked, cache, samples)
        yield from _differences(asked.name, pictures)
        if folder:
            from PIL import Image

            row = np.concatenate([(toned * 255).astype(np.uint8) for toned, _ in pictures.values()], axis=1)
            Image.fromarray(row).save(folder / f"{asked.name}.png")


def _pictures(asked: Asked, cache: Path, samples: int) -> dict[str, tuple[Picture, float]]:
    """What everyone makes of it, after the tone curve, and its mean radiance."""
    renderer = Renderer(asked.scene, asked.lighting, cache_dir=cache)
    drawn = shrunk(renderer.render(asked.pose, asked.camera).rgb / 255)
    traced = path_trace(
        renderer, asked.pose, asked.camera, samples_per_pixel=samples, bounces=REFLECTIONS, brightest=NO_LIMIT
    )
    pictures = {"realtime": (drawn, float(np.nan)), "path": (tone(shrunk(traced)), float(traced.mean()))}
    is_glass = np.array([material.is_glass for material in asked.scene.materials], bool)
    has_panes = is_glass[asked.scene.triangle_material].any()
    if find_spec("mitsuba") and not has_panes:
        light = cornell.by_mitsuba(asked.scene, asked.lighting, asked.pose, asked.camera, samples, REFLECTIONS)
        theirs = light * renderer.exposure
        pictures["Mitsuba"] = (tone(shrunk(theirs)), float(theirs.mean()))
    return pictures


def _differences(name: str, pictures: dict[str, tuple[Picture, float]]) -> Iterator[Difference]:
    for one, other in (("realtime", "path"), ("path", "Mitsuba"), ("realtime", "Mitsuba")):
        if other in pictures:
            (a, mean_a), (b, mean_b) = pictures[one], pictures[other]
            rmse = float(np.sqrt(np.mean((a - b) ** 2)))
            yield Difference(name, one, other, mean_a / mean_b - 1, rmse, ssim(a, b))


def shrunk(picture: Picture) -> Picture:
    """Means of 4x4 pixels: what noise is left to path tracing shall not hide what differs."""
    height, width, channels = picture.shape
    small: Picture = picture.reshape(height // SHRINK, SHRINK, width // SHRINK, SHRINK, channels).mean(axis=(1, 3))
    return small


def tone(radiance: Picture) -> Picture:
    """sRGB (0 … 1) of exposed radiance, without the lens's bloom."""
    pixels: Picture = camera_response.srgb_bytes(camera_response.filmic(radiance.astype(np.float32))) / 255
    return pixels


def ssim(one: Picture, other: Picture) -> float:
    """Mean structural similarity of luminance (Wang et al., "Image quality assessment", 2004: Gaussian of 1.5)."""
    a, b = one @ LUMINANCE, other @ LUMINANCE
    mean_a, mean_b = blurred(a), blurred(b)
    variance_a, variance_b = blurred(a * a) - mean_a**2, blurred(b * b) - mean_b**2
    together = blurred(a * b) - mean_a * mean_b
    c1, c2 = 0.01**2, 0.03**2
    above = (2 * mean_a * mean_b + c1) * (2 * together + c2)
    return float(np.mean(above / ((mean_a**2 + mean_b**2 + c1) * (variance_a + variance_b + c2))))


def blurred(picture: Picture) -> Picture:
    """Weighted means over windows of 11x11, where they fit."""
    weights = np.exp(-0.5 * (np.arange(-5, 6) / 1.5) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        windows = np.lib.stride_tricks.sliding_window_view(picture, 11, axis=axis)
        picture = windows @ weights
    return picture


def table(rows: Iterable[Difference]) -> Iterator[str]:
    """Lines of text."""
    yield f"\n{'':24} {'':10} {'against':10} {'mean':>9} {'RMSE':>8} {'SSIM':>7}"
    for row in rows:
        mean = "" if np.isnan(row.mean) else f"{100 * row.mean:+8.2f}%"
        yield f"{row.scene:24} {row.picture:10} {row.yardstick:10} {mean:>9} {row.rmse:8.4f} {row.ssim:7.3f}"
