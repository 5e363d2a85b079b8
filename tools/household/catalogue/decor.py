"""Decoration: plants, books, lamps, pictures, textiles."""

from tools.household import materials, plants, small_objects, textures
from tools.household.books import book, book_row, book_stack, magazines
from tools.household.decor import curtain, radiator, rug
from tools.household.item import Item
from tools.household.model import Material, Model, rotation, transformed


def _forward(model: Model) -> Model:
    """A model that looks to -y, turned to +x."""
    return transformed(model, rotation("z", 90.0))


def _from_wall(model: Model) -> Model:
    """A model before a wall at y = 0 with the room at +y, turned so that the room is at +x."""
    return transformed(model, rotation("z", -90.0))


def _curtain(width_m: float, code: str, seed: int) -> Model:
    cloth = Material(
        f"curtain {code}",
        base_color_texture=textures.curtain(textures.hex_color(code), seed),
        roughness=0.95,
        double_sided=True,
    )
    return _from_wall(curtain(width_m, 0.02, 2.28, max(4, round(width_m * 11)), cloth, seed, is_lined=False))


def _rug(width_m: float, depth_m: float, tint: tuple[float, float, float]) -> Model:
    woven = materials.rug(width_m, depth_m)
    return rug(width_m, depth_m, Material("rug", tint, woven.base_color_texture, roughness=0.97), 0.05)


def _picture(width_m: float, height_m: float, seed: int) -> Model:
    return _forward(small_objects.picture((width_m, 0.024, height_m), seed))


def _lying_book(width_m: float, height_m: float, thickness_m: float, seed: int) -> Model:
    return transformed(book((width_m, thickness_m, height_m), seed), rotation("x", 90.0))


ITEMS = (
    Item("plant_bushy", "potted plant", lambda: plants.potted_plant((0.36, 0.36, 0.48)), "potted plant"),
    Item("plant_dracaena", "potted plant", lambda: plants.dracaena((0.70, 0.70, 1.35)), "potted plant", "floor"),
    Item("plant_snake", "potted plant", lambda: plants.snake_plant((0.34, 0.34, 0.78)), "potted plant", "floor"),
    Item("plant_cactus", "potted plant", lambda: plants.cactus((0.14, 0.14, 0.24)), "potted plant"),
    Item("book_standing", "standing book", lambda: book((0.155, 0.032, 0.230), 2), "book"),
    Item("book_lying", "book", lambda: _lying_book(0.16, 0.235, 0.034, 5), "book"),
    Item("book_stack", "book", lambda: book_stack((0.19, 0.26, 0.125), 3), "book", is_group=True),
    Item("book_row", "book row", lambda: book_row((0.16, 0.28, 0.23), 1), "book", is_group=True, texture_px=96),
    Item("magazines", "book", lambda: magazines((0.28, 0.30, 0.085), 1), "book", is_group=True),
    Item(
        "clock_alarm",
        "clock",
        lambda: transformed(small_objects.alarm_clock((0.13, 0.13, 0.18)), rotation("z", -135.0)),
        "clock",
    ),
    Item("rug_diamond", "rug", lambda: _rug(1.70, 2.40, (1.0, 1.0, 1.0)), None, "floor", texture_px=512),
    Item("rug_diamond_blue", "rug", lambda: _rug(1.40, 2.00, (0.52, 0.66, 0.90)), None, "floor", texture_px=512),
    Item("curtain_sand", "curtain", lambda: _curtain(0.60, "#cdbfa6", 0), None, "wall"),
    Item("curtain_green", "curtain", lambda: _curtain(0.80, "#6f7f6d", 1), None, "wall"),
    Item(
        "radiator_panel",
        "radiator",
        lambda: _from_wall(radiator(1.0, 0.50, materials.paint("#efece5"), materials.brushed_steel(), samples=6)),
        None,
        "wall",
    ),
    Item("picture_landscape", "picture", lambda: _picture(0.70, 0.50, 6), None, "wall", texture_px=384),
    Item("picture_fern", "picture", lambda: _picture(0.42, 0.56, 2), None, "wall", texture_px=384),
    Item("picture_arch", "picture", lambda: _picture(0.50, 0.70, 3), None, "wall", texture_px=384),
    Item("picture_moon", "picture", lambda: _picture(0.44, 0.60, 5), None, "wall", texture_px=384),
    Item("basket_seagrass", "basket", lambda: small_objects.basket((0.38, 0.38, 0.34)), None, "floor"),
    Item("cushion_boucle", "cushion", lambda: small_objects.cushion((0.44, 0.44, 0.15), count=17)),
    Item(
        "cushion_striped",
        "cushion",
        lambda: small_objects.cushion((0.42, 0.42, 0.14), 3, textures.striped_linen(), count=17),
    ),
)
