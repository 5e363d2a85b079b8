"""A small asset pack for the tests: blocks with a mark at their front, so that their turn can be seen."""

import io
from pathlib import Path

import numpy as np
from PIL import Image

from benchbot_scenes import mesh
from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.glb_writer import GlbWriter
from benchbot_scenes.mesh import FLOOR, Mesh

Vector = tuple[float, float, float]
NOSE_M = 0.02


def block(low: Vector, high: Vector) -> Mesh:
    return mesh.block(FLOOR, low, high)


def facing_x(size: Vector) -> Mesh:
    """A body with a nose in the middle of its face to +x, which its size includes."""
    x, y, z = size
    body = block((-x / 2, -y / 2, 0), (x / 2 - NOSE_M, y / 2, z))
    return mesh.merge([body, block((x / 2 - NOSE_M, -0.01, 0), (x / 2, 0.01, 0.01))])


def write(path: Path, nodes: dict[str, Mesh], color: tuple[float, float, float] = (0.5, 0.5, 0.5)) -> Path:
    """A model's file, every node with the same textured material."""
    writer = GlbWriter()
    material = writer.material(textured(writer, color))
    for name, shape in nodes.items():
        writer.node(name, writer.mesh([(shape, material)]), {})
    path.write_bytes(writer.to_bytes())
    return path


def textured(writer: GlbWriter, color: tuple[float, float, float], name: str = "cloth") -> dict[str, object]:
    """A material with a picture of 2 × 2 pixels, the same in all models."""
    stream = io.BytesIO()
    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)).save(
        stream, "PNG"
    )
    image = writer.append("images", {"mimeType": "image/png", "bufferView": writer.view(stream.getvalue(), {})})
    texture = writer.append("textures", {"source": image})
    surface = {"baseColorFactor": [*color, 1.0], "baseColorTexture": {"index": texture}, "metallicFactor": 0.0}
    return {"name": name, "pbrMetallicRoughness": surface}


def model(
    path: Path, size: Vector, class_name: str | None = None, kind: str = "", placement: str = "floor"
) -> AssetModel:
    return AssetModel(
        path.stem, path, class_name, kind or path.stem, placement, size, (), False, 24, "CC0-1.0", "nobody", "test"
    )


def pack(folder: Path, name: str = "blocks") -> Catalogue:
    """A chair, a table, a picture, a door with a leaf, and a window."""
    folder.mkdir(parents=True, exist_ok=True)
    frame = mesh.merge([block((-0.05, -0.45, 0), (0.05, -0.42, 2.0)), block((-0.05, 0.42, 0), (0.05, 0.45, 2.0))])
    leaf = mesh.merge([block((-0.02, -0.42, 0), (0.02, 0.42, 1.97)), block((-0.05, 0.3, 1.0), (0.05, 0.4, 1.02))])
    models = [
        model(write(folder / "chair.glb", {"chair": facing_x((0.5, 0.4, 0.9))}), (0.5, 0.4, 0.9), "chair"),
        model(
            write(folder / "table.glb", {"table": facing_x((0.8, 1.6, 0.7))}, (0.2, 0.1, 0)), (0.8, 1.6, 0.7), "table"
        ),
        model(
            write(folder / "picture.glb", {"picture": facing_x((0.04, 0.6, 0.4))}), (0.04, 0.6, 0.4), placement="wall"
        ),
        model(
            write(folder / "door.glb", {"frame": frame, "leaf": leaf}),
            (0.1, 0.9, 2.0),
            None,
            "interior door",
            "opening",
        ),
        model(
            write(folder / "window.glb", {"window": facing_x((0.08, 1.2, 1.3))}),
            (0.08, 1.2, 1.3),
            kind="window",
            placement="opening",
        ),
    ]
    return Catalogue(name, {entry.id: entry for entry in models}, finishes(folder / "finishes.glb"))


def finishes(path: Path) -> Path:
    """Boards whose picture covers 2 × 0.5 m."""
    writer = GlbWriter()
    writer.material({**textured(writer, (1.0, 1.0, 1.0), "boards"), "extras": {"benchbot": {"tile_m": [2.0, 0.5]}}})
    path.write_bytes(writer.to_bytes())
    return path
