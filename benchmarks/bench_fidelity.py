"""How close the default picture is to a path traced one, in every environment by day, in the evening and at night.

python -m benchmarks fidelity [--only NAME:VARIANT ...] [--times day evening night] [--quality fast] [--device cuda]
    [--width 480] [--samples 256] [--views 1] [--processes N] [--cache FOLDER] [--json FILE] [--markdown FILE]
    [--pictures FOLDER]

With --processes so many environments are measured at a time, each by a process of its own with an equal part of the
processors; rows are then written as they come in, and a run that is cut off leaves those that it has.

Of each environment the view of its trajectory's median pose (`views.median_places`), 16 : 9 and 90° wide, in the light
of docs/gallery.md. The reference is the mean of two path traced pictures of half of --samples a pixel each, denoised
where `pyoidn` is installed; half of the difference between the two, `noise`, is what is left of its error.

After the tone curve: SSIM of luma; RMSE and mean difference of red, green and blue, in bytes of sRGB (positive: ours is
the brighter); the share of pixels of which a channel is 255; and on plain walls (`plain_walls`) the standard deviation,
in bytes, of waves of 4 to 30 pixels. Noise is no part of that of the reference: its variance is the covariance of the
two pictures, which share what is on the wall and nothing else. A reference of less than a tenth of a byte counts as a
tenth.

Of several pictures there are the medians, and the worst; walls are taken together, by their pixels.
"""

import argparse
import json
import multiprocessing
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot.core.declarations.catalog import Declaration
from benchbot.process import processors
from benchbot_sim_taichi import _ti, denoise
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks import plain_walls, views
from benchmarks.bench_quality import LUMA, compare

QUALITIES = {quality.name: quality for quality in (REALTIME, FAST)}
LEAST_SIGMA = 0.1  # bytes: less is neither seen nor measured
DIFFERENCE_GAIN, BAND_GAIN = 8, 16

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Row:
    """One picture beside its reference; biases, errors and deviations in bytes, variances in bytes squared."""

    environment: str
    time: str
    view: int
    ssim: float
    rmse: float
    noise: float
    bias_rgb: tuple[float, float, float]
    clipped: float
    reference_clipped: float
    wall_pixels: int
    wall_share: float
    wall_variance: float
    reference_wall_variance: float

    @property
    def bias(self) -> float:
        """The largest of the channels' mean differences, without its sign."""
        return max(abs(channel) for channel in self.bias_rgb)


@dataclass(frozen=True)
class Floor:
    """What a figure of each picture shall be at most, or at least."""

    what: str
    value: Callable[[Row], float]
    bound: float
    is_least: bool = False
    counts: Callable[[Row], bool] = lambda row: True

    def holds(self, row: Row) -> bool:
        """True if a picture keeps to it."""
        return self.value(row) >= self.bound if self.is_least else self.value(row) <= self.bound


FLOORS = (
    Floor("SSIM >= 0.95", lambda row: row.ssim, 0.95, is_least=True),
    Floor("RMSE <= 5 bytes", lambda row: row.rmse, 5.0),
    Floor("|bias| of each channel <= 1 byte", lambda row: row.bias, 1.0),
    Floor(
        "σ of plain walls <= 1.2 x path's", lambda row: wall_ratio([row]), 1.2, counts=lambda row: row.wall_pixels > 0
    ),
    Floor("clipped <= 1 % by day", lambda row: 100 * row.clipped, 1.0, counts=lambda row: row.time == "day"),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME:VARIANT", help="these environments; otherwise all")
    parser.add_argument("--times", nargs="+", choices=views.TIMES, default=list(views.TIMES))
    parser.add_argument("--quality", choices=QUALITIES, default=REALTIME.name, help="of our pictures")
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("--samples", type=int, default=256, help="of the path tracer, per pixel")
    parser.add_argument("--views", type=int, default=1, help="of each environment")
    parser.add_argument("--processes", type=int, default=1, metavar="N", help="measure so many pictures at a time")
    parser.add_argument("--seconds", type=float, metavar="S", help="begin no picture later than this")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to this file, row by row")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="also write medians, worst and rows as tables")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="also write the pictures there")
    options = parser.parse_args()
    if not denoise.is_installed():
        print("pyoidn is not installed: the path traced pictures keep their noise, and so do SSIM and RMSE")
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    print(HEADING)
    with tempfile.TemporaryDirectory() as folder:
        options.cache = options.cache or Path(folder)
        for row in measured(options.only or views.shipped(), options):
            rows.append(row)
            print(line(f"{row.environment} {row.time}", [row]), flush=True)
            if options.json:
                written = [asdict(row) | {"quality": options.quality, "samples": options.samples} for row in rows]
                options.json.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
            if options.markdown:
                options.markdown.write_text("\n".join(markdown(rows)) + "\n", encoding="utf-8")
    print("\n".join(summary(rows)))


def measured(names: Sequence[str], options: argparse.Namespace) -> Iterator[Row]:
    """Every picture of some environments, one after the other or as `--processes` have them."""
    parts = [(name, at) for at in options.times for name in names]
    started_s = time.monotonic()
    if options.processes == 1:
        for name, at in parts:
            yield from measure(views.declared(name), at, options.cache, options)
        return
    os.environ[_ti.THREADS] = str(max(processors() // options.processes, 1))
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for rows in pool.imap_unordered(_measure_one, [(name, at, options, started_s) for name, at in parts]):
            yield from rows


def _measure_one(part: tuple[str, str, argparse.Namespace, float]) -> list[Row]:
    name, at, options, started_s = part
    if options.seconds and time.monotonic() - started_s > options.seconds:
        return []
    return list(measure(views.declared(name), at, options.cache, options))


def measure(environment: Declaration, at: str, cache: Path, options: argparse.Namespace) -> Iterator[Row]:
    """Every view of an environment at one time of day."""
    scene = views.scene_of(environment, cache)
    places = views.median_places(environment, scene, cache, options.device, options.views)
    poses = views.camera_poses(environment)[places]
    camera = Intrinsics.from_horizontal_fov(options.width, options.width * 9 // 16, 90.0)
    lighting = Lighting.from_mapping(views.light_at(at, environment.data.get("lighting") or {}))
    ours = Renderer(scene, lighting, cache_dir=cache, device=options.device, quality=QUALITIES[options.quality])
    half = Quality("path", max(options.samples // 2, 1))
    paths = [
        Renderer(scene, lighting, cache_dir=cache, device=options.device, quality=half, seed=number)
        for number in (0, 1)
    ]
    paths[1].irradiance = paths[0].irradiance
    for view, pose in enumerate(poses):
        frame = ours.render(pose, camera)
        halves = [renderer.render(pose, camera).rgb for renderer in paths]
        reference = np.mean(halves, axis=0)
        walls = plain_walls.find(scene, frame, pose, camera, reference)
        wall_pixels = int((walls > 0).sum())
        figures = compare("ours", frame.rgb, reference)
        red, green, blue = (frame.rgb - reference).mean(axis=(0, 1)).tolist()
        yield Row(
            environment.name,
            at,
            view,
            figures["ours_ssim"],
            figures["ours_rmse"],
            0.5 * float(np.sqrt(np.mean((halves[0].astype(float) - halves[1]) ** 2))),
            (red, green, blue),
            clipped(frame.rgb),
            clipped(reference),
            wall_pixels,
            wall_pixels / walls.size,
            plain_walls.covariance(frame.rgb, frame.rgb, walls) if wall_pixels else 0.0,
            plain_walls.covariance(halves[0], halves[1], walls) if wall_pixels else 0.0,
        )
        if options.pictures:
            name = picture_name(environment.name, at, view)
            Image.fromarray(side_by_side(frame.rgb, reference, walls)).save(options.pictures / name)


def picture_name(environment: str, at: str, view: int) -> str:
    """The name of the file in which --pictures has a picture."""
    return f"{environment.replace(':', '_')}-{at}-{view}.png"


def clipped(picture: npt.NDArray[np.number]) -> float:
    """Share of the pixels of which a channel is as bright as a byte can say."""
    return float((picture == 255).any(axis=2).mean())


def side_by_side(ours: Picture, reference: npt.NDArray[np.floating], walls: plain_walls.Labels) -> Picture:
    """Ours, the reference, eight times their difference, and on plain walls sixteen times our band, about grey."""
    difference = 128 + DIFFERENCE_GAIN * (ours - reference)
    waves = np.zeros(walls.shape)
    if walls.any():
        for number in range(1, walls.max() + 1):
            wall = walls == number
            waves[wall] = 128 + BAND_GAIN * plain_walls.band(ours @ LUMA, wall.astype(np.int32))
    panels = (ours, reference, difference, np.repeat(waves[..., None], 3, axis=2))
    return np.hstack([np.rint(np.clip(panel, 0, 255)).astype(np.uint8) for panel in panels])


HEADING = (
    f"{'':24} {'SSIM':>6} {'RMSE':>6} {'noise':>6} {'bias r':>7} {'g':>6} {'b':>6} {'clipped %':>10} {'path':>6} "
    f"{'walls %':>8} {'σ':>6} {'path':>6} {'ratio':>6}"
)


def line(name: str, rows: Sequence[Row]) -> str:
    """Medians of some pictures' figures, and what is on all their walls."""

    def median(value: Callable[[Row], float]) -> float:
        return statistics.median(value(row) for row in rows)

    red, green, blue = np.median([row.bias_rgb for row in rows], axis=0)
    sigma, reference = wall_sigmas(rows)
    return (
        f"{name:24} {median(lambda row: row.ssim):6.3f} {median(lambda row: row.rmse):6.2f} "
        f"{median(lambda row: row.noise):6.2f} "
        f"{red:+7.2f} {green:+6.2f} {blue:+6.2f} {100 * median(lambda row: row.clipped):10.2f} "
        f"{100 * median(lambda row: row.reference_clipped):6.2f} {100 * median(lambda row: row.wall_share):8.1f} "
        f"{sigma:6.2f} {reference:6.2f} {wall_ratio(rows):6.2f}"
    )


def wall_sigmas(rows: Sequence[Row]) -> tuple[float, float]:
    """Standard deviations on all walls of some pictures, ours and the reference's; NaN where there are none."""
    pixels = sum(row.wall_pixels for row in rows)
    if not pixels:
        return float("nan"), float("nan")
    ours = sum(row.wall_pixels * row.wall_variance for row in rows) / pixels
    reference = sum(row.wall_pixels * row.reference_wall_variance for row in rows) / pixels
    return float(np.sqrt(ours)), float(np.sqrt(max(reference, 0.0)))


def wall_ratio(rows: Sequence[Row]) -> float:
    """Ours over the reference's, which is at least `LEAST_SIGMA`."""
    ours, reference = wall_sigmas(rows)
    return ours / max(reference, LEAST_SIGMA)


def summary(rows: Sequence[Row]) -> Iterator[str]:
    """Medians by time of day, and which floors hold: in how many pictures, in the median, and the worst."""
    yield "\nmedian"
    for at in views.TIMES:
        if there := [row for row in rows if row.time == at]:
            yield line(f"{at}, {len(there)}", there)
    yield line(f"all, {len(rows)}", rows)
    yield "\nfloors"
    for floor in FLOORS:
        if counted := [row for row in rows if floor.counts(row)]:
            worst = (min if floor.is_least else max)(counted, key=floor.value)
            yield (
                f"{floor.what:34} in {sum(map(floor.holds, counted))} of {len(counted)}, median "
                f"{statistics.median(map(floor.value, counted)):.3g}, worst {floor.value(worst):.3g} "
                f"({worst.environment} {worst.time})"
            )


def markdown(rows: Sequence[Row]) -> Iterator[str]:
    """Medians and the worst of each time of day as one table, and every picture's figures as another."""
    head = "SSIM | RMSE | largest bias | bias r, g, b | clipped % | walls, of path's"
    yield f"| | pictures | {head} |"
    yield "|---|" + "---|" * 7
    for at in (*views.TIMES, "all"):
        if there := [row for row in rows if at in (row.time, "all")]:
            yield f"| {at}, median | {len(there)} | {_cells(there)} |"
            worst = (
                f"{min(row.ssim for row in there):.3f} | {max(row.rmse for row in there):.2f} "
                f"| {max(row.bias for row in there):.2f} | | {100 * max(row.clipped for row in there):.2f} "
            )
            yield f"| {at}, worst | | {worst}| |"
    yield f"\n| | | {head} |"
    yield "|---|" + "---|" * 7
    for row in sorted(rows, key=lambda row: (row.environment, list(views.TIMES).index(row.time), row.view)):
        yield f"| {row.environment} | {row.time} | {_cells([row])} |"


def _cells(rows: Sequence[Row]) -> str:
    red, green, blue = np.median([row.bias_rgb for row in rows], axis=0)
    ssim, rmse, bias, clip = (
        statistics.median(values) for values in zip(*((r.ssim, r.rmse, r.bias, r.clipped) for r in rows), strict=True)
    )
    ratio = wall_ratio(rows)
    walls = "–" if np.isnan(ratio) else f"{ratio:.2f}"
    return f"{ssim:.3f} | {rmse:.2f} | {bias:.2f} | {red:+.1f}, {green:+.1f}, {blue:+.1f} | {100 * clip:.2f} | {walls}"


if __name__ == "__main__":
    main()
