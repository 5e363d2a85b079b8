"""How each model varies: the palettes of its materials by their names, and proportions by its kind."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchbot_scenes.gltf_file import split_glb
from benchbot_scenes.variations import FRONTS

_FIXED = {"door", "interior door", "window", "shower", "toilet"}
"""Kinds that stay as they are: those that fill openings or are mounted."""

_KITCHEN = {"kitchen counter", "wall cupboard", "sink", "oven"}

# The first pattern that a material's name matches, of its kind or class, says its palette; "-" leaves it as it is.
_OF_KIND: dict[str, tuple[tuple[str, str], ...]] = {
    "picture": ((r"(oak|walnut) \d", "wood or paint"), ("picture_mat", "mats")),
    "person": (("skin", "skin"), ("pullover|jeans|blouse|skirt|shirt|trousers", "clothes"), (".", "-")),
    "kitchen counter": (("paint", FRONTS), ("worktop", "worktop")),
    "wall cupboard": (("paint", FRONTS),),
    "sink": (("paint", FRONTS), ("worktop", "worktop"), ("ceramic", "-")),
    "oven": (("paint #5f6f6a", FRONTS), ("paint #ee", "appliance"), (".", "-")),
    "stove": (("paint #ee", "appliance"), (".", "-")),
    "refrigerator": (("paint #(8f|ef)", "appliance"), (".", "-")),
    "microwave": (("paint #(20|ec)", "appliance"), (".", "-")),
    "toaster": (("paint #(e6|9b)", "appliance"), (".", "-")),
    "bathtub": ((".", "-"),),
    "laptop": (("paint #1b|aluminium", "device"), (".", "-")),
    "cell phone": (("paint #(1b|35|e9)", "device"), (".", "-")),
    "keyboard": (("paint|aluminium", "device"), (".", "washed")),
    "mouse": (("paint #(1b1c1e|31|e9)", "device"),),
    "tv": (("paint", "screen"), (".", "-")),
    "monitor": (("paint", "screen"), (".", "-")),
    "soap bottle": (("bottle_amber", "soap"), ("bottle_label", "label"), (".", "-")),
    "clock": (("paint", "device"), ("clock_dial|clock face", "label")),
    "wall clock": (("clock face", "label"),),
    "office chair": (("baked", "office chair"),),
    "office cabinet": (("paint", "steel"),),
    "desk": (("paint #e6", "desk top"), ("paint", "steel")),
    "bottle": (("paint #(3f|2a|5a)", "cap"), ("label|bottle_label", "label"), ("baked", "washed"), (".", "-")),
    "cup": (
        ("paint #f1|cup_lining", "lining"),
        ("paint", "plain glaze"),
        ("ceramic|cup_glaze|stoneware", "glaze"),
        (".", "-"),
    ),
    "bowl": (("paint", "plain glaze"), ("ceramic|bowl_glaze", "glaze")),
    "plate": (("ceramic", "plates"),),
    "cake": (("ceramic", "glaze"), ("crust|sponge", "fruit"), (".", "-")),
    "vase": (("vase_clay", "glaze"),),
    "wine glass": (("wine", "wine"), (".", "-")),
    "radiator": ((".", "-"),),
    "whiteboard": ((".", "-"),),
    "mirror": (("mirror", "-"),),
    "rug": (("rug", "rug"), (".", "-")),
    "chest of drawers": (("paint", "furniture paint"),),
    "shoes": (("shoe upper", "shoes"), (".", "-")),
    "magnets": (("paint", "cap"), (".", "-")),
    "bin": (("paint #3a", "steel"), ("bin body", "appliance"), (".", "-")),
    "paper": (("page", "label"), (".", "-")),
    "charger": (("paint", "device"), (".", "-")),
    "power strip": (("paint #26", "screen"), (".", "-")),
    "desk cables": (("paint #26", "screen"), (".", "-")),
}
_OF_CLASS: dict[str, tuple[tuple[str, str], ...]] = {
    "book": (("book_jacket", "jackets"), ("magazine_cover", "washed"), (".", "-")),
    "couch": (("baked", "washed"),),
    "chair": (("baked", "baked chair"),),
    "bed": (("headboard", "upholstery"), ("duvet|pillow", "bedding"), ("white linen", "-")),
}
_ANY = (
    (r"(oak|walnut|beech|cherry|pine) \d", "wood"),
    ("sofa_fabric", "plain upholstery"),
    ("sofa #|seat linen", "upholstery"),
    ("cushion|throw", "accents"),
    ("curtain", "curtains"),
    ("cutlery steel|spoon_steel", "cutlery"),
    ("brass|black steel|chrome|brushed steel", "metal"),
    ("pot_", "pots"),
    ("leaf|cactus|cane|calyx", "foliage"),
    ("peel|orange face|banana|apple peel", "fruit"),
    ("lamp glaze|crock_glaze", "glaze"),
    ("seagrass", "washed"),
    ("baked", "baked"),
    ("ceramic", "-"),
    ("paint #", "furniture paint"),
)

_SHARED: dict[str, Mapping[str, tuple[float, float]]] = {
    "even": {"xyz": (0.93, 1.08)},
    "round": {"xy": (0.92, 1.1), "z": (0.9, 1.1)},
    "flat": {"yz": (0.88, 1.12)},
}
_SCALES: dict[str, Mapping[str, tuple[float, float]]] = {
    "table": {"x": (0.93, 1.07), "y": (0.9, 1.1), "z": (0.985, 1.02)},
    "coffee table": {"x": (0.9, 1.08), "y": (0.9, 1.1), "z": (0.93, 1.08)},
    "side table": {"xy": (0.9, 1.1), "z": (0.93, 1.1)},
    "desk": {"x": (0.93, 1.06), "y": (0.9, 1.1), "z": (0.985, 1.02)},
    "chair": {"x": (0.97, 1.04), "y": (0.95, 1.05), "z": (0.96, 1.04)},
    "armchair": {"x": (0.96, 1.04), "y": (0.94, 1.05), "z": (0.96, 1.04)},
    "couch": {"x": (0.96, 1.04), "y": (0.94, 1.07), "z": (0.96, 1.04)},
    "bed": {"x": (0.97, 1.04), "y": (0.95, 1.08), "z": (0.94, 1.06)},
    "bookcase": {"x": (0.92, 1.1), "y": (0.9, 1.12), "z": (0.94, 1.08)},
    "wardrobe": {"x": (0.94, 1.04), "y": (0.92, 1.1), "z": (0.96, 1.06)},
    "chest of drawers": {"x": (0.93, 1.06), "y": (0.9, 1.1), "z": (0.92, 1.1)},
    "sideboard": {"x": (0.93, 1.06), "y": (0.9, 1.1), "z": (0.94, 1.08)},
    "bedside table": {"x": (0.93, 1.08), "y": (0.93, 1.08), "z": (0.94, 1.08)},
    "office cabinet": {"y": (0.95, 1.06), "z": (0.97, 1.03)},
    "shelf": {"x": (0.95, 1.08), "y": (0.88, 1.12)},
    "refrigerator": {"z": (0.96, 1.05)},
    "oven": {},
    "stove": {},
    "kitchen counter": {},
    "wall cupboard": {},
    "sink": {"y": (0.96, 1.06)},
    "bathtub": {"y": (0.95, 1.04)},
    "radiator": {"y": (0.85, 1.15)},
    "whiteboard": {"y": (0.9, 1.1), "z": (0.95, 1.04)},
    "mirror": {"yz": (0.9, 1.1)},
    "picture": {"yz": (0.82, 1.2)},
    "curtain": {"y": (0.9, 1.1)},
    "rug": {"x": (0.9, 1.08), "y": (0.9, 1.08)},
    "coat rack": {"z": (0.96, 1.04)},
    "book": {"x": (0.9, 1.1), "y": (0.9, 1.1), "z": (0.9, 1.12)},
    "tv": {"yz": (0.9, 1.1)},
    "monitor": {"yz": (0.93, 1.07)},
    "laptop": {"xyz": (0.95, 1.05)},
    "keyboard": {"xyz": (0.96, 1.04)},
    "mouse": {"xyz": (0.95, 1.06)},
    "cell phone": {"xyz": (0.95, 1.06)},
    "microwave": {"x": (0.97, 1.04), "y": (0.96, 1.06), "z": (0.96, 1.06)},
    "toaster": {"xyz": (0.95, 1.06)},
    "person": {"xyz": (0.96, 1.04)},
    "sitting person": {"xyz": (0.97, 1.03)},
    "walking person": {"xyz": (0.96, 1.04)},
    "shoes": {"xyz": (0.88, 1.06)},
    "magnets": {},
    "paper": {},
    "charger": {"xyz": (0.96, 1.04)},
    "power strip": {},
    "desk cables": {},
    "fork": {"xyz": (0.96, 1.05)},
    "knife": {"xyz": (0.96, 1.05)},
    "spoon": {"xyz": (0.96, 1.05)},
    "floor lamp": {"xyz": (0.95, 1.05)},
    "wall clock": {"yz": (0.88, 1.15)},
    "clock": {"xyz": (0.92, 1.1)},
    "ceiling lamp": {"xy": (0.9, 1.1)},
}
_ROUND = {
    *("bottle", "cup", "bowl", "wine glass", "vase", "potted plant", "plate", "basket", "table lamp", "plant stand"),
    *("pendant lamp", "soap bottle"),
}


def varies(entry: Mapping[str, Any], folder: Path) -> dict[str, Any] | None:
    """The `varies` of a catalogue's entry (see the pack's README); None of what stays as it is."""
    kind, class_name = str(entry["kind"]), entry["class"] or ""
    if kind in _FIXED:
        return None
    document, _ = split_glb((folder / entry["file"]).read_bytes())
    rules = (*_OF_KIND.get(kind, _OF_KIND.get(class_name, ())), *_OF_CLASS.get(class_name, ()), *_ANY)
    is_lying = entry["size_m"][1] > entry["size_m"][2]
    finishes = [_palette(material, rules, is_lying) for material in document["materials"]]
    scale = _scale(kind, class_name, entry)
    if not scale and not any(finishes):
        return None
    return {"scale": {axes: list(limits) for axes, limits in scale.items()}, "finishes": finishes}


def _palette(material: Mapping[str, Any], rules: tuple[tuple[str, str], ...], is_lying: bool) -> str | None:
    name = str(material["name"])
    if name == "picture_print":
        return "prints lying" if is_lying else "prints upright"
    if "KHR_materials_transmission" in material.get("extensions", {}) or any(material.get("emissiveFactor", ())):
        return None
    found = next((palette for pattern, palette in rules if re.match(pattern, name)), "-")
    return None if found == "-" else found


def _scale(kind: str, class_name: str, entry: Mapping[str, Any]) -> Mapping[str, tuple[float, float]]:
    size_x, size_y, _ = entry["size_m"]
    if kind == "table" and size_x == size_y:
        return {"xy": (0.92, 1.08), "z": (0.985, 1.02)}
    if kind in _ROUND:
        return _SHARED["round"]
    return _SCALES.get(kind) or ({} if kind in _SCALES else _SCALES.get(class_name, _SHARED["even"]))
