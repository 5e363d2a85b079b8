"""Fruit and cakes."""

from tools.household import food, materials, textures
from tools.household.item import Item

ITEMS = (
    Item("apple_red", "apple", lambda: food.apple(textures.apple_skin(0), 0.078, 0.082, 0), "apple"),
    Item("apple_green", "apple", lambda: food.apple(textures.green_apple_skin(1), 0.074, 0.076, 3), "apple"),
    Item("apple_streaked", "apple", lambda: food.apple(textures.apple_skin(5), 0.070, 0.080, 5), "apple"),
    Item("banana_ripe", "banana", lambda: food.banana(0.19, 70.0, 0.45), "banana"),
    Item("banana_spotted", "banana", lambda: food.banana(0.175, 82.0, 0.95, 2), "banana"),
    Item("banana_bunch", "banana", lambda: food.banana_bunch(4, 0.35, 1), "banana", is_group=True),
    Item("orange_navel", "orange", lambda: food.orange(0.082, 0.96, "#e5821e"), "orange"),
    Item("orange_mandarin", "orange", lambda: food.orange(0.066, 0.80, "#e0701a", 2), "orange"),
    Item("orange_half", "orange", lambda: food.orange_half(0.080), "orange"),
    Item(
        "cake_layered",
        "cake",
        lambda: food.layer_cake(0.22, 0.095, "#4a2616", "#c98f4e", "#a01c2a", materials.ceramic()),
        "cake",
    ),
    Item(
        "cake_slice",
        "cake",
        lambda: food.cake_slice(0.12, 0.085, "#f0c9cf", "#d9a860", "#f6efe2", materials.ceramic()),
        "cake",
    ),
    Item("cake_bundt", "cake", lambda: food.bundt_cake(0.23, 0.095, materials.ceramic()), "cake"),
    Item("cake_cupcake", "cake", lambda: food.cupcake("#e7b3c2", "#7a4a26"), "cake"),
)
