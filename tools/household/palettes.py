"""Palettes: what the parts of a model are made of in its variations, as the catalogue has them.

A palette is a list of groups: each of its textures (of `looks`, or "own": the model's) in each colour and window.
"""

from typing import Any

from benchbot_scenes.variations import FRONTS

_WOODS = ["oak", "walnut", "beech", "cherry", "pine"]
_NATURAL = "#ffffff"
# Clear oil, a warm and a grey stain, smoked, ebonised.
_STAINS = [_NATURAL, "#ecd9b8", "#b4ada4"]
_DARK_STAINS = ["#8d7460", "#4c4540"]
_PAINTED = ["#f0ede4", "#2b2a29", "#7f9183", "#3d5468", "#a34f3a", "#c9b48a", "#8a9aa6"]
_FABRICS = [
    *("#8b8f94", "#b7a58a", "#46597a", "#d9d2c3", "#5d6f60", "#33373d", "#7d4a3a", "#c3c7c9", "#a3906f"),
    *("#93a7a4", "#b07a3a", "#5b5048", "#9a5f55"),
]
_BEDDING = ["#f1efe9", "#d8d2c4", "#c9d0d6", "#aebbb0", "#d9c2b4", "#8d99a8", "#e6d9a8", "#b9a9bd", "#5f6d7a"]
_ACCENTS = [
    *("#b5813c", "#3f5568", "#a8603f", "#6f8f7a", "#d8cdb8", "#7a3f4c", "#2f4a45", "#c9a0a0", "#e0b64a"),
    *("#4c4f57", "#8fa9c0"),
]
_GLAZES = [
    *("#f3f0e8", "#3c6a8f", "#d39a2d", "#8a3f33", "#4d6b57", "#2d2f33", "#c9b9a0", "#93b0b5", "#d98f7a"),
    *("#5d5577", "#e3d27a", "#a9b88f", "#75523a"),
]
_STEEL = ["#8d9296", "#5e6b73", "#d5d8d6", "#2d3236", "#3f5f6d", "#a7a294", "#6d7a66"]
_WASHES = ["#ffffff", "#ffe2c4", "#d3e3f5", "#e0f0d0", "#f7cfc9", "#cfc8bd", "#a9a39a"]
"""Tints that multiply a texture: as it is, warm, cool, green, rosy, greyed, darker."""

_UPRIGHT = [[0.16, 0.0, 0.84, 1.0], [0.84, 0.0, 0.16, 1.0], [0.05, 0.1, 0.6, 0.95], [0.95, 0.1, 0.4, 0.95]]
_LYING = [[0.0, 0.16, 1.0, 0.84], [1.0, 0.16, 0.0, 0.84], [0.1, 0.05, 0.95, 0.6], [0.9, 0.35, 0.05, 0.95]]
JACKETS = [f"jacket {number}" for number in range(11)]
PRINTS = [f"print {number}" for number in range(16)]
_PRINT_TINTS = ["#ffffff", "#f2dcc0", "#cfdde6"]

PALETTES: dict[str, list[dict[str, Any]]] = {
    "wood": [
        {"textures": _WOODS, "colors": _STAINS, "roughness": 0.46},
        {"textures": ["oak", "beech"], "colors": _DARK_STAINS, "roughness": 0.44},
    ],
    "wood or paint": [
        {"textures": _WOODS, "colors": _STAINS[:2], "roughness": 0.46},
        {"textures": ["oak", "beech"], "colors": _DARK_STAINS, "roughness": 0.44},
        {"colors": _PAINTED, "roughness": 0.42},
    ],
    "furniture paint": [{"colors": [*_PAINTED, "#e9e6df", "#5f6f6a", "#d3d8cf", "#4a3f38"], "roughness": 0.42}],
    FRONTS: [
        {"colors": ["#5f6f6a", "#eceae4", "#2f3d4a", "#b9b2a3", "#8fa39a", "#6d3f3a", "#d8d6c8"], "roughness": 0.4},
    ],
    "worktop": [{"textures": ["own"], "colors": ["#ffffff", "#d9c3a3", "#8b8b8c", "#4a4a4c", "#c9d0cf"]}],
    "upholstery": [
        {"textures": ["linen"], "colors": _FABRICS, "roughness": 0.92},
        {"textures": ["boucle"], "colors": _FABRICS[:10], "roughness": 0.95},
    ],
    "plain upholstery": [{"colors": _FABRICS, "roughness": 0.9}],
    "bedding": [{"textures": ["linen"], "colors": _BEDDING, "roughness": 0.92}],
    "accents": [
        {"textures": ["linen"], "colors": _ACCENTS, "roughness": 0.94},
        {"textures": ["knit"], "colors": _ACCENTS[:8], "roughness": 0.95},
    ],
    "curtains": [{"textures": ["curtain"], "colors": [*_BEDDING[1:], *_ACCENTS], "roughness": 0.95}],
    "metal": [
        {"colors": ["#c2a468", "#d8d9da", "#8c6a4c", "#a9aaac"], "roughness": 0.3, "metallic": 1.0},
        {"colors": ["#2c2c2d"], "roughness": 0.45},
    ],
    "cutlery": [
        {"colors": ["#cfcfce", "#e3e3e2", "#b0b1b2", "#c8ad76"], "roughness": 0.28, "metallic": 1.0},
    ],
    "glaze": [
        {"colors": _GLAZES, "roughness": 0.2},
        {"textures": ["stoneware"], "colors": [_NATURAL, *_GLAZES[:5], "#9aa7a0"], "roughness": 0.4},
    ],
    "plain glaze": [{"colors": _GLAZES, "roughness": 0.22}],
    "lining": [{"colors": ["#f3f0e8", "#e8dfcc", "#d9dcd8", "#f5f3ef", "#2d2f33"], "roughness": 0.22}],
    "pots": [
        {"textures": ["own"], "colors": ["#ffffff", "#d9c0ae", "#b5b0a8"]},
        {"colors": _GLAZES[:10], "roughness": 0.35},
    ],
    "foliage": [{"textures": ["own"], "colors": ["#ffffff", "#e2f0c4", "#cfd9b0", "#f3efc0", "#c9e0d6"]}],
    "fruit": [{"textures": ["own"], "colors": ["#ffffff", "#ffedc4", "#f2e2d0", "#fff3b8", "#f0d8b4"]}],
    "baked": [
        {"textures": ["own"], "colors": ["#ffffff", "#f3d6b3", "#a98f74", "#e2d3d3", "#776a60", "#d9cbb5", "#8f6a4c"]}
    ],
    "baked chair": [
        {"textures": ["own"], "colors": ["#ffffff", "#d9cbb5"]},
        {"colors": [*_PAINTED, "#c79a63", "#6b4630"], "roughness": 0.45},
    ],
    "washed": [{"textures": ["own"], "colors": _WASHES}],
    "rug": [
        {
            "textures": ["own"],
            "colors": [
                "#ffffff",
                "#a9bde0",
                "#e0a9a0",
                "#b5c9a6",
                "#d9c08a",
                "#9a9a9a",
                "#cbb0d6",
                "#8fb5b5",
                "#b98a6a",
            ],
        }
    ],
    "device": [
        {"colors": ["#1b1c1e", "#c9cbce", "#3e4a55", "#e9e9e6", "#6b6e73", "#31506f", "#d8cfc0"], "roughness": 0.42}
    ],
    "office chair": [{"colors": ["#2b2c2e", "#d9d9d6", "#6f7377", "#4a5560", "#f0efec"], "roughness": 0.45}],
    "screen": [{"colors": ["#1b1c1e", "#2e3033", "#c9cbce", "#3e4044", "#e4e4e2"], "roughness": 0.4}],
    "soap": [{"colors": ["#6b3410", "#efece2", "#8ea58c", "#2a2b2c", "#c9a58e", "#7d94a8"], "roughness": 0.25}],
    "plates": [
        {"colors": ["#f3f0e8", "#e3dccb", "#c9d3d6", "#b9c4ad", "#7f97ad", "#f1e3d8"], "roughness": 0.2},
        {"textures": ["stoneware"], "colors": [_NATURAL, "#9aa7a0", "#c7b7a2"], "roughness": 0.4},
    ],
    "appliance": [
        {"colors": ["#efefed", "#8fb5ab", "#2b2d30", "#e6dcc3", "#9b2f2a", "#a9acae", "#47627a"], "roughness": 0.3}
    ],
    "steel": [{"colors": _STEEL, "roughness": 0.45}],
    "desk top": [{"colors": ["#e6e4df", "#cdb893", "#8d8f91", "#f2f1ee", "#8a6a4c"], "roughness": 0.42}],
    "cap": [{"colors": ["#3f7d57", "#2a6f9f", "#b3342b", "#e2b23a", "#efefed", "#2a2a2c"], "roughness": 0.4}],
    "label": [{"textures": ["own"], "colors": _WASHES}],
    "wine": [{"colors": ["#4a0d18", "#d8c56a", "#e0c878", "#d98f86", "#6b1524"], "roughness": 0.05}],
    "jackets": [{"textures": JACKETS, "colors": [*_WASHES, "#b9c8d9", "#d9b98a"], "roughness": 0.55}],
    "mats": [{"textures": ["own"], "colors": ["#ffffff", "#e6dfd0", "#8f9a94", "#3b3d40", "#d6c2b0"]}],
    "prints upright": [{"textures": PRINTS, "colors": _PRINT_TINTS, "windows": _UPRIGHT, "roughness": 0.55}],
    "prints lying": [{"textures": PRINTS, "colors": _PRINT_TINTS, "windows": _LYING, "roughness": 0.55}],
    "shoes": [
        {"colors": ["#5d7488", "#2b2a29", "#7a4b2c", "#d9d4c8", "#6f3038", "#4f5a45", "#a07a4c"], "roughness": 0.55}
    ],
    "skin": [{"colors": ["#e9c1a3", "#c9926e", "#8a5a3e", "#5c3b29", "#d9a987"], "roughness": 0.6}],
    "clothes": [{"textures": ["own"], "colors": ["#ffffff", "#c9b6a0", "#8fa6c9", "#b9c9a9", "#d9a6a6", "#8c8c8c"]}],
}
