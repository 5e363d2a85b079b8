"""Textures repeat without a seam, are the same for the same seed, and state a real size."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from tools.household import textures
from tools.household.model import Texture
from tools.household.textures import screens
from tools.household.textures.encode import normals
from tools.household.textures.noise import cells, cloud

REPEATING: dict[str, Callable[[int], Texture]] = {
    "boucle": lambda seed: textures.boucle(seed=seed),
    "brushed_metal": lambda seed: textures.brushed_metal(seed=seed),
    "brushed_metal_roughness": lambda seed: textures.brushed_metal_roughness(seed=seed),
    "ceramic": lambda seed: textures.ceramic(seed=seed),
    "curtain": lambda seed: textures.curtain(seed=seed),
    "knit_throw": lambda seed: textures.knit_throw(seed=seed),
    "linen": lambda seed: textures.linen(seed=seed),
    "linen_normal": textures.linen_normal,
    "oak_planks": textures.oak_planks,
    "oak_planks_normal": textures.oak_planks_normal,
    "paper": lambda seed: textures.paper(seed=seed),
    "plaster": lambda seed: textures.plaster(seed=seed),
    "plaster_normal": textures.plaster_normal,
    "quartz_worktop": lambda seed: textures.quartz_worktop(seed=seed),
    "reactive_glaze": lambda seed: textures.reactive_glaze(seed=seed),
    "soil": textures.soil,
    "stoneware": lambda seed: textures.stoneware(seed=seed),
    "striped_linen": lambda seed: textures.striped_linen(seed=seed),
    "terracotta": textures.terracotta,
    "tiles": lambda seed: textures.tiles(seed=seed),
    "tiles_normal": textures.tiles_normal,
    "wood_oak": lambda seed: textures.wood("oak", seed),
    "wood_walnut": lambda seed: textures.wood("walnut", seed),
}
COVERING: dict[str, Callable[[int], Texture]] = {
    "abstract": lambda seed: textures.abstract(seed=seed),
    "apple_skin": textures.apple_skin,
    "book_jacket": lambda seed: textures.book_jacket(0.13, 0.19, 0.03, seed),
    "botanical": lambda seed: textures.botanical(seed=seed),
    "cactus_skin": textures.cactus_skin,
    "landscape": lambda seed: textures.landscape(seed=seed),
    "leaf": lambda seed: textures.leaf(seed=seed),
    "magazine_cover": lambda seed: textures.magazine_cover(seed=seed),
    "rug": lambda seed: textures.rug(2.0, 1.4, seed),
    "strap_leaf": lambda seed: textures.strap_leaf(seed=seed),
    "wallpaper": lambda seed: screens.wallpaper(0.54, 0.32, seed),
}


def each(makers: dict[str, Callable[[int], Texture]]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("make", makers.values(), ids=makers.keys())


@cache
def made(make: Callable[[int], Texture], seed: int) -> Texture:
    return make(seed)


def step(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.abs(first.astype(float) - second.astype(float)).mean())


@each(REPEATING)
def test_the_seam_is_no_rougher_than_the_roughest_place_inside(make: Callable[[int], Texture]) -> None:
    image = made(make, 0).image.astype(float)
    rows = np.abs(np.diff(image, axis=0)).mean(axis=(1, 2))
    columns = np.abs(np.diff(image, axis=1)).mean(axis=(0, 2))
    assert step(image[-1], image[0]) <= rows.max() + 0.5
    assert step(image[:, -1], image[:, 0]) <= columns.max() + 0.5


@each(REPEATING | COVERING)
def test_a_seed_is_a_texture(make: Callable[[int], Texture]) -> None:
    first, again, other = made(make, 0), make(0), make(1)
    np.testing.assert_array_equal(first.image, again.image)
    assert other.image.shape != first.image.shape or (other.image != first.image).any()


@each(REPEATING | COVERING)
def test_images_are_at_most_1024_pixels_of_rgb_over_a_stated_size(make: Callable[[int], Texture]) -> None:
    texture = made(make, 0)
    assert texture.image.dtype == np.uint8
    assert texture.image.shape[2] == 3
    assert max(texture.image.shape[:2]) <= 1024
    assert texture.width_m > 0
    assert texture.height_m > 0


@each({name: make for name, make in REPEATING.items() if name.endswith("_normal")})
def test_normal_maps_hold_unit_vectors_that_look_outwards(make: Callable[[int], Texture]) -> None:
    vectors = made(make, 0).image.astype(float) / 255.0 * 2.0 - 1.0
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1.0, atol=0.02)
    assert vectors[..., 2].min() > 0.0


def test_a_bump_leans_left_on_its_left_and_up_on_its_upper_side() -> None:
    row, column = np.indices((64, 64))
    bump = 0.01 * np.exp(-((row - 32.0) ** 2 + (column - 32.0) ** 2) / 50.0)
    image = normals(bump, 1.0, 1.0).image.astype(int)
    assert image[32, 26, 0] < 128 < image[32, 38, 0]
    assert image[38, 32, 1] < 128 < image[26, 32, 1]


@pytest.mark.parametrize("species", ["oak", "walnut", "pine", "beech", "cherry"])
def test_woods_differ_in_tone_and_the_grain_runs_along_u(species: str) -> None:
    image = textures.wood(species).image.astype(float)
    assert np.abs(np.diff(image, axis=1)).mean() < np.abs(np.diff(image, axis=0)).mean()


def test_colors_keep_their_mean() -> None:
    assert textures.plaster((0.8, 0.6, 0.4)).image.mean(axis=(0, 1)) / 255.0 == pytest.approx((0.8, 0.6, 0.4), abs=0.01)
    assert textures.linen((0.5, 0.5, 0.6)).image.mean(axis=(0, 1)) / 255.0 == pytest.approx((0.5, 0.5, 0.6), abs=0.02)


def test_web_colors_become_linear() -> None:
    assert textures.linear_color("#ffffff") == (1.0, 1.0, 1.0)
    assert textures.linear_color("#808080") == pytest.approx((0.2159,) * 3, abs=1e-3)


def test_noise_has_zero_mean_and_unit_variance() -> None:
    field = cloud((64, 96), np.random.default_rng(0), (9.0, 20.0), 0.2)
    assert field.mean() == pytest.approx(0.0, abs=1e-9)
    assert field.std() == pytest.approx(1.0)


def test_cells_measure_across_the_seam() -> None:
    distance, index = cells((40, 60), np.array([[1.0, 1.0], [20.0, 30.0]]))
    assert distance[39, 59] == pytest.approx(np.hypot(2.0, 2.0))
    assert index[39, 59] == 0
