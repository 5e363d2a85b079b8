"""Variations: a model in other finishes and proportions, within what is real for its kind.

A variation is a pure function of the model and a number: `chair_spindle~7` is always the same chair.
"""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from benchbot_scenes.colors import linear_color

SEPARATOR = "~"
VARIATIONS = 1000
"""Numbers of variations are 1 to one less than this; a model's plain id means the model as it is."""

OWN = "own"
"""The texture of a finish that keeps the textures of what it is put on, and multiplies their colours."""

FRONTS = "fronts"
"""The palette of the fronts of fitted units."""

Color = tuple[float, float, float]
Vector = tuple[float, float, float]

_WEAR = ((1.0, 0.0), (0.96, 0.03), (0.92, 0.06), (0.87, 0.10))
"""Levels of wear: the share of light that is still reflected, and what is added to the roughness."""


@dataclass(frozen=True)
class SurfaceFinish:
    """One finish: a colour (linear sRGB, at most 1) that multiplies a texture's, if it has one.

    `texture` is `OWN`, the name of a material in the pack's file of looks, or None for a plain colour. `window` is the
    part of the texture that is shown (left, top, right, bottom; mirrored where right is less than left).
    """

    color: Color
    texture: str | None = None
    roughness: float | None = None
    metallic: float = 0.0
    window: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Palette:
    """The finishes that some part of a model may have."""

    name: str
    finishes: tuple[SurfaceFinish, ...]


@dataclass(frozen=True)
class Varying:
    """How a model varies: `scales` are axes that scale together with the least and the most, `palettes` have an entry
    for each material of the model's file, None for one that stays as it is.
    """

    scales: tuple[tuple[str, float, float], ...] = ()
    palettes: tuple[Palette | None, ...] = ()

    def scale(self, model_id: str, number: int) -> Vector:
        """The scale of a variation along x, y and z, to three decimals."""
        factors = {"x": 1.0, "y": 1.0, "z": 1.0}
        for axes, least, most in self.scales:
            share = _drawn(f"{model_id} {axes}", number, 65) / 64
            factors |= dict.fromkeys(axes, round(least + (most - least) * share, 3))
        return factors["x"], factors["y"], factors["z"]

    def finish(self, number: int) -> tuple[SurfaceFinish | None, ...]:
        """The finish of each material of a variation.

        Successive numbers take successive finishes of every palette, each from a start of its own; palettes of lengths
        that have no common divisor give all pairs. The same palette gives the same at the same number, whatever the
        model: so the units of a fitted kitchen match.
        """
        seen: dict[str, int] = {}
        finish: list[SurfaceFinish | None] = []
        for palette in self.palettes:
            if palette is None:
                finish.append(None)
                continue
            nth = seen[palette.name] = seen.get(palette.name, -1) + 1
            count = len(palette.finishes)
            chosen = (number - 1 + _drawn(f"{palette.name} {nth}", 0, count)) % count
            finish.append(_worn(palette.finishes[chosen], _drawn("wear", number, len(_WEAR))))
        return tuple(finish)

    @property
    def is_fitted(self) -> bool:
        """Whether it is built in beside others, whose fronts are as its own."""
        return any(palette is not None and palette.name == FRONTS for palette in self.palettes)


def varying(entry: Mapping[str, Any], palettes: Mapping[str, Palette]) -> Varying:
    """Read how a model varies from its entry in a catalogue (see the pack's README)."""
    scales = tuple((axes, float(least), float(most)) for axes, (least, most) in entry.get("scale", {}).items())
    if not all(axes and set(axes) <= set("xyz") and 0 < least <= most for axes, least, most in scales):
        raise ValueError(f"a scale has axes of x, y and z, and the least and the most: {entry['scale']}")
    return Varying(scales, tuple(None if name is None else palettes[name] for name in entry.get("finishes", ())))


def read_palettes(document: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Palette]:
    """Read the palettes of a catalogue, by name: groups of textures, each in every colour and every window."""
    return {
        name: Palette(name, tuple(finish for group in groups for finish in _finishes(group)))
        for name, groups in document.items()
    }


def _finishes(group: Mapping[str, Any]) -> Iterator[SurfaceFinish]:
    """The finishes of a group; those that follow one another have different textures first, then other colours."""
    roughness = None if "roughness" not in group else float(group["roughness"])
    for window, code, texture in product(
        group.get("windows", (None,)), group["colors"], group.get("textures", (None,))
    ):
        red, green, blue = linear_color(code)
        shown = None if window is None else (float(window[0]), float(window[1]), float(window[2]), float(window[3]))
        metallic = float(group.get("metallic", 0.0))
        yield SurfaceFinish((red, green, blue), texture, roughness, metallic, shown)


def _worn(finish: SurfaceFinish, level: int) -> SurfaceFinish:
    share, rougher = _WEAR[level]
    red, green, blue = (round(channel * share, 6) for channel in finish.color)
    roughness = None if finish.roughness is None else round(min(1.0, finish.roughness + rougher), 3)
    return replace(finish, color=(red, green, blue), roughness=roughness)


def _drawn(key: str, number: int, count: int) -> int:
    """A number below `count`, always the same for the same key and number."""
    return int.from_bytes(hashlib.sha256(f"{key} {number}".encode()).digest()[:8], "big") % count
