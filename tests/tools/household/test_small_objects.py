"""Every small model fills its box exactly, and is a clean mesh."""

from collections.abc import Callable

import numpy as np
import pytest

from tools.household import books, plants, small_objects, tableware, textures
from tools.household.model import Model, bounds, triangle_count

Maker = Callable[..., Model]
MODELS: dict[str, tuple[Maker, tuple[float, float, float]]] = {
    "alarm_clock": (small_objects.alarm_clock, (0.1696, 0.1696, 0.1696)),
    "apple": (small_objects.apple, (0.0683, 0.0701, 0.0784)),
    "basket": (small_objects.basket, (0.36, 0.36, 0.30)),
    "book": (books.book, (0.1659, 0.0488, 0.1888)),
    "book_stack": (books.book_stack, (0.2469, 0.2998, 0.1306)),
    "bowl": (tableware.bowl, (0.24, 0.24, 0.08)),
    "cup": (tableware.cup, (0.0663, 0.0654, 0.0788)),
    "cushion": (small_objects.cushion, (0.45, 0.45, 0.16)),
    "dracaena": (plants.dracaena, (0.5992, 0.3923, 1.3078)),
    "magazines": (books.magazines, (0.3215, 0.2676, 0.0550)),
    "picture": (small_objects.picture, (0.50, 0.03, 0.40)),
    "potted_plant": (plants.potted_plant, (0.2930, 0.2708, 0.3470)),
    "spoons": (tableware.spoons, (0.0843, 0.1210, 0.2622)),
    "tray": (tableware.tray, (0.40, 0.28, 0.04)),
    "vase": (tableware.vase, (0.14, 0.14, 0.28)),
    "washing_liquid": (tableware.washing_liquid, (0.0599, 0.0599, 0.1301)),
}


@pytest.fixture(params=MODELS.items(), ids=lambda item: item[0], scope="module")
def made(request: pytest.FixtureRequest) -> tuple[Model, tuple[float, float, float]]:
    maker, extent_m = request.param[1]
    return maker(extent_m), extent_m


def test_the_box_is_exact_and_about_the_origin(made: tuple[Model, tuple[float, float, float]]) -> None:
    model, extent_m = made
    low, high = bounds(model)
    np.testing.assert_allclose(high - low, extent_m, atol=1e-6)
    np.testing.assert_allclose(high + low, 0.0, atol=1e-6)


def test_meshes_are_finite_and_normals_have_length_one(made: tuple[Model, tuple[float, float, float]]) -> None:
    for part in made[0]:
        assert np.isfinite(part.mesh.vertices).all()
        assert np.isfinite(part.mesh.uvs).all()
        np.testing.assert_allclose(np.linalg.norm(part.mesh.normals, axis=1), 1.0, atol=1e-6)


def test_triangles_have_area_and_face_where_their_normals_look(
    made: tuple[Model, tuple[float, float, float]],
) -> None:
    for part in made[0]:
        mesh = part.mesh
        a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
        cross = np.cross(b - a, c - a)
        assert np.linalg.norm(cross, axis=1).min() > 1e-13
        shading = mesh.normals[mesh.triangles].mean(axis=1)
        assert (np.einsum("ij,ij->i", cross, shading) > 0.0).mean() > 0.995, part.material.name


def test_a_model_is_light_enough_for_a_room(made: tuple[Model, tuple[float, float, float]]) -> None:
    assert triangle_count(made[0]) <= 10_000


@pytest.mark.parametrize("name", ["book_stack", "dracaena", "potted_plant", "cushion"])
def test_a_seed_is_a_model(name: str) -> None:
    maker, extent_m = MODELS[name]
    first, again, other = maker(extent_m, 1), maker(extent_m, 1), maker(extent_m, 2)
    np.testing.assert_array_equal(first[0].mesh.vertices, again[0].mesh.vertices)
    assert any(
        one.mesh.vertices.shape != two.mesh.vertices.shape or (one.mesh.vertices != two.mesh.vertices).any()
        for one, two in zip(first, other, strict=True)
    )


@pytest.mark.parametrize("name", ["dracaena", "potted_plant"])
def test_plants_stand_in_a_round_pot(name: str) -> None:
    maker, extent_m = MODELS[name]
    pot = next(part.mesh for part in maker(extent_m) if part.material.name.startswith("pot"))
    size = np.ptp(pot.vertices, axis=0)
    assert size[0] == pytest.approx(size[1], rel=0.01)
    assert pot.vertices[:, 2].min() == pytest.approx(-extent_m[2] / 2)


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_proportions_follow_the_box(scale: float) -> None:
    low, high = bounds(tableware.cup(tuple(scale * size for size in MODELS["cup"][1])))
    np.testing.assert_allclose(high - low, scale * np.asarray(MODELS["cup"][1]), atol=1e-6)


def test_a_picture_takes_the_art_it_is_given() -> None:
    art = textures.botanical(0.3, 0.4)
    model = small_objects.picture((0.4, 0.03, 0.5), art=art)
    assert any(part.material.base_color_texture is art for part in model)


def test_no_face_of_a_book_looks_into_the_book() -> None:
    extent_m = (0.1659, 0.0488, 0.1888)
    half = np.array(extent_m) / 2
    for part in books.book(extent_m):
        corners = part.mesh.vertices[part.mesh.triangles]
        for axis in range(3):
            for side in (-1.0, 1.0):
                on_the_box = np.abs(corners[:, :, axis] - side * half[axis]).max(axis=1) < 1e-6
                looks = part.mesh.normals[part.mesh.triangles[on_the_box]][..., axis] * side
                assert (looks > 0.0).all(), part.material.name
