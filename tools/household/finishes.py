"""`python -m tools.household.finishes`: write the finishes of floors, walls and ceilings.

They are materials in a GLB without meshes; each one's extras say how many metres its textures cover.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

import benchbot_assets_household
from tools.household import textures
from tools.household.gltf import ObjectWriter
from tools.household.model import Color, Material, Texture
from tools.household.textures import coverings
from tools.household.textures.noise import hex_color, linear_color

FILE_NAME = "finishes.glb"


def finishes() -> Iterator[Material]:
    """Every finish; those of one family share their textures and differ in their colour factor."""
    boards, joints = reduced(textures.oak_planks(), 768), reduced(textures.oak_planks_normal(), 512)
    for name, tint in {
        "oak": (0.86, 0.90, 0.98),
        "oak_dark": (0.42, 0.37, 0.35),
        "walnut": (0.50, 0.40, 0.36),
        "pine": (1.0, 0.94, 0.80),
    }.items():
        yield Material(name, tint, boards, roughness=0.42, normal_texture=joints)
    tiles, tile_joints = coverings.floor_tiles(), coverings.floor_tiles_normal()
    for name, code in {"tiles_white": "#f4f2ec", "tiles_grey": "#a9abaa", "tiles_terracotta": "#d09a7b"}.items():
        yield Material(name, linear_color(code), tiles, roughness=0.28, normal_texture=tile_joints)
    pile, loops = coverings.carpet(), coverings.carpet_normal()
    for name, code in {"carpet_beige": "#cfc3ae", "carpet_grey": "#a6a8aa", "carpet_blue": "#8398ad"}.items():
        yield Material(name, linear_color(code), pile, roughness=1.0, normal_texture=loops)
    yield Material("linoleum", base_color_texture=coverings.linoleum(), roughness=0.36)
    yield Material("concrete", base_color_texture=coverings.concrete(), roughness=0.75)
    glaze, glaze_joints = textures.tiles(), textures.tiles_normal()
    glazes: dict[str, Color] = {"wall_tiles_white": (1.0, 1.0, 1.0), "wall_tiles_green": linear_color("#d5e4da")}
    for name, tint in glazes.items():
        yield Material(name, tint, glaze, roughness=0.16, normal_texture=glaze_joints)
    stripes = coverings.wallpaper_stripes(hex_color("#ece4d2"), hex_color("#d5c8ae"))
    yield Material("wallpaper_stripes", base_color_texture=stripes, roughness=0.9)
    leaves = coverings.wallpaper_leaves(hex_color("#e6e3d6"), hex_color("#9fae97"))
    yield Material("wallpaper_leaves", base_color_texture=leaves, roughness=0.9)
    yield Material(
        "brick",
        base_color_texture=coverings.brick(),
        roughness=0.9,
        normal_texture=reduced(coverings.brick_normal(), 256),
    )
    yield Material("ceiling_panels", base_color_texture=coverings.ceiling_panels(), roughness=0.95)
    yield Material("paint", base_color_texture=textures.plaster((0.985, 0.985, 0.985)), roughness=0.92)
    yield Material("facade", linear_color("#d9d2c3"), textures.plaster((0.985, 0.985, 0.985)), roughness=0.95)
    yield Material("trim", linear_color("#efece5"), roughness=0.38)


def write_finishes(path: Path) -> None:
    """Write all of them, always the same bytes."""
    writer = ObjectWriter("benchbot-assets-household")
    for material in finishes():
        texture = material.base_color_texture
        size = [1.0, 1.0] if texture is None else [texture.width_m, texture.height_m]
        writer.material(material, {"benchbot": {"tile_m": size}})
    path.write_bytes(writer.to_bytes())


def reduced(texture: Texture, size_px: int) -> Texture:
    """The texture with so many pixels a side; it still repeats without a seam."""
    image = Image.fromarray(texture.image)
    size = (size_px, round(size_px * texture.image.shape[0] / texture.image.shape[1]))
    return Texture(np.asarray(image.resize(size, Image.Resampling.BOX)), texture.width_m, texture.height_m)


if __name__ == "__main__":
    target = Path(benchbot_assets_household.__file__).with_name(FILE_NAME)
    write_finishes(target)
    sys.stderr.write(f"{target.name}: {target.stat().st_size / 1000:.0f} kB\n")
