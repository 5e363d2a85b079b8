"""Cups, bowls, bottles, cutlery and what else stands on tables and counters."""

from tools.household import cutlery, materials, tableware, textures, vessels
from tools.household.food import plate
from tools.household.item import Item
from tools.household.model import Material, Model, rotation, transformed


def _forward(model: Model) -> Model:
    """A model that looks to -y, turned to +x."""
    return transformed(model, rotation("z", 90.0))


def _stoneware(red: float, green: float, blue: float, seed: int) -> Material:
    return Material(
        f"stoneware {seed}", base_color_texture=textures.stoneware((red, green, blue), seed=seed), roughness=0.35
    )


ITEMS = (
    Item("cup_coffee", "cup", lambda: tableware.cup((0.115, 0.115, 0.085)), "cup"),
    Item("cup_tea", "cup", lambda: vessels.teacup(materials.ceramic()), "cup"),
    Item(
        "cup_mug_yellow",
        "cup",
        lambda: vessels.mug(0.041, 0.098, 0.92, materials.paint("#d39a2d", 0.2), materials.paint("#f1ede2", 0.2), None),
        "cup",
    ),
    Item(
        "cup_stoneware",
        "cup",
        lambda: vessels.mug(
            0.046, 0.080, 0.70, _stoneware(0.62, 0.66, 0.62, 4), _stoneware(0.62, 0.66, 0.62, 4), "#2a140a"
        ),
        "cup",
    ),
    Item("bowl_glazed", "bowl", lambda: tableware.bowl((0.19, 0.19, 0.075)), "bowl"),
    Item(
        "bowl_wood",
        "bowl",
        lambda: vessels.bowl(0.130, 0.095, materials.wood("walnut"), materials.wood("walnut"), 0.4),
        "bowl",
    ),
    Item(
        "bowl_cereal",
        "bowl",
        lambda: vessels.bowl(0.078, 0.062, materials.paint("#3c6a8f", 0.2), materials.ceramic(), 1.0),
        "bowl",
    ),
    Item(
        "bottle_washing_liquid",
        "soap bottle",
        lambda: _forward(tableware.washing_liquid((0.075, 0.075, 0.225))),
        "bottle",
    ),
    Item(
        "bottle_wine",
        "bottle",
        lambda: vessels.wine_bottle("#1d2a17", "CASTELLO", "#efe6d0", "#5a1e24", "#5a1e24"),
        "bottle",
    ),
    Item("bottle_water", "bottle", vessels.water_bottle, "bottle"),
    Item("bottle_milk", "bottle", vessels.milk_bottle, "bottle"),
    Item(
        "wine_glass_red",
        "wine glass",
        lambda: vessels.wine_glass(0.043, 0.110, 0.095, 0.80, 0.38, "#4a0d18"),
        "wine glass",
    ),
    Item(
        "wine_glass_white",
        "wine glass",
        lambda: vessels.wine_glass(0.036, 0.098, 0.100, 0.86, 0.40, "#d8c56a"),
        "wine glass",
    ),
    Item(
        "wine_glass_flute",
        "wine glass",
        lambda: vessels.wine_glass(0.026, 0.150, 0.075, 0.90, 0.75, "#e0c878"),
        "wine glass",
    ),
    Item("fork_table", "fork", lambda: cutlery.fork(0.200), "fork"),
    Item("fork_cake", "fork", lambda: cutlery.fork(0.150, 3), "fork"),
    Item("fork_wood", "fork", lambda: cutlery.fork(0.205, 4, materials.wood("walnut")), "fork"),
    Item("knife_table", "knife", lambda: cutlery.table_knife(0.220), "knife"),
    Item("knife_wood", "knife", lambda: cutlery.table_knife(0.225, materials.wood("walnut")), "knife"),
    Item("knife_kitchen", "knife", lambda: cutlery.kitchen_knife(0.320, 0.045, cutlery.black_handle()), "knife"),
    Item("spoon_table", "spoon", lambda: cutlery.spoon(0.200, 0.066), "spoon"),
    Item("spoon_tea", "spoon", lambda: cutlery.spoon(0.140, 0.043), "spoon"),
    Item("spoon_wood", "spoon", lambda: cutlery.spoon(0.205, 0.066, materials.wood("walnut")), "spoon"),
    Item("spoon_crock", "spoon", lambda: _forward(tableware.spoons((0.125, 0.105, 0.32))), "spoon", is_group=True),
    Item("plate_dinner", "plate", lambda: (plate(0.27, materials.ceramic()),)),
    Item("vase_matt", "vase", lambda: tableware.vase((0.16, 0.16, 0.30))),
    Item("tray_walnut", "tray", lambda: tableware.tray((0.30, 0.42, 0.035))),
)
