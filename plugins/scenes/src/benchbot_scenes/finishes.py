"""Finishes: what the floors, walls and ceilings of a building are made of."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_scenes.colors import linear_color
from benchbot_scenes.glb_writer import GlbWriter
from benchbot_scenes.gltf_file import BROKEN, UnsupportedError, split_glb
from benchbot_scenes.mesh import Mesh

TRIM, FACADE, PAINT = "trim", "facade", "paint"
"""Finishes that a building uses besides those that its rooms name; paints are `paint` in another colour."""

_PLAIN = {TRIM: ("#efece5", 0.4), FACADE: ("#d6d0c4", 0.95), PAINT: ("#ffffff", 0.9)}
_COLOR = re.compile(r"#[0-9a-fA-F]{6}")


@dataclass(frozen=True)
class Finish:
    """A material of the file being written, and the metres that its textures cover."""

    material: int
    tile_m: tuple[float, float]

    def on(self, mesh: Mesh) -> tuple[Mesh, int]:
        """The mesh as `GlbWriter.mesh` takes it: with texture coordinates of this finish."""
        scale = [1.0 / self.tile_m[0], -1.0 / self.tile_m[1]]
        return replace(mesh, uvs=mesh.uvs * scale), self.material


class Finishes:
    """The finishes of a pack, as they are asked for, in a file being written.

    `path` is a GLB file of materials whose extras say how many metres their textures cover:
    `{"benchbot": {"tile_m": [width, height]}}`.
    """

    def __init__(self, writer: GlbWriter, path: Path | None) -> None:
        self._writer = writer
        self._document: dict[str, Any] = {}
        self._binary = b""
        if path is not None:
            try:
                self._document, self._binary = split_glb(path.read_bytes())
            except BROKEN as error:
                raise _unusable(path, error) from error
        self._path = path
        self._indices = {entry.get("name", ""): i for i, entry in enumerate(self._document.get("materials", []))}

    def finish(self, name: str) -> Finish:
        """A finish by name, or a paint by its colour; raises BenchbotError when there is none of that name."""
        if _COLOR.fullmatch(name):
            return self._finish(PAINT, {"baseColorFactor": [*linear_color(name), 1.0]})
        if name not in self._indices and name not in _PLAIN:
            names = sorted(self._indices)
            raise BenchbotError(
                f"There is no finish '{name}'.",
                f"The pack has: {', '.join(names) or 'none'}.{did_you_mean(name, names)}",
                'Name one of these, or give a paint by its colour, such as "#f2efe8".',
            )
        return self._finish(name, {})

    def _finish(self, name: str, surface: Mapping[str, Any]) -> Finish:
        if name not in self._indices:
            color, roughness = _PLAIN[name]
            plain = {
                "baseColorFactor": [*linear_color(color), 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": roughness,
            }
            return Finish(
                self._writer.material({"name": name, "pbrMetallicRoughness": {**plain, **surface}}), (1.0, 1.0)
            )
        try:
            entry = self._writer.included_material(self._document, self._binary, self._indices[name])
            width, height = entry.pop("extras")["benchbot"]["tile_m"]
            entry["pbrMetallicRoughness"] = {**entry["pbrMetallicRoughness"], **surface}
            return Finish(self._writer.material(entry), (float(width), float(height)))
        except (*BROKEN, UnsupportedError) as error:
            raise _unusable(self._path, error) from error


def _unusable(path: Path | None, error: Exception) -> BenchbotError:
    return BenchbotError(
        f"The finishes of an asset pack cannot be read: {path}",
        f"{type(error).__name__}: {error}",
        "Install the asset pack again.",
    )
