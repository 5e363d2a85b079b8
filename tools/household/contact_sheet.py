"""`python -m tools.household.contact_sheet FOLDER | PICTURE.jpg ID …`: pictures of all models.

Each model is scaled to one size and stands in the sun on a pale floor before a wall; `chair_spindle~7` is one in a
variation. Needs benchbot-sim-taichi.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import benchbot_assets_household
from benchbot_scenes.catalogue import AssetModel, load_catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import geometry_of
from benchbot_scenes.gltf_file import GltfFile, split_glb
from benchbot_scenes.layout import Layout, Placement
from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import REALTIME
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

_PACK = "household"
_CELL_M, _MODEL_M = 1.9, 1.0
_IN_STUDIO = 12
_CAPTION_PX = 16
_PLACES = {"floor": ("floor",), "surface": ("surface",), "wall": ("wall", "ceiling", "opening")}
_LIGHTING = {
    "sun": {"azimuth_deg": 70.0, "elevation_deg": 50.0, "irradiance": [3.2, 3.0, 2.7]},
    "sky": {"zenith": [0.9, 1.0, 1.15], "horizon": [1.0, 1.03, 1.1], "ground": [0.4, 0.4, 0.4]},
    "exposure": 0.62,
}


def contact_sheet(models: Sequence[AssetModel], columns: int, tile_px: tuple[int, int] = (160, 140)) -> Image.Image:
    """One picture with a tile for each model, seen from ahead, left and above."""
    rows = -(-len(models) // columns)
    sheet = Image.new("RGB", (columns * tile_px[0], rows * (tile_px[1] + _CAPTION_PX)), "#f4f2ee")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    pictures = chain.from_iterable(
        _pictures(models[k : k + _IN_STUDIO], tile_px) for k in range(0, len(models), _IN_STUDIO)
    )
    for index, (model, picture) in enumerate(zip(models, pictures, strict=True)):
        corner = (index % columns * tile_px[0], index // columns * (tile_px[1] + _CAPTION_PX))
        sheet.paste(picture, corner)
        draw.text((corner[0] + 3, corner[1] + tile_px[1] + 1), _caption(model, tile_px[0]), fill="#333333", font=font)
    return sheet


def _pictures(models: Sequence[AssetModel], tile_px: tuple[int, int]) -> list[Image.Image]:
    """A picture of each model; all stand in one studio, side by side."""
    studio = _floor(len(models))
    for index, model in enumerate(models):
        studio = _joined(studio, _at(_scene(model), _CELL_M * index, model))
    renderer = Renderer(studio, Lighting.from_mapping(_LIGHTING), quality=REALTIME)
    camera = Intrinsics.from_horizontal_fov(*tile_px, hfov_deg=34.0)
    views = [_camera(_CELL_M * index, model) for index, model in enumerate(models)]
    return [Image.fromarray(renderer.render(view, camera).rgb) for view in views]


def _scene(model: AssetModel) -> SceneGeometry:
    """A model alone, as a layout shows it."""
    alone = Layout(_PACK, None, objects=(Placement(model.id, model.id, (0.0, 0.0, 0.0)),))
    return geometry_of(GltfFile(*split_glb(compose(alone))))[0]


def _caption(model: AssetModel, width_px: int) -> str:
    """The model's name, and its size in metres where there is room."""
    size = " x ".join(f"{length:.2f}" for length in model.size_m)
    return f"{model.id}  {size}" if width_px >= 220 else model.id


def _scale(model: AssetModel) -> float:
    return (
        _MODEL_M / float(np.linalg.norm(model.size_m)) * (1.15 if max(model.size_m) < 0.8 * sum(model.size_m) else 1.0)
    )


def _at(scene: SceneGeometry, y: float, model: AssetModel) -> SceneGeometry:
    moved = scene.vertices * _scale(model) + np.array([0.0, y, 0.0])
    return replace(scene, vertices=moved.astype(np.float32))


def _camera(y: float, model: AssetModel) -> NDArray[np.float64]:
    """A pose 2.1 m away, ahead (+x) and to the side, that looks at the model's middle."""
    target = np.array([0.0, y, model.size_m[2] * _scale(model) / 2])
    azimuth, elevation = np.radians(-32.0), np.radians(24.0)
    away = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    forward, pose = -away, np.eye(4)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = target + 2.35 * away
    return pose


def _floor(count: int) -> SceneGeometry:
    """A pale floor under all cells, with a wall behind."""
    low, high, back, front, top = -_CELL_M * 1.5, _CELL_M * (count + 0.5), -1.3, 2.0, 2.4
    corners = np.array(
        [
            *([back, low, 0], [front, low, 0], [front, high, 0], [back, high, 0]),
            *([back, low, 0], [back, high, 0], [back, high, top], [back, low, top]),
        ]
    )
    normals = np.repeat([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], 4, axis=0)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return SceneGeometry(
        corners.astype(np.float32),
        triangles.astype(np.int32),
        np.zeros(4, np.int32),
        np.zeros(4, np.int32),
        normals.astype(np.float32),
        np.zeros((8, 2), np.float32),
        (Material("studio", (0.62, 0.61, 0.59), roughness=0.9),),
        (),
    )


def _joined(first: SceneGeometry, second: SceneGeometry) -> SceneGeometry:
    images = len(first.images)

    def shifted(index: int | None) -> int | None:
        return None if index is None else index + images

    materials = tuple(
        replace(
            material,
            base_color_image=shifted(material.base_color_image),
            metallic_roughness_image=shifted(material.metallic_roughness_image),
            normal_image=shifted(material.normal_image),
            emission_image=shifted(material.emission_image),
        )
        for material in second.materials
    )
    taken = max((known.index for known in first.instances), default=0)
    return SceneGeometry(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.triangles, second.triangles + np.int32(len(first.vertices))]),
        np.concatenate([first.triangle_instance, second.triangle_instance + np.int32(taken)]),
        np.concatenate([first.triangle_material, second.triangle_material + np.int32(len(first.materials))]),
        np.concatenate([first.normals, second.normals]),
        np.concatenate([first.uvs, second.uvs]),
        (*first.materials, *materials),
        (*first.instances, *(replace(known, index=known.index + taken) for known in second.instances)),
        (*first.images, *second.images),
    )


def main() -> int:
    """Write a sheet of the named models, or a sheet for each place that models are put into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("output", type=Path, help="a picture, or the folder for assets-PLACE.jpg")
    parser.add_argument("id", nargs="*")
    parser.add_argument("--columns", type=int, default=10)
    parser.add_argument("--tile-px", type=int, nargs=2, default=(160, 140), metavar=("WIDTH", "HEIGHT"))
    arguments = parser.parse_args()
    catalogue = load_catalogue(Path(benchbot_assets_household.__file__).with_name("catalogue.json"))
    sheets = {arguments.output: [catalogue.model(name) for name in arguments.id]}
    if not arguments.id:
        by_class = sorted(catalogue.models.values(), key=lambda model: (model.class_name or "~", model.kind, model.id))
        sheets = {
            arguments.output / f"assets-{place}.jpg": [model for model in by_class if model.placement in placements]
            for place, placements in _PLACES.items()
        }
    for path, models in sheets.items():
        contact_sheet(models, arguments.columns, tuple(arguments.tile_px)).save(
            path, quality=64, optimize=True, progressive=True
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
