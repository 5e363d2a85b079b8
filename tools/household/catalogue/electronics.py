"""Electronics for desks and living rooms."""

from tools.household import electronics, materials
from tools.household.item import Item
from tools.household.model import Material, Model, Texture
from tools.household.textures import linear_color, screens

_BLACK, _WHITE = "#1b1c1e", "#e9e9e6"


def _aluminium(code: str = "#c9cbce") -> Material:
    return Material(f"aluminium {code}", linear_color(code), roughness=0.35, metallic=1.0)


def _tv(width_m: float, height_m: float, foot: str, seed: int) -> Model:
    return electronics.flat_screen(
        width_m, height_m, screens.film(width_m, height_m, seed), foot, materials.paint(_BLACK, 0.3)
    )


def _monitor(width_m: float, height_m: float, picture: Texture, case: Material) -> Model:
    return electronics.flat_screen(width_m, height_m, picture, "column", case)


def _laptop(width_m: float, depth_m: float, angle_deg: float, seed: int, case: Material) -> Model:
    picture = screens.desktop(width_m - 0.022, depth_m * 0.98 - 0.036, seed)
    return electronics.laptop(width_m, depth_m, angle_deg, picture, case, "#202124", "#d8d8d8")


def _phone(length_m: float, width_m: float, seed: int, case: Material, is_face_up: bool = True) -> Model:
    picture = screens.phone_screen(width_m - 0.007, length_m - 0.010, seed)
    return electronics.phone(length_m, width_m, picture, case, is_face_up)


ITEMS = (
    Item("tv_legs", "tv", lambda: _tv(1.11, 0.64, "legs", 0), "tv", texture_px=512),
    Item("tv_wall", "tv", lambda: _tv(1.23, 0.71, "wall", 1), "tv", "wall", texture_px=512),
    Item("tv_small", "tv", lambda: _tv(0.73, 0.43, "column", 2), "tv", texture_px=512),
    Item(
        "monitor_black",
        "monitor",
        lambda: _monitor(0.54, 0.32, screens.wallpaper(0.54, 0.32, 1), materials.paint(_BLACK, 0.4)),
        "tv",
        texture_px=512,
    ),
    Item(
        "monitor_wide",
        "monitor",
        lambda: _monitor(0.81, 0.36, screens.desktop(0.81, 0.36, 2), materials.paint("#c9cbce", 0.35)),
        "tv",
        texture_px=512,
    ),
    Item(
        "keyboard_black",
        "keyboard",
        lambda: electronics.keyboard(0.445, 0.135, materials.paint(_BLACK, 0.5), "#232427", "#d9d9d9", True),
        "keyboard",
        texture_px=512,
    ),
    Item(
        "keyboard_white",
        "keyboard",
        lambda: electronics.keyboard(0.28, 0.115, _aluminium(), "#f1f1ef", "#5a5a5a", False),
        "keyboard",
        texture_px=512,
    ),
    Item(
        "keyboard_grey",
        "keyboard",
        lambda: electronics.keyboard(0.36, 0.14, materials.paint("#3e4a55", 0.5), "#d8cfba", "#3a3a3a", True),
        "keyboard",
        texture_px=512,
    ),
    Item(
        "mouse_black",
        "mouse",
        lambda: electronics.mouse(
            0.115, 0.063, 0.038, materials.paint(_BLACK, 0.35), materials.paint("#5b5d60", 0.5), True
        ),
        "mouse",
    ),
    Item(
        "mouse_white",
        "mouse",
        lambda: electronics.mouse(
            0.108, 0.058, 0.032, materials.paint(_WHITE, 0.2), materials.paint("#9a9c9e", 0.4), False
        ),
        "mouse",
    ),
    Item(
        "mouse_blue",
        "mouse",
        lambda: electronics.mouse(
            0.100, 0.062, 0.036, materials.paint("#31506f", 0.4), materials.paint(_BLACK, 0.5), False
        ),
        "mouse",
    ),
    Item("laptop_silver", "laptop", lambda: _laptop(0.325, 0.227, 112.0, 4, _aluminium()), "laptop", texture_px=384),
    Item(
        "laptop_black",
        "laptop",
        lambda: _laptop(0.36, 0.245, 105.0, 1, materials.paint(_BLACK, 0.45)),
        "laptop",
        texture_px=384,
    ),
    Item(
        "laptop_blue",
        "laptop",
        lambda: _laptop(0.305, 0.215, 120.0, 6, _aluminium("#6f8299")),
        "laptop",
        texture_px=384,
    ),
    Item(
        "cell_phone_black", "cell phone", lambda: _phone(0.148, 0.072, 0, materials.paint(_BLACK, 0.25)), "cell phone"
    ),
    Item("cell_phone_white", "cell phone", lambda: _phone(0.161, 0.077, 1, materials.paint(_WHITE, 0.2)), "cell phone"),
    Item(
        "cell_phone_blue",
        "cell phone",
        lambda: _phone(0.153, 0.074, 2, materials.paint("#35557a", 0.35), False),
        "cell phone",
    ),
    Item(
        "clock_radio",
        "clock",
        lambda: electronics.clock_radio(0.17, 0.075, 0.075, materials.paint("#2a2b2d", 0.4)),
        "clock",
    ),
)
