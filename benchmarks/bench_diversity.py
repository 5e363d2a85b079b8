"""How many models the generator has, with their variations, and how many are in a place.

python -m benchmarks diversity [--places 12] [--first 9000] [--json FILE]

Two variations of a model are distinct when a material that covers at least a twentieth of its surface differs by 5 or
more in CIELAB (1976, D65; the mean of its texture times its colour), or when a side of its box differs by 4 % or more.
Counted are those that are distinct from all counted before, the model as it is being the first; and those that are so
by colour alone. Of places the models of their objects are counted, and how many objects are the only ones of theirs:
what belongs together, as chairs about a table, is alike.
"""

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.catalogue import AssetModel, pack
from benchbot_scenes.generator.generate import generate
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.gltf_file import GltfFile, split_glb
from benchbot_scenes.gltf_materials import material
from benchbot_scenes.scene import ImageArray, Material, SceneGeometry
from benchbot_scenes.variations import OWN, VARIATIONS, SurfaceFinish
from benchbot_scenes.vertex_colors import srgb_to_linear
from benchmarks.bench_soundness import kind_and_rooms

Floats = npt.NDArray[np.float64]

LEAST_SHARE, LEAST_LAB, LEAST_SCALE = 0.05, 5.0, 1.04
"""What makes two variations distinct: of a material so much of the surface, a distance of colours, a ratio of sides."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--places", type=int, default=12)
    parser.add_argument("--first", type=int, default=9000)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    catalogue = pack("household")
    numbers = range(1, VARIATIONS)
    found = {
        model.id: (distinct(model, numbers), distinct(model, numbers, by_scale=False)) for model in varying_models()
    }
    fixed = len(catalogue.models) - len(found)
    print(f"models in files: {len(catalogue.models)}, of which {len(found)} vary")
    for title, index in (("distinct by colour or proportions", 0), ("distinct by colour alone", 1)):
        print(f"{title}: {fixed + sum(one[index] for one in found.values())}")
    for title, kinds in (("pictures", {"picture"}), ("books", {"book", "book row"}), ("chairs", {"chair"})):
        among = [name for name in found if catalogue.models[name].kind in kinds]
        print(f"  {title}: {sum(found[name][1] for name in among)} by colour alone, of {len(among)} files")
    places = [_of_place(seed) for seed in range(options.first, options.first + options.places)]
    for title, values in zip(
        ("objects", "models", "files", "placed alone, of 100"), zip(*places, strict=True), strict=True
    ):
        print(f"{title} in a place: mean {np.mean(values):.1f}, {min(values):.0f} to {max(values):.0f}")
    if options.json:
        options.json.write_text(json.dumps({"distinct": found, "places": places}))


def varying_models() -> list[AssetModel]:
    return [model for model in pack("household").models.values() if model.varies is not None]


def _of_place(seed: int) -> tuple[float, ...]:
    """The numbers of objects, of models with their variations, of files, and how many of 100 objects are unique."""
    made = generate(seed, *kind_and_rooms(seed), pack("household"))
    counted = Counter(item.model.id for item in made.items)
    alone = sum(count == 1 for count in counted.values())
    files = len({item.model.file for item in made.items})
    return len(made.items), len(counted), files, 100 * alone / len(made.items)


def distinct(model: AssetModel, numbers: Sequence[int], *, by_scale: bool = True) -> int:
    """The number of distinct variations of a model among `numbers`, the model as it is being one."""
    seen: list[tuple[Floats, Floats]] = []
    for number in (0, *numbers):
        variation = model.variation(number)
        look = _colors(variation), np.array(variation.scale) if by_scale else np.ones(3)
        if not any(_alike(*look, *other) for other in seen):
            seen.append(look)
    return len(seen)


def _alike(lab: Floats, sides: Floats, other_lab: Floats, other_sides: Floats) -> bool:
    ratio = np.maximum(sides / other_sides, other_sides / sides).max()
    return bool(ratio < LEAST_SCALE and np.linalg.norm(lab - other_lab, axis=1).max(initial=0.0) < LEAST_LAB)


def _colors(model: AssetModel) -> Floats:
    """The CIELAB colours (N, 3) of the materials that cover enough of a model's surface."""
    own, shares = _file(model.file)
    # The last material is that of parts without one.
    finishes = (*model.finish, None) if model.finish else (None,) * len(own)
    colors = [
        _color(one, finish, model.looks)
        for one, finish, share in zip(own, finishes, shares, strict=True)
        if share >= LEAST_SHARE
    ]
    return lab(np.array(colors).reshape(-1, 3))


def _color(own: Floats, finish: SurfaceFinish | None, looks: Path | None) -> Floats:
    if finish is None:
        return own
    if finish.texture == OWN:
        return own * finish.color
    if finish.texture is None or looks is None:
        return np.array(finish.color)
    return _mean(looks, finish.texture, finish.window) * finish.color


@cache
def _file(path: Path) -> tuple[list[Floats], Floats]:
    """The mean colour of each material of a model's file, and its share of the surface."""
    scene = load_scene(path)
    corners = scene.vertices[scene.triangles].astype(np.float64)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    shares = np.bincount(scene.triangle_material, areas, len(scene.materials)) / areas.sum()
    return [_mean_of(scene, one) for one in scene.materials], shares


def _mean_of(scene: SceneGeometry, one: Material) -> Floats:
    image = None if one.base_color_image is None else scene.images[one.base_color_image]
    return np.array(one.base_color) * (1.0 if image is None else _mean_color(image))


@cache
def _mean(path: Path, name: str, window: tuple[float, float, float, float] | None) -> Floats:
    """The mean colour of a material of a file of looks, or of a window of its texture."""
    document, binary = split_glb(path.read_bytes())
    entry = next(entry for entry in document["materials"] if entry["name"] == name)
    number = material(document, entry).base_color_image
    if number is None:
        return np.ones(3)
    image = GltfFile(document, binary).image(document["images"][number])
    left, top, right, bottom = window or (0.0, 0.0, 1.0, 1.0)
    rows, columns = image.shape[:2]
    across = sorted((round(left * columns), round(right * columns)))
    down = sorted((round(top * rows), round(bottom * rows)))
    return _mean_color(image[down[0] : down[1], across[0] : across[1]])


def _mean_color(image: ImageArray) -> Floats:
    linear: Floats = srgb_to_linear(image[..., :3].astype(np.float64) / 255.0).reshape(-1, 3).mean(axis=0)
    return linear


def lab(linear: Floats) -> Floats:
    """CIELAB (N, 3) of linear sRGB, under D65 (IEC 61966-2-1, CIE 15)."""
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    shares = linear @ matrix.T / [0.9505, 1.0, 1.089]
    root = np.where(shares > (6 / 29) ** 3, np.cbrt(shares), shares / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = root.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


if __name__ == "__main__":
    main()
