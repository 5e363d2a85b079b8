"""`python -m tools.household.looks`: write the textures that the finishes of variations are made of.

They are materials in a GLB without meshes, drawn undyed: the palettes give them their colours.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import benchbot_assets_household
from benchbot_scenes.catalogue import LOOKS
from tools.household import textures
from tools.household.finishes import reduced
from tools.household.gltf import ObjectWriter
from tools.household.model import Material, Texture
from tools.household.palettes import JACKETS, PRINTS
from tools.household.textures.pictures import abstract, botanical, geometric, landscape
from tools.household.textures.prints import PALETTES

_MOTIFS = (
    *((landscape, 0), (abstract, 0), (geometric, 0), (botanical, 0), (geometric, 1), (abstract, 1), (geometric, 2)),
    *((landscape, 3), (geometric, 3), (botanical, 2), (geometric, 4), (abstract, 2), (geometric, 5), (geometric, 6)),
    *((geometric, 7), (geometric, 9)),
)
_UNDYED = (0.94, 0.93, 0.91)


def looks() -> Iterator[Material]:
    """Every texture; a material of no texture's own colour."""
    for species in ("oak", "walnut", "beech", "cherry", "pine"):
        yield Material(species, base_color_texture=reduced(textures.wood(species), 256))
    yield Material(
        "linen",
        base_color_texture=reduced(textures.linen(_UNDYED), 192),
        normal_texture=reduced(textures.linen_normal(), 128),
    )
    yield Material("boucle", base_color_texture=reduced(textures.boucle(_UNDYED), 128))
    yield Material("knit", base_color_texture=reduced(textures.knit_throw(_UNDYED), 128))
    yield Material("curtain", base_color_texture=reduced(textures.curtain(_UNDYED), 128))
    yield Material("stoneware", base_color_texture=reduced(textures.stoneware(), 128))
    for number, name in enumerate(JACKETS):
        palette = PALETTES[number * 3 % len(PALETTES)]
        yield Material(name, base_color_texture=reduced(textures.book_jacket(0.15, 0.22, 0.03, number, palette), 192))
    for number, name in enumerate(PRINTS):
        yield Material(name, base_color_texture=reduced(_print(number), 192))


def _print(number: int) -> Texture:
    """A square picture: shapes on a grid, cut paper, a landscape or a plant."""
    draw, seed = _MOTIFS[number % len(_MOTIFS)]
    return draw(0.5, 0.5, seed)


def write_looks(path: Path) -> None:
    """Write all of them, always the same bytes."""
    writer = ObjectWriter("benchbot-assets-household")
    for material in looks():
        writer.material(material)
    path.write_bytes(writer.to_bytes())


if __name__ == "__main__":
    target = Path(benchbot_assets_household.__file__).with_name(LOOKS)
    write_looks(target)
    sys.stderr.write(f"{target.name}: {target.stat().st_size / 1000:.0f} kB\n")
