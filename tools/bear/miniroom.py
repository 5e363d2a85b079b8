"""The bed-sitting room `miniroom`: what stands where, and what carries what the ground truth leaves in the air."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

from tools.bear.published import Box, Published
from tools.bear.room import Opening, Shell, door, pendant, shell, window
from tools.household import materials
from tools.household.bed import double_bed
from tools.household.books import book, book_stack, magazines
from tools.household.decor import canister, curtain, curtain_rod, floor_lamp, radiator, rug, towel
from tools.household.joinery import board
from tools.household.model import Model, Part, SceneObject, fit_to_box, merge, moved, placed, rotation, transformed
from tools.household.plants import dracaena, potted_plant
from tools.household.seating import spindle_chair, upholstered_chair
from tools.household.shapes import cylinder, tube
from tools.household.small_objects import alarm_clock, apple, basket, picture
from tools.household.storage import chest_of_drawers, counter, deep_sill, sink, splashback, tap
from tools.household.tables import low_table, round_table
from tools.household.tableware import cup, spoons, tray, washing_liquid

Maker: TypeAlias = Callable[[Sequence[float]], Model]

ROOM = Shell(west=-0.90, east=3.385, south=-1.18, north=3.36, height=2.60)
WINDOW = Opening(low=1.34, high=3.00, bottom=0.90, top=2.27)
DOOR = Opening(low=0.62, high=1.44, bottom=0.0, top=2.03)
SILL_TOP = 0.828
CHEST_TOP = 0.965
COUNTER_TOP = 0.8835
_WALNUT = (0.82, 0.92, 1.0)
_PALE_OAK = (0.93, 0.96, 1.0)


def miniroom(layout: Published) -> list[SceneObject]:
    """All objects of the scene, the published ones first, in the published order."""
    makers = _makers()
    objects = []
    for box in layout.objects:
        model = makers[box.instance](box.extent)
        objects.append(
            SceneObject(
                box.instance, fit_to_box(model, box.extent, box.centroid, may_turn=False), box.category, box.is_group
            )
        )
    return objects + _structure() + _carriers(layout) + _decoration()


def _makers() -> dict[str, Maker]:
    """The maker of each published object, facing the right way, from its published extent."""
    oak, dark = materials.wood("oak", tint=_PALE_OAK), materials.wood("walnut", tint=_WALNUT)
    spindle, padded = spindle_chair(oak), upholstered_chair(dark, materials.linen("seat linen", "#75836f"))
    return {
        "SM_MERGED_SM_MERGED_SM_AI_vol3_3_bed_01_v7_0": lambda _: double_bed(
            oak,
            materials.linen("headboard linen", "#a3937a"),
            materials.linen("white linen", "#ebe7dd"),
            materials.linen("duvet linen", "#d8d2c4"),
            materials.knit("terracotta throw", "#a8603f"),
            materials.striped_linen(),
            materials.linen("ochre linen", "#b5813c"),
        ),
        "SM_AI_vol3_3_chair_02_0": lambda _: _turned(padded, 6.0),
        "SM_AI_vol4_03_chair_01_2": lambda _: _turned(spindle, 172.0),
        "SM_AI_vol4_03_chair_5": lambda _: _turned(spindle, -24.0),
        "SM_MERGED_SM_AI_vol3_3_table_01_v1_1": lambda _: low_table(dark),
        "SM_MERGED_SM_AI_vol3_3_table_01_v1_0": lambda _: _turned(low_table(dark), 90.0),
        "SM_AI_vol3_1_table_03_12": lambda _: round_table(oak),
        "gadget_073_alrmclock_v1_10": alarm_clock,
        "SM_AI_vol3_2_plant_01_22": potted_plant,
        "SM_MERGED_SM_AI_vol3_3_can_02_0": dracaena,
        "prop_books_025_33": book,
        "AIUE_V01_001_Books2_2": book_stack,
        "SM_AI_vol3_3_books_01_0": magazines,
        "SM_AI_Vol5_1_cup_05_01_22": cup,
        "apple_19": apple,
        "SM_AI_vol3_3_washliquid_02_0": washing_liquid,
        "SM_AI_vol3_3_spoon_02_11": spoons,
        "SM_AI_vol3_3_sink_01_0": lambda extent: _turned(
            sink(extent[1], extent[0], extent[2], 0.0175, materials.ceramic()), 90.0
        ),
    }


def _turned(model: Model, yaw_deg: float) -> Model:
    return transformed(model, rotation("z", yaw_deg))


def _structure() -> list[SceneObject]:
    warm_white = materials.wall_paint("warm white", "#ebe6dc")
    paints = {
        "wall_south": warm_white,
        "wall_west": warm_white,
        "wall_north": warm_white,
        "wall_east": materials.wall_paint("sage", "#8d9a86"),
        "ceiling": materials.wall_paint("ceiling white", "#f2efe8"),
    }
    glow = materials.glowing("paper shade", (1.0, 0.74, 0.45), 0.55)
    return [
        *shell(ROOM, WINDOW, DOOR, paints, materials.oak_floor()),
        SceneObject("window", window(WINDOW, ROOM.south), on_wall=True),
        SceneObject("door", door(DOOR, ROOM.north)),
        SceneObject("pendant_lamp", placed(pendant(ROOM.height, 1.86, glow), (2.53, 2.69, 0.0)), on_wall=True),
    ]


def _carriers(layout: Published) -> list[SceneObject]:
    """The sill, chest and counter under the floating objects."""
    oak, black = materials.wood("oak", tint=_PALE_OAK), materials.black_steel()
    basin = layout.box("SM_AI_vol3_3_sink_01_0")
    length, depth = 1.33, 0.53
    middle = ROOM.west + 0.005 + length / 2
    # The counter's model faces +x; turned by -90 degrees it faces -y, with its y axis along the room's x axis.
    hole = (ROOM.north - basin.centroid[1], basin.centroid[0] - middle)
    kitchen = counter(
        length,
        depth,
        COUNTER_TOP,
        hole,
        (basin.extent[1] - 0.030, basin.extent[0] - 0.030),
        materials.paint("#5f6f6a", 0.45),
        materials.worktop(),
        materials.brass(),
    )
    sill_low, sill_high = 0.40, 2.42
    sill = deep_sill(sill_high - sill_low, 0.545, SILL_TOP, oak, black)
    chest = chest_of_drawers(0.405, 1.12, CHEST_TOP, materials.wood("walnut", tint=_WALNUT), materials.brass())
    north = ROOM.north
    return [
        SceneObject("sill", placed(sill, ((sill_low + sill_high) / 2, ROOM.south, 0), 90.0), on_wall=True),
        SceneObject("chest_of_drawers", placed(chest, (ROOM.west + 0.016, 0.63, 0))),
        SceneObject("counter", placed(kitchen, (middle, north, 0), -90.0)),
        SceneObject("tap", placed(tap(0.16, 0.26), (basin.centroid[0], north - 0.052, COUNTER_TOP), -90.0)),
        SceneObject(
            "splashback",
            placed(splashback(length, COUNTER_TOP, 1.42, materials.tiles()), (middle, north, 0), -90.0),
            on_wall=True,
        ),
        _stand("saucer", layout.box("SM_AI_vol3_2_plant_01_22"), SILL_TOP),
        _stand("pot_stand", layout.box("SM_MERGED_SM_AI_vol3_3_can_02_0"), SILL_TOP),
        _mat(layout.box("AIUE_V01_001_Books2_2"), CHEST_TOP),
    ]


def _stand(name: str, box: Box, top: float) -> SceneObject:
    """A round stoneware saucer that fills the gap between a carrier's top and a pot's bottom."""
    low = box.centroid[2] - box.extent[2] / 2
    plate = moved(cylinder(0.36 * min(box.extent[:2]), low - top), box.centroid[0], box.centroid[1], top)
    return SceneObject(name, (Part(plate, materials.paint("#9a6a4e", 0.7)),))


def _mat(box: Box, top: float) -> SceneObject:
    """A wooden board under the pile of books."""
    low = box.centroid[2] - box.extent[2] / 2
    half = [extent / 2 + 0.03 for extent in box.extent[:2]]
    x, y = box.centroid[:2]
    plate = board((x - half[0], y - half[1], top), (x + half[0], y + half[1], low), 0.004)
    return SceneObject("board", (Part(plate, materials.wood("beech")),))


def _decoration() -> list[SceneObject]:
    black, cloth = materials.black_steel(), materials.curtain_cloth()
    rug_width, rug_depth = 1.55, 1.05
    rod_z = 2.41
    left, right = (1.12, 0.42), (3.14, 0.38)
    objects = [
        SceneObject("rug", placed(rug(rug_width, rug_depth, materials.rug(rug_width, rug_depth)), (0.62, 1.62, 0))),
        SceneObject("curtain_rod", placed(curtain_rod(2.44, 0.085, black), (2.12, ROOM.south, rod_z)), on_wall=True),
        SceneObject(
            "radiator",
            placed(radiator(0.95, 0.50, materials.paint("#efece5"), materials.brushed_steel()), (-0.28, ROOM.south, 0)),
        ),
        SceneObject(
            "floor_lamp", placed(floor_lamp(1.62, black, materials.linen("shade linen", "#e6dfd0")), (-0.66, 2.16, 0))
        ),
        SceneObject("basket", placed(basket((0.36, 0.36, 0.34)), (-0.62, -0.62, 0.17))),
    ]
    objects += _kitchen_shelf() + _switches()
    for index, (x, width) in enumerate((left, right)):
        model = curtain(width, 0.86, rod_z - 0.01, 5, cloth, index)
        objects.append(SceneObject(f"curtain_{index + 1}", placed(model, (x, ROOM.south + 0.085, 0)), on_wall=True))
    hung = [
        ((0.50, 0.024, 0.70), (ROOM.west + 0.012, 0.63, 1.62), 90.0, 4),
        ((0.42, 0.022, 0.56), (ROOM.east - 0.011, -0.26, 1.50), -90.0, 1),
        ((0.42, 0.022, 0.56), (ROOM.east - 0.011, 0.34, 1.50), -90.0, 2),
        ((0.70, 0.024, 0.50), (2.55, ROOM.north - 0.012, 1.50), 0.0, 6),
        ((0.44, 0.022, 0.56), (-0.30, ROOM.south + 0.011, 1.50), 180.0, 3),
    ]
    for index, (extent, position, yaw, seed) in enumerate(hung):
        model = placed(picture(extent, seed), position, yaw)
        objects.append(SceneObject(f"picture_{index + 1}", model, on_wall=True))
    return objects


def _kitchen_shelf() -> list[SceneObject]:
    """An open shelf over the splashback with canisters and a tray, and a towel on its rail."""
    wall, low, high, top = ROOM.north, -0.78, 0.30, 1.56
    shelf = board((low, wall - 0.20, top - 0.026), (high, wall, top), 0.004)
    rail = tube([(low + 0.08, wall - 0.17, top - 0.07), (high - 0.08, wall - 0.17, top - 0.07)], 0.006, 10)
    irons = [rail]
    for x in (low + 0.14, high - 0.14):
        irons.append(board((x - 0.012, wall - 0.19, top - 0.032), (x + 0.012, wall, top - 0.026), 0.001))
        irons.append(board((x - 0.012, wall - 0.005, top - 0.16), (x + 0.012, wall, top - 0.026), 0.001))
        irons.append(tube([(x, wall - 0.17, top - 0.07), (x, wall - 0.17, top - 0.03)], 0.004, 8))
    model = (
        Part(shelf, materials.wood("oak", tint=_PALE_OAK)),
        Part(merge(irons), materials.brass()),
        Part(towel(0.09, top - 0.07, wall - 0.17, 0.30, 0.40), materials.linen("towel", "#c9b9a0")),
    )
    objects = [SceneObject("kitchen_shelf", model, on_wall=True)]
    jars = ((-0.66, 0.060, 0.175, "#b9aa93"), (-0.51, 0.052, 0.140, "#6f7d78"), (-0.38, 0.045, 0.105, "#b9aa93"))
    for index, (x, radius, height, glaze) in enumerate(jars):
        jar = canister(radius, height, materials.paint(glaze, 0.35), materials.wood("oak", tint=_PALE_OAK))
        objects.append(SceneObject(f"canister_{index + 1}", placed(jar, (x, wall - 0.10, top))))
    standing = transformed(tray((0.34, 0.24, 0.022)), rotation("x", 80.0), (0.02, wall - 0.035, top + 0.120))
    objects.append(SceneObject("tray", placed(standing, (0, 0, 0))))
    return objects


def _switches() -> list[SceneObject]:
    """A light switch by the door and two sockets."""
    white = materials.paint("#f3f1ec", 0.3)
    plates = [
        board((1.62, ROOM.north - 0.009, 1.05), (1.70, ROOM.north, 1.13), 0.003),
        board((1.636, ROOM.north - 0.013, 1.066), (1.684, ROOM.north, 1.114), 0.002),
        board((ROOM.west, 1.95, 0.26), (ROOM.west + 0.009, 2.03, 0.34), 0.003),
        board((ROOM.east - 0.009, 1.60, 0.26), (ROOM.east, 1.68, 0.34), 0.003),
    ]
    return [SceneObject("switches", (Part(merge(plates), white),), on_wall=True)]
