"""The surroundings of a scene: far away, and so a matter of directions alone.

A panorama of radiance is painted once for each scene and lighting, from the far to the near: sky, hills, trees, houses.
Its rows lie densest at the horizon: `sine_of`. Distances and heights are in metres, seen from `Place.eye_m` above the
ground; haze is exponential in distance (Koschmieder, 1924).
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.daylight import Daylight, even_hemisphere
from benchbot_sim_taichi.exterior.canvas import (
    COLUMNS,
    TEXEL,
    Array,
    Canvas,
    Light,
    columns_around,
    noise_image,
    sample,
    smoothstep,
    stretched,
)
from benchbot_sim_taichi.exterior.houses import House, blocks, scattered_houses, streets
from benchbot_sim_taichi.exterior.trees import Tree, scattered_trees
from benchbot_sim_taichi.lighting import Lighting

VERSION = 1
ROWS = 384
LEVELS = 3
BEND = 0.5  # of the sine of elevation, at which rows lie a quarter as dense as at the horizon
EXTINCTION_PER_M = 4.5e-5  # with each unit of turbidity
DARK_LUX, BRIGHT_LUX = 30.0, 500.0  # street lamps and windows are on below, off above
CLEAR_M = 30.0  # around the scene
HILLS = np.array([0.085, 0.105, 0.065])
RETURNED = 0.12  # share of sunlight that walls get back from sunlit ones across the street
ASPHALT = np.array([0.62, 0.62, 0.64], np.float32)  # of the mean reflectance of the ground
PAVEMENT = np.array([1.42, 1.4, 1.34], np.float32)
STREET_LAMPS = 4e-5 * np.array([1.0, 0.72, 0.42])  # of the ground, 0.4 cd/m2
NORMALS = 16
SKY_COLUMNS, SKY_ROWS = 450, 97


@dataclass(frozen=True)
class Place:
    """How a kind of surroundings is seen and furnished: trees and houses between two distances."""

    eye_m: float
    ground: tuple[float, float, float]
    hills_deg: float
    trees: int
    trees_m: tuple[float, float]
    houses: int = 0


PLACES = {
    "town": Place(9.0, (0.93, 1.02, 0.8), 1.2, 60, (24.0, 160.0)),
    "trees": Place(1.7, (0.9, 1.04, 0.64), 1.6, 130, (38.0, 120.0), houses=7),
    "field": Place(1.7, (0.93, 1.03, 0.68), 2.4, 42, (90.0, 420.0)),
}


def sine_of(row: npt.NDArray[np.number]) -> Array:
    """Sine of the elevation in the middle of rows, 0 the lowest; they may lie between two."""
    bent = (2.0 * (np.asarray(row, float) + 0.5) / ROWS - 1.0) / (1.0 + BEND)
    return BEND * bent / (1.0 - np.abs(bent))


def paint(lighting: Lighting) -> npt.NDArray[np.float32]:
    """(ROWS, COLUMNS, 3) linear sRGB radiance by elevation (`sine_of`) and azimuth (from +x, counter-clockwise)."""
    random = np.random.default_rng([lighting.exterior.seed, sorted(PLACES).index(lighting.exterior.kind)])
    place = PLACES[lighting.exterior.kind]
    noise = noise_image(random)
    sine = sine_of(np.arange(ROWS))
    radiance = _sky(lighting, noise)
    haze = lighting.sky.turbidity if isinstance(lighting.sky, Daylight) else Daylight.turbidity
    light = _light(lighting)
    slope = (sine / np.sqrt(1.0 - sine**2)).astype(np.float32)
    horizon = radiance[ROWS // 2 + 4].copy()
    canvas = Canvas(radiance, slope, place.eye_m, horizon, haze * EXTINCTION_PER_M, noise)
    _hills(canvas, light, place.hills_deg, random)
    _ground(canvas, light, place, lighting.exterior.kind == "town")
    if lighting.exterior.kind == "town":
        standing: list[House | Tree] = [*blocks(random)]
    else:
        standing = [*scattered_houses(place.houses, place.trees_m, random)]
    standing += scattered_trees(place.trees, place.trees_m, random, lighting.exterior.kind == "town")
    for thing in sorted(_visible(standing, place.eye_m), key=lambda one: -one.distance_m):
        thing.paint(canvas, light)
    return canvas.radiance


def mean_ground(radiance: npt.NDArray[np.float32]) -> Array:
    """(3,) mean of a panorama below the horizon, weighted as an upright window sees it."""
    sine = sine_of(np.arange(ROWS // 2))
    weight = np.gradient(sine) * np.sqrt(1.0 - sine**2)
    mean: Array = weight @ radiance[: ROWS // 2].mean(axis=1, dtype=np.float64) / weight.sum()
    return mean


def mean_above(radiance: npt.NDArray[np.float32], direction: Array, half_sine: Array) -> Array:
    """(N, 3) means of a panorama around (N, 3) directions above ground: 3 degrees wide, `half_sine` up and down."""
    sectors = radiance[ROWS // 2 :].reshape(ROWS // 2, 120, -1, 3).mean(axis=2, dtype=np.float64)
    middle = sine_of(np.arange(ROWS // 2, ROWS))
    edges = np.concatenate([[0.0], (middle[1:] + middle[:-1]) / 2, [1.0]])
    summed = np.concatenate([np.zeros((1, 120, 3)), np.cumsum(sectors * np.diff(edges)[:, None, None], axis=0)])
    low = np.clip(direction[:, 2] - half_sine, 0.0, 1.0)
    high = np.clip(direction[:, 2] + half_sine, 0.0, 1.0)
    azimuth = np.arctan2(direction[:, 1], direction[:, 0]) / (2 * math.pi) * 120 - 0.5
    left = np.floor(azimuth).astype(int)
    share = (azimuth - left)[:, None]

    def integral(sine: Array) -> Array:
        place = np.interp(sine, edges, np.arange(len(edges)))
        below = np.minimum(place.astype(int), len(edges) - 2)
        part = (place - below)[:, None]
        lower, upper = (
            summed[at, left % 120] * (1.0 - share) + summed[at, (left + 1) % 120] * share for at in (below, below + 1)
        )
        total: Array = lower * (1.0 - part) + upper * part
        return total

    return (integral(high) - integral(low)) / (high - low)[:, None]


def packed(radiance: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Texels of a panorama and of its halves: nine bits for each colour and five of exponent, as bits of a float.

    Value = mantissa * 2 ** (exponent - 29), of 1e-9 to 2000: shared exponents as in OpenGL's RGB9_E5.
    """
    texels = []
    for level in range(LEVELS):
        if level:
            rows, columns, _ = radiance.shape
            radiance = radiance.reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
        exponent = np.clip(np.frexp(radiance.max(axis=2) * np.float32(512.0 / 511.5))[1] + 20, 0, 31)
        mantissa = np.minimum(np.rint(np.ldexp(radiance, (29 - exponent)[..., None])), 511).astype(np.uint32)
        bits = mantissa[..., 0] | mantissa[..., 1] << 9 | mantissa[..., 2] << 18 | exponent.astype(np.uint32) << 27
        texels.append(bits.astype(np.uint32).view(np.float32).ravel())
    return np.concatenate(texels)


def _sky(lighting: Lighting, noise: Array) -> npt.NDArray[np.float32]:
    """A sky with thin clouds above the horizon, of the light of the sky without; the even ground below."""
    sine = np.maximum(sine_of(np.linspace((ROWS - 1) / 2, ROWS - 1, SKY_ROWS)), 0.0)[:, None]
    azimuth = (np.arange(SKY_COLUMNS) + 0.5) * (2 * math.pi / SKY_COLUMNS)
    cosine = np.sqrt(np.maximum(1.0 - sine**2, 0.0))
    direction = np.stack(np.broadcast_arrays(cosine * np.cos(azimuth), cosine * np.sin(azimuth), sine), axis=-1)
    clear = lighting.sky.sky_radiance(direction.reshape(-1, 3)).reshape(SKY_ROWS, SKY_COLUMNS, 3)
    x, y = (direction[..., i] / (sine + 0.15) * 5.0 for i in range(2))
    billows = np.sum([sample(noise, x * k, y * k) / k for k in (1.0, 2.0, 4.0, 8.0)], axis=0) / 1.875
    cover = smoothstep(0.45, 0.8, billows)[..., None] * np.minimum(sine * 12.0, 1.0)[..., None] * 0.75
    grey = (clear @ LUMINANCE).mean() * np.array([1.55, 1.55, 1.6])
    sky = clear * (1.0 - cover) + grey * cover
    weight = np.gradient(sine[:, 0]) * cosine[:, 0]
    sky *= (weight @ clear.mean(axis=1)) @ LUMINANCE / max((weight @ sky.mean(axis=1)) @ LUMINANCE, 1e-12)
    rows = np.linspace(0, SKY_ROWS - 1, ROWS)[ROWS // 2 :] * 2 - (SKY_ROWS - 1)
    columns = (np.arange(COLUMNS) + 0.5) * (SKY_COLUMNS / COLUMNS) - 0.5
    radiance = np.empty((ROWS, COLUMNS, 3), np.float32)
    radiance[: ROWS // 2] = lighting.sky.ground_radiance()
    radiance[ROWS // 2 :] = stretched(sky.astype(np.float32), rows, columns)
    return radiance


def _light(lighting: Lighting) -> Light:
    """Return what upright surfaces get, by the azimuth that they face, and whether street lamps are on."""
    upward = even_hemisphere(256)
    level = float(math.pi * LUMINANCE @ lighting.sky.sky_radiance(upward).mean(axis=0))
    level += float(LUMINANCE @ lighting.sun.irradiance) * max(lighting.sun.direction[2], 0.0)
    sides = np.zeros((NORMALS, 3))
    for k in range(NORMALS):
        angle = k * 2 * math.pi / NORMALS
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        across = np.array([-out[1], out[0], 0.0])
        facing = upward[:, 2:] * out + upward[:, :1] * across + upward[:, 1:2] * np.array([0.0, 0.0, 1.0])
        radiance = lighting.sky.sky_radiance(facing)
        radiance[facing[:, 2] < 0] = lighting.sky.ground_radiance()
        sides[k] = math.pi * radiance.mean(axis=0)
        opposite = max(0.0, -float(out @ lighting.sun.direction))
        sides[k] += RETURNED * opposite * np.array(lighting.sun.irradiance)
    lux = max(level * 1e4, 1e-3)
    night = 1.0 - float(smoothstep(math.log(DARK_LUX), math.log(BRIGHT_LUX), np.array(math.log(lux))))
    above = math.pi * lighting.sky.sky_radiance(upward).mean(axis=0)
    return Light(np.array(lighting.sun.direction), np.array(lighting.sun.irradiance), sides, above, night)


def _ground(canvas: Canvas, light: Light, place: Place, is_town: bool) -> None:
    """Grass, or streets and yards, of the mean radiance that the even ground has."""
    rows = ROWS // 2
    distance = canvas.eye_m / np.maximum(-canvas.slope[:rows, None], np.float32(1e-4))
    x, y = distance * np.cos(canvas.azimuth), distance * np.sin(canvas.azimuth)
    texel_m = distance * (distance / canvas.eye_m) * np.float32(TEXEL)
    pattern = np.ones((rows, COLUMNS), np.float32)
    for size_m, strength in ((1.5, 0.25), (9.0, 0.35), (60.0, 0.3)):
        resolved = np.clip(size_m / texel_m - 0.5, 0.0, 1.0)
        near = slice(0, int((resolved[:, 0] > 0.0).sum()))
        grain = sample(canvas.noise, x[near] * (4.0 / size_m), y[near] * (4.0 / size_m)) - 0.5
        pattern[near] += strength * resolved[near] * grain
    tint = np.array(place.ground, np.float32) / np.float32(LUMINANCE @ place.ground)
    albedo = pattern[..., None] * tint
    if is_town:
        street, kerb = streets(x, y, texel_m)
        albedo += street[..., None] * (pattern[..., None] * ASPHALT - albedo)
        albedo += kerb[..., None] * (PAVEMENT - albedo)
    steep = np.clip(distance / canvas.eye_m / 1.5 - 0.6, 0.0, 1.0)[..., None]  # right below the eye it is even
    ground = (canvas.radiance[0, 0] + light.night * STREET_LAMPS).astype(np.float32)
    canvas.radiance[:rows] = canvas.hazy(ground * (1.0 + steep * (albedo - 1.0)), distance)


def _hills(canvas: Canvas, light: Light, height_deg: float, random: np.random.Generator) -> None:
    """Paint two ranges on the horizon, whose woods haze makes pale."""
    for distance_m, share in ((6000.0, 1.0), (1400.0, 0.4)):
        turn = canvas.azimuth[None]
        waves = np.arange(2, 60)[:, None]
        phase = random.uniform(0, 2 * math.pi, (len(waves), 1))
        profile = (np.sin(waves * turn + phase) * waves**-1.1).sum(axis=0)
        profile += 0.05 * (sample(canvas.noise, np.arange(COLUMNS) * 0.8, np.full(COLUMNS, share)) - 0.5)
        profile = (profile - profile.min()) / np.ptp(profile)
        ridge = np.tan(np.radians(height_deg * share * (0.25 + 0.75 * profile)))
        rows = slice(len(canvas.slope) // 2, int(np.searchsorted(canvas.slope, ridge.max())) + 2)
        cover = np.clip((ridge - canvas.slope[rows, None]) / TEXEL + 0.5, 0, 1)
        toward = np.stack([-np.cos(canvas.azimuth), -np.sin(canvas.azimuth), np.full(COLUMNS, 0.6)], axis=1) / 1.166
        woods = HILLS * light.on(toward) * (0.8 + 0.4 * profile[:, None])
        canvas.blend(rows, np.arange(COLUMNS), canvas.hazy(woods, distance_m), cover)


def _visible(standing: list[House | Tree], eye_m: float) -> list[House | Tree]:
    """Return what stands clear of the scene and is not behind a nearer house."""
    skyline = np.full(COLUMNS, -1.0)
    seen: list[House | Tree] = []
    for thing in sorted(standing, key=lambda one: one.distance_m):
        if thing.distance_m < 0.7 * CLEAR_M:
            continue
        columns = columns_around(math.atan2(thing.y, thing.x), thing.half_angle)
        slope = (thing.top_m - eye_m) / thing.distance_m
        if (skyline[columns] < slope).any():
            seen.append(thing)
            if isinstance(thing, House):
                inner = columns_around(math.atan2(thing.y, thing.x), 0.6 * thing.half_angle)
                wall = (thing.height_m - eye_m) / (thing.distance_m + max(thing.half))
                skyline[inner] = np.maximum(skyline[inner], wall)
    return seen
