"""Write the pack: a GLB for every item, and the catalogue of all models."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tools.household.gltf import write_glb
from tools.household.item import Item, Nodes, Surface
from tools.household.model import (
    Floats,
    Material,
    Model,
    Part,
    SceneObject,
    Texture,
    bounds,
    transformed,
    triangle_count,
)
from tools.household.palettes import PALETTES
from tools.household.shrink import shrink
from tools.household.variations import varies

LICENCE, AUTHOR = "BSD-3-Clause", "The BenchBot developers"
_ENTRY_KEYS = (
    "id",
    "file",
    "class",
    "kind",
    "placement",
    "size_m",
    "surfaces",
    "group",
    "triangles",
    "licence",
    "author",
    "source",
)


def write_models(items: Iterable[Item], folder: Path) -> list[dict[str, Any]]:
    """Write `folder`/models/ID.glb for every item; returns the catalogue's entries."""
    (folder / "models").mkdir(parents=True, exist_ok=True)
    return [_write_model(item, folder) for item in items]


def write_catalogue(own: Iterable[Mapping[str, Any]], folder: Path) -> None:
    """Write `folder`/catalogue.json: our own entries, and those of all other lists `folder`/models/*.json.

    Each entry says how its model varies, see `variations`; the palettes are listed before.
    """
    entries = [dict(entry) for entry in own]
    for path in sorted((folder / "models").glob("*.json")):
        listed = json.loads(path.read_text(encoding="utf-8"))
        entries += [{key: entry[key] for key in _ENTRY_KEYS} for entry in listed]
    entries.sort(key=lambda entry: str(entry["id"]))
    for entry in entries:
        entry.pop("varies", None)
        if (found := varies(entry, folder)) is not None:
            entry["varies"] = found
    lines = ",\n".join(f"  {json.dumps(entry)}" for entry in entries)
    palettes = ",\n".join(f"  {json.dumps(name)}: {json.dumps(groups)}" for name, groups in PALETTES.items())
    text = f'{{"name": "household", "version": 1, "palettes": {{\n{palettes}\n}}, "models": [\n{lines}\n]}}\n'
    (folder / "catalogue.json").write_text(text, encoding="utf-8")


def own_entries(folder: Path, ids: Iterable[str]) -> list[dict[str, Any]]:
    """The entries of a catalogue written before, for the models of these ids."""
    path = folder / "catalogue.json"
    wanted = set(ids)
    if not path.exists():
        return []
    return [entry for entry in json.loads(path.read_text(encoding="utf-8"))["models"] if entry["id"] in wanted]


def _write_model(item: Item, folder: Path) -> dict[str, Any]:
    made = item.make()
    nodes = grounded(made if isinstance(made, Mapping) else {item.id: made})
    objects = [
        SceneObject(name, tuple(Part(part.mesh, _reduced(part.material, item.texture_px)) for part in model))
        for name, model in nodes.items()
    ]
    path = folder / "models" / f"{item.id}.glb"
    with tempfile.TemporaryDirectory() as scratch:
        full = Path(scratch) / path.name
        write_glb(full, objects)
        path.write_bytes(shrink(full.read_bytes(), texture_px=item.texture_px))
    low, high = bounds(part for model in nodes.values() for part in model)
    size = tuple(round(float(length), 4) for length in high - low)
    surfaces = item.surfaces((size[0], size[1], size[2])) if item.surfaces else ()
    return {
        "id": item.id,
        "file": f"models/{path.name}",
        "class": item.category,
        "kind": item.kind,
        "placement": item.placement,
        "size_m": list(size),
        "surfaces": [_surface(surface) for surface in surfaces],
        "group": item.is_group,
        "triangles": sum(triangle_count(model) for model in nodes.values()),
        "licence": LICENCE,
        "author": AUTHOR,
        "source": f"tools.household {item.id}",
    }


def grounded(nodes: Nodes) -> dict[str, Model]:
    """The nodes moved together so that the origin is the middle of their common box's bottom face."""
    low, high = bounds(part for model in nodes.values() for part in model)
    shift: Floats = -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return {name: transformed(model, np.eye(3), shift) for name, model in nodes.items()}


def _surface(surface: Surface) -> dict[str, Any]:
    return {
        "z_m": round(surface.z_m, 4),
        "low_m": [round(value, 4) for value in surface.low_m],
        "high_m": [round(value, 4) for value in surface.high_m],
        "headroom_m": round(surface.headroom_m, 4),
    }


@cache
def _reduced(material: Material, texture_px: int) -> Material:
    return replace(
        material,
        base_color_texture=_smaller(material.base_color_texture, texture_px),
        metallic_roughness_texture=_smaller(material.metallic_roughness_texture, texture_px),
        normal_texture=_smaller(material.normal_texture, texture_px),
        emissive_texture=_smaller(material.emissive_texture, texture_px),
    )


@cache
def _smaller(texture: Texture | None, texture_px: int) -> Texture | None:
    """The texture with at most so many pixels a side, averaged."""
    if texture is None or max(texture.image.shape[:2]) <= texture_px:
        return texture
    rows, columns = texture.image.shape[:2]
    share = texture_px / max(rows, columns)
    size = (max(1, round(columns * share)), max(1, round(rows * share)))
    image = Image.fromarray(texture.image).resize(size, Image.Resampling.BOX)
    return replace(texture, image=np.asarray(image))
