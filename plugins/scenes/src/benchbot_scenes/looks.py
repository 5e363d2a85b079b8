"""Looks: the materials of a model's variations, in a file being written."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError
from benchbot_scenes.glb_writer import Entry, GlbWriter, Inclusion
from benchbot_scenes.gltf_file import BROKEN, UnsupportedError, split_glb
from benchbot_scenes.variations import OWN, SurfaceFinish

_TEXTURES = ("baseColorTexture", "metallicRoughnessTexture")
_TRANSFORM = "KHR_texture_transform"


class Looks:
    """The textures of a pack's file of looks, as finishes ask for them; each is taken over once."""

    def __init__(self, writer: GlbWriter, path: Path) -> None:
        self._writer = writer
        self._path = path
        self._inclusion: Inclusion | None = None
        self._indices: dict[str, int] = {}

    def finished(self, entry: Entry, finish: SurfaceFinish, take: Callable[[Entry], Entry]) -> Entry:
        """A material of a model's file with another finish; `take` takes over the textures that it refers to.

        Raises BenchbotError when the file of looks has no such texture, or cannot be read.
        """
        if finish.texture == OWN:
            made = take(entry)
        else:
            made = take(_plain(entry))
            if finish.texture is not None:
                made = _textured(made, self._material(finish.texture))
        surface: dict[str, Any] = dict(made.get("pbrMetallicRoughness", {}))
        before = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        factors = before[:3] if finish.texture == OWN else (1.0, 1.0, 1.0)
        color = [round(one * other, 6) for one, other in zip(factors, finish.color, strict=True)]
        surface["baseColorFactor"] = [*color, before[3]]
        if finish.texture != OWN:
            surface["metallicFactor"] = finish.metallic
        if finish.roughness is not None:
            surface["roughnessFactor"] = finish.roughness
        if finish.window is not None and "baseColorTexture" in surface:
            left, top, right, bottom = finish.window
            shown = {"offset": [left, top], "scale": [round(right - left, 6), round(bottom - top, 6)]}
            surface["baseColorTexture"] = {**surface["baseColorTexture"], "extensions": {_TRANSFORM: shown}}
            self._writer.use(_TRANSFORM)
        return {**made, "pbrMetallicRoughness": surface}

    def _material(self, name: str) -> Entry:
        try:
            if self._inclusion is None:
                document, binary = split_glb(self._path.read_bytes())
                self._indices = {entry["name"]: number for number, entry in enumerate(document["materials"])}
                self._inclusion = self._writer.inclusion(document, binary)
            return self._inclusion.material(self._indices[name])
        except (*BROKEN, UnsupportedError) as error:
            raise BenchbotError(
                f"The looks of an asset pack cannot be read: {self._path}",
                f"{type(error).__name__}: {error}",
                "Install the asset pack again.",
            ) from error


def _plain(entry: Entry) -> Entry:
    """A material without textures."""
    surface = {key: value for key, value in entry.get("pbrMetallicRoughness", {}).items() if key not in _TEXTURES}
    return {**{key: value for key, value in entry.items() if key != "normalTexture"}, "pbrMetallicRoughness": surface}


def _textured(entry: Entry, other: Entry) -> Entry:
    """A material with the colours and normals of another's textures."""
    surface = {**entry["pbrMetallicRoughness"], "baseColorTexture": other["pbrMetallicRoughness"]["baseColorTexture"]}
    normals = {"normalTexture": other["normalTexture"]} if "normalTexture" in other else {}
    return {**entry, **normals, "pbrMetallicRoughness": surface}
