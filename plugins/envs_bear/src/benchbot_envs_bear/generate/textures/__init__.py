"""Procedural textures, seeded and at real scale.

Every function returns a `Texture` that states the metres it covers. Those of wood, fabric and surfaces repeat
without a seam; prints and pictures cover their object once.
"""

from benchbot_envs_bear.generate.textures.fabric import (
    boucle,
    curtain,
    knit_throw,
    linen,
    linen_normal,
    rug,
    rug_normal,
    striped_linen,
)
from benchbot_envs_bear.generate.textures.noise import Color, hex_color, linear_color
from benchbot_envs_bear.generate.textures.organic import apple_skin, bark, leaf, strap_leaf
from benchbot_envs_bear.generate.textures.pictures import abstract, botanical, landscape
from benchbot_envs_bear.generate.textures.prints import (
    PALETTES,
    Palette,
    book_jacket,
    bottle_label,
    clock_dial,
    magazine_cover,
    pages,
    paper,
)
from benchbot_envs_bear.generate.textures.surfaces import (
    brushed_metal,
    brushed_metal_roughness,
    ceramic,
    plaster,
    plaster_normal,
    quartz_worktop,
    reactive_glaze,
    soil,
    stoneware,
    terracotta,
    tiles,
    tiles_normal,
)
from benchbot_envs_bear.generate.textures.wood import oak_planks, oak_planks_normal, wood

__all__ = [
    "PALETTES",
    "Color",
    "Palette",
    "abstract",
    "apple_skin",
    "bark",
    "book_jacket",
    "botanical",
    "bottle_label",
    "boucle",
    "brushed_metal",
    "brushed_metal_roughness",
    "ceramic",
    "clock_dial",
    "curtain",
    "hex_color",
    "knit_throw",
    "landscape",
    "leaf",
    "linear_color",
    "linen",
    "linen_normal",
    "magazine_cover",
    "oak_planks",
    "oak_planks_normal",
    "pages",
    "paper",
    "plaster",
    "plaster_normal",
    "quartz_worktop",
    "reactive_glaze",
    "rug",
    "rug_normal",
    "soil",
    "stoneware",
    "strap_leaf",
    "striped_linen",
    "terracotta",
    "tiles",
    "tiles_normal",
    "wood",
]
