"""The decoration and the lamps of the house; none of it is in any map of objects."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tools.bear import house_plan as plan
from tools.bear.furnish import Side, against, hanging, stand

if TYPE_CHECKING:
    from benchbot_scenes.layout import Placement


def decor() -> list[Placement]:
    """All of it."""
    return [*_lamps(), *_rugs(), *_walls(), *_curtains(), *_furniture()]


def _lamps() -> list[Placement]:
    ceiling = {
        "living_lamp": ("pendant_lamp_globe", (-2.90, 2.90)),
        "dining_lamp": ("pendant_lamp_dome", (1.08, 4.04)),
        "lounge_lamp": ("pendant_lamp_drum", (-3.50, -2.00)),
        "hall_lamp": ("ceiling_lamp_disc", (0.40, 0.20)),
        "hall_lamp_east": ("ceiling_lamp_disc", (3.20, 0.20)),
        "kitchen_lamp": ("ceiling_lamp_disc", (3.00, 4.30)),
        "entry_lamp": ("ceiling_lamp_disc", (6.10, 0.25)),
        "washroom_lamp": ("ceiling_lamp_disc", (2.40, -2.70)),
        "corridor_lamp": ("ceiling_lamp_disc", (-2.42, -5.10)),
        "bedroom_lamp": ("pendant_lamp_globe", (-1.65, -8.60)),
        "bathroom_lamp": ("ceiling_lamp_disc", (3.60, -8.00)),
        "bathroom_lamp_west": ("ceiling_lamp_disc", (1.70, -9.60)),
    }
    return [
        *(hanging(name, model, at, plan.HEIGHT_M) for name, (model, at) in ceiling.items()),
        stand("living_floor_lamp", "floor_lamp_tripod", (-4.75, 4.75)),
        stand("lounge_floor_lamp", "floor_lamp_drum", (-4.95, -0.95)),
        stand("lounge_table_lamp", "table lamp", (0.60, -3.62), 0.538),
        stand("living_table_lamp", "table lamp", (-5.08, 0.80), 0.671),
        stand("bedroom_table_lamp", "table lamp", (-3.82, -7.53), 0.684),
    ]


def _rugs() -> list[Placement]:
    return [
        stand("living_rug", "rug", (-2.90, 2.80), size=(2.10, 2.70, 0.008)),
        stand("lounge_rug", "rug", (-3.55, -2.05), size=(2.30, 2.90, 0.008)),
        stand("bedroom_rug", "rug", (-1.65, -8.80), yaw_deg=90, size=(1.50, 2.30, 0.008)),
        stand("entry_mat", "rug", (7.05, 0.25), size=(0.70, 1.10, 0.008)),
        stand("bath_mat", "rug", (1.60, -7.05), yaw_deg=90, size=(0.60, 0.95, 0.008)),
    ]


def _walls() -> list[Placement]:
    """Pictures, mirrors and radiators."""
    west, north, south = plan.LIVING_WEST, plan.LIVING_NORTH, plan.LIVING_SOUTH
    return [
        against("living_picture_1", "picture_landscape", "west", west, 0.95, 1.40),
        against("living_picture_2", "picture_fern", "north", north, -4.86, 1.45),
        against("lounge_picture", "picture_arch", "west", west, 0.05, 1.35),
        against("lounge_picture_south", "picture_moon", "south", south, -1.15, 1.40),
        against("dining_picture", "picture_landscape", "west", plan.KITCHEN_WEST, 4.20, 1.45),
        against("dining_picture_north", "picture_moon", "north", plan.KITCHEN_NORTH, 0.45, 1.40),
        against("hall_picture", "picture_arch", "south", plan.HALL_SOUTH, 2.60, 1.35),
        against("entry_picture", "picture_fern", "south", plan.ENTRY_SOUTH, 6.10, 1.45),
        against("bedroom_picture_1", "picture_moon", "east", plan.BEDROOM_EAST, -9.05, 1.40),
        against("bedroom_picture_2", "picture_landscape", "north", plan.BEDROOM_NORTH, -0.70, 1.45),
        against("washroom_mirror", "mirror", "south", plan.WASHROOM_SOUTH, 2.898, 1.18, size=(0.025, 0.55, 0.75)),
        against("bathroom_mirror", "mirror", "east", plan.BATH_EAST, -9.01, 1.42, size=(0.025, 0.90, 0.75)),
        against("living_radiator", "radiator", "north", north, -2.90, 0.12),
        against("lounge_radiator", "radiator", "west", west, -2.05, 0.03, size=(0.10, 1.20, 0.60)),
        against("dining_radiator", "radiator", "north", plan.KITCHEN_NORTH, 2.35, 0.12),
        against("entry_radiator", "radiator", "north", plan.ENTRY_NORTH, 6.10, 0.12),
        against("bedroom_radiator", "radiator", "west", plan.BEDROOM_WEST, -9.20, 0.10),
        against("bathroom_radiator", "radiator", "south", plan.BATH_SOUTH, 3.70, 0.12, size=(0.10, 0.80, 0.60)),
    ]


def _curtains() -> list[Placement]:
    """A pair at each side of the large windows, from just above the floor to just under the ceiling."""
    pairs: dict[str, tuple[Side, float, float, float, str]] = {
        "living_west": ("west", plan.LIVING_WEST, 3.20, 1.27, "curtain_sand"),
        "living_north": ("north", plan.LIVING_NORTH, -2.90, 1.32, "curtain_sand"),
        "lounge_west": ("west", plan.LIVING_WEST, -2.05, 1.32, "curtain_sand"),
        "bedroom_west": ("west", plan.BEDROOM_WEST, -9.20, 1.02, "curtain_green"),
    }
    return [
        against(f"{name}_curtain_{number}", model, side, wall, middle + offset, 0.03, size=(0.09, 0.56, 2.36))
        for name, (side, wall, middle, half, model) in pairs.items()
        for number, offset in enumerate((-half, half), 1)
    ]


def _furniture() -> list[Placement]:
    """Furniture and small things that nothing published stands on."""
    wardrobe = (0.60, 1.10, 2.10)
    return [
        against("bedroom_wardrobe", "wardrobe", "west", plan.BEDROOM_WEST, -10.97, size=(0.60, 0.90, 2.05)),
        against("dressing_wardrobe_1", "wardrobe", "west", plan.BATH_WEST, -8.85, size=wardrobe),
        against("dressing_wardrobe_2", "wardrobe", "west", plan.BATH_WEST, -7.73, size=wardrobe),
        against("bathtub", "bathtub", "north", plan.BATH_NORTH, 1.62),
        stand("shower", "shower_corner", (5.16, -6.37), yaw_deg=180),
        stand("coat_rack", "coat rack", (7.40, -0.62)),
        stand("living_basket", "basket", (-4.98, 0.25)),
        stand("divider_vase", "vase", (-0.45, 2.81), 1.083),
        stand("counter_tray", "tray", (4.06, 3.10), 1.039),
    ]
