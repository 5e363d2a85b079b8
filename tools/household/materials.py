"""The materials of the rooms: a warm palette of oiled oak, chalky paint, linen, wool and blackened steel."""

from __future__ import annotations

from functools import cache

from tools.household import textures
from tools.household.model import Color, Material, Texture


@cache
def wood(species: str = "oak", seed: int = 0, tint: Color = (1.0, 1.0, 1.0)) -> Material:
    """Oiled furniture wood, grain along u, stained by a linear colour factor."""
    return Material(f"{species} {seed}", tint, textures.wood(species, seed), roughness=0.48)


@cache
def oak_floor() -> Material:
    """Whitewashed oak boards along u."""
    return Material(
        "oak floor",
        base_color=(0.86, 0.90, 0.98),
        base_color_texture=textures.oak_planks(),
        normal_texture=textures.oak_planks_normal(),
        roughness=0.42,
    )


@cache
def wall_paint(name: str, code: str) -> Material:
    """Matt emulsion on plaster, of the sRGB colour `code`."""
    color = textures.hex_color(code)
    return Material(name, base_color_texture=textures.plaster(color), roughness=0.92)


@cache
def paint(code: str, roughness: float = 0.4) -> Material:
    """Plain lacquer or painted wood, of the sRGB colour `code`."""
    return Material(f"paint {code}", base_color=textures.linear_color(code), roughness=roughness)


@cache
def linen(name: str, code: str) -> Material:
    """Woven linen of the sRGB colour `code`; all share one undyed weave."""
    undyed = textures.linear_color(_UNDYED)
    dye = textures.linear_color(code)
    return Material(
        name,
        base_color=(dye[0] / undyed[0], dye[1] / undyed[1], dye[2] / undyed[2]),
        base_color_texture=_linen_weave(),
        normal_texture=_linen_threads(),
        roughness=0.9,
    )


_UNDYED = "#efede8"


@cache
def _linen_weave() -> Texture:
    return textures.linen(textures.hex_color(_UNDYED))


@cache
def _linen_threads() -> Texture:
    return textures.linen_normal()


@cache
def striped_linen() -> Material:
    """Linen with woven stripes."""
    return Material("striped linen", base_color_texture=textures.striped_linen(), roughness=0.9)


@cache
def knit(name: str, code: str) -> Material:
    """A knitted throw of the sRGB colour `code`."""
    return Material(name, base_color_texture=textures.knit_throw(textures.hex_color(code)), roughness=0.95)


@cache
def curtain_cloth() -> Material:
    """Loosely woven curtain cloth."""
    return Material("curtain", base_color_texture=textures.curtain(), roughness=0.95, double_sided=True)


@cache
def rug(width_m: float, height_m: float) -> Material:
    """A flat-woven rug that covers width x height once."""
    return Material(
        "rug",
        base_color_texture=textures.rug(width_m, height_m),
        normal_texture=textures.rug_normal(width_m, height_m),
        roughness=0.97,
    )


@cache
def tiles() -> Material:
    """Glazed wall tiles."""
    return Material(
        "tiles",
        base_color_texture=textures.tiles(),
        normal_texture=textures.tiles_normal(),
        roughness=0.16,
    )


@cache
def worktop() -> Material:
    """Engineered stone."""
    return Material("worktop", base_color_texture=textures.quartz_worktop(), roughness=0.28)


@cache
def ceramic() -> Material:
    """White glazed ceramic."""
    return Material("ceramic", base_color_texture=textures.ceramic(), roughness=0.12)


@cache
def brushed_steel() -> Material:
    """Brushed stainless steel, lines along u."""
    return Material(
        "brushed steel",
        base_color_texture=textures.brushed_metal(),
        metallic_roughness_texture=textures.brushed_metal_roughness(),
        roughness=1.0,
        metallic=1.0,
    )


@cache
def chrome() -> Material:
    """Polished chrome."""
    return Material("chrome", base_color=(0.78, 0.79, 0.80), roughness=0.08, metallic=1.0)


@cache
def brass() -> Material:
    """Brushed brass."""
    return Material("brass", base_color=(0.76, 0.56, 0.27), roughness=0.3, metallic=1.0)


@cache
def black_steel() -> Material:
    """Powder-coated steel."""
    return Material("black steel", base_color=(0.025, 0.025, 0.027), roughness=0.45)


@cache
def window_glass() -> Material:
    """A thin clear pane."""
    return Material("window glass", roughness=0.0, transmission=1.0, double_sided=True)


@cache
def glowing(name: str, color: Color, radiance: float) -> Material:
    """A lamp's shade: it emits `color` times `radiance`, in the unit of the environment's lighting."""
    return Material(name, base_color=(0.85, 0.82, 0.76), roughness=0.9, emissive=color, emissive_strength=radiance)
