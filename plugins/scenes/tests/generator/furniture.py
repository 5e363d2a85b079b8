"""A pack of models without files, with the sizes of real furniture: enough to generate with."""

from pathlib import Path

from benchbot_scenes.catalogue import AssetModel, Catalogue, Surface

Size = tuple[float, float, float]


def model(
    name: str, size: Size, kind: str, class_name: str | None = None, placement: str = "floor", has_top: bool = False
) -> AssetModel:
    half = (size[0] / 2 - 0.03, size[1] / 2 - 0.03)
    top = Surface(size[2], (-half[0], -half[1]), half, 1.2)
    surfaces = (top,) if has_top else ()
    return AssetModel(
        name, Path(f"{name}.glb"), class_name, kind, placement, size, surfaces, False, 12, "CC0-1.0", "nobody", "test"
    )


def pack() -> Catalogue:
    models = [
        model("bed", (2.1, 1.6, 0.9), "bed", "bed"),
        model("bedside", (0.38, 0.45, 0.5), "bedside table", has_top=True),
        model("wardrobe", (0.6, 1.2, 2.0), "wardrobe"),
        model("sideboard", (0.45, 1.4, 0.65), "sideboard", has_top=True),
        model("couch", (0.9, 1.9, 0.8), "couch", "couch", has_top=True),
        model("coffee_table", (0.6, 1.1, 0.42), "coffee table", "table", has_top=True),
        model("table", (0.9, 1.6, 0.75), "table", "table", has_top=True),
        model("chair", (0.5, 0.45, 0.85), "chair", "chair"),
        model("desk", (0.75, 1.4, 0.74), "desk", "table", has_top=True),
        model("cabinet", (0.5, 0.9, 0.8), "office cabinet", has_top=True),
        model("counter", (0.63, 0.6, 0.9), "kitchen counter", has_top=True),
        model("stove", (0.65, 0.6, 0.9), "stove", "oven"),
        model("fridge", (0.7, 0.6, 1.8), "refrigerator", "refrigerator"),
        model("kitchen_sink", (0.63, 0.8, 1.18), "sink", "sink"),
        model("basin", (0.46, 0.6, 1.03), "sink", "sink"),
        model("toilet", (0.66, 0.39, 0.8), "toilet", "toilet"),
        model("bathtub", (0.75, 1.7, 0.6), "bathtub"),
        model("fern", (0.4, 0.4, 1.1), "potted plant", "potted plant"),
        model("person", (0.4, 0.55, 1.7), "person", "person"),
        model("lamp", (0.4, 0.4, 0.3), "pendant lamp", placement="ceiling"),
        model("picture", (0.02, 0.5, 0.7), "picture", placement="wall"),
        model("curtain", (0.08, 0.6, 2.26), "curtain", placement="wall"),
        model("whiteboard_on_wall", (0.075, 1.5, 1.0), "whiteboard", placement="wall"),
        model("whiteboard_on_wheels", (0.54, 1.4, 1.8), "whiteboard"),
        model("radiator", (0.1, 1.0, 0.63), "radiator", placement="wall"),
    ]
    small: dict[str, Size] = {
        "tv": (0.2, 0.9, 0.6),
        "laptop": (0.3, 0.33, 0.22),
        "keyboard": (0.13, 0.4, 0.02),
        "mouse": (0.1, 0.06, 0.04),
        "cup": (0.1, 0.1, 0.09),
        "book": (0.16, 0.23, 0.03),
        "bottle": (0.08, 0.08, 0.25),
        "bowl": (0.19, 0.19, 0.08),
        "fork": (0.19, 0.03, 0.02),
        "knife": (0.2, 0.02, 0.01),
        "apple": (0.08, 0.08, 0.08),
        "clock": (0.12, 0.13, 0.18),
        "microwave": (0.4, 0.5, 0.3),
        "toaster": (0.2, 0.3, 0.2),
    }
    models += [model(name, size, name, name, "surface") for name, size in small.items()]
    return Catalogue("test", {found.id: found for found in models})
