"""Make one model with infinigen and bake its surfaces; runs in the Python that has `bpy` and `infinigen`.

python -m plugins.assets_household.bake.bake_model JOB.json OUTPUT.npz

The job names the factory and seed, the number of triangles and the texture size (see infinigen_models.py).
"""

import importlib
import json
import logging
import sys
from pathlib import Path
from typing import Any

import bpy  # type: ignore[import-not-found]
import numpy as np
from infinigen.core import init  # type: ignore[import-not-found]
from infinigen.core.util import blender as butil  # type: ignore[import-not-found]
from infinigen.core.util.math import FixedSeed  # type: ignore[import-not-found]
from infinigen.tools import export  # type: ignore[import-not-found]

from plugins.assets_household.bake.materials import bake_surface, constant_surface
from plugins.assets_household.bake.parts import Floats, Part, Surface, save_parts

_SMOOTH_UNTIL_DEG = 35.0
_LAMP_TRIANGLES = 160
_BEFORE_DISSOLVING = 6


def main() -> None:
    """Make, decimate, bake and save."""
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    logging.getLogger().setLevel(logging.WARNING)
    configs = [f"infinigen_examples/configs_{name}" for name in ("indoor", "nature")]
    init.apply_gin_configs(configs, skip_unknown=True)
    butil.clear_scene()
    pieces = spawn(job["factory"], job["seed"])
    if "drop" in job:
        pieces = [piece for piece in pieces if not any(word in piece.name for word in job["drop"])]
    model = joined(pieces)
    drop_materials(model, job.get("drop_materials", []))
    decimate(model, job["triangles"])
    unwrap(model, job.get("unwrap", []))
    parts = []
    for piece in split_by_surface(model, job):
        surface = constant_surface(piece, job) or bake_surface(piece, job["texture_px"])
        parts.append(part(piece, surface))
    save_parts(Path(sys.argv[2]), parts)


def spawn(factory_path: str, seed: int) -> list[bpy.types.Object]:
    """All meshes of the asset, instances made real and modifiers applied."""
    module, _, name = factory_path.rpartition(".")
    factory_class = getattr(importlib.import_module(f"infinigen.assets.objects.{module}"), name)
    with FixedSeed(seed):
        factory = factory_class(seed)
        asset = factory.spawn_asset(seed)
        factory.finalize_assets(asset)
    pieces = []
    for item in [asset, *asset.children_recursive]:
        if item.type != "MESH" or item.hide_render:
            continue
        export.realizeInstances(item)
        with butil.SelectObjects(item):
            bpy.ops.object.convert(target="MESH")
        if item.data.polygons:
            pieces.append(item)
    print("pieces:", [(piece.name, len(piece.data.polygons)) for piece in pieces], flush=True)
    return pieces


def joined(pieces: list[bpy.types.Object]) -> bpy.types.Object:
    """One mesh in world coordinates, triangulated, its doubled vertices merged."""
    for piece in pieces:
        matrix = piece.matrix_world.copy()
        piece.parent = None
        piece.data = piece.data.copy()
        piece.data.transform(matrix)
        piece.matrix_world.identity()
    with butil.SelectObjects(pieces):
        bpy.ops.object.join()
    model = bpy.context.view_layer.objects.active
    with butil.ViewportMode(model, mode="EDIT"):
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.remove_doubles(threshold=float(np.ptp(corners(model), axis=0).max()) * 1e-5)
        bpy.ops.mesh.quads_convert_to_tris()
    print("materials:", [(slot.name, i) for i, slot in enumerate(model.material_slots)], flush=True)
    print("size:", np.ptp(corners(model), axis=0), "triangles:", len(model.data.polygons), flush=True)
    return model


def drop_materials(model: bpy.types.Object, words: list[str]) -> None:
    """Take away the faces whose material's name holds one of the words."""
    drop = [i for i, slot in enumerate(model.material_slots) if any(word in slot.name for word in words)]
    if not drop:
        return
    select_faces(model, drop)
    with butil.ViewportMode(model, mode="EDIT"):
        bpy.ops.mesh.delete(type="FACE")


def select_faces(model: bpy.types.Object, materials: list[int]) -> None:
    """Select the faces of these material slots and no others."""
    with butil.ViewportMode(model, mode="EDIT"):
        bpy.ops.mesh.select_mode(type="FACE")
        bpy.ops.mesh.select_all(action="DESELECT")
    for face in model.data.polygons:
        face.select = face.material_index in materials


def decimate(model: bpy.types.Object, triangles: int) -> None:
    """Edges by quadric error, flat regions in one go in between, down to the number of triangles; smooth normals.

    Dissolving flat regions keeps furniture crisp, but takes minutes on hundreds of thousands of triangles.
    """
    with butil.SelectObjects(model):
        _collapse(model, _BEFORE_DISSOLVING * triangles)
        if len(model.data.polygons) > triangles:
            flat = model.modifiers.new("flat", "DECIMATE")
            flat.decimate_type, flat.angle_limit, flat.delimit = "DISSOLVE", np.deg2rad(0.5), {"MATERIAL", "UV"}
            bpy.ops.object.modifier_apply(modifier=flat.name)
            bpy.ops.object.modifier_apply(modifier=model.modifiers.new("triangles", "TRIANGULATE").name)
        for _ in range(4):
            _collapse(model, triangles)
        bpy.ops.object.shade_smooth_by_angle(angle=np.deg2rad(_SMOOTH_UNTIL_DEG))
    print("decimated:", len(model.data.polygons), flush=True)


def _collapse(model: bpy.types.Object, triangles: int) -> None:
    count = len(model.data.polygons)
    if count <= triangles * 1.02:
        return
    collapse = model.modifiers.new("collapse", "DECIMATE")
    collapse.ratio = triangles / count
    bpy.ops.object.modifier_apply(modifier=collapse.name)
    bpy.ops.object.modifier_apply(modifier=model.modifiers.new("triangles", "TRIANGULATE").name)


def unwrap(model: bpy.types.Object, words: list[str]) -> None:
    """Give faces whose material's name holds one of the words texture coordinates in metres, where the asset has none.

    Infinigen's fabrics read the layer "UVMap"; on assets without one they would come out black.
    """
    materials = [i for i, slot in enumerate(model.material_slots) if any(word in slot.name for word in words)]
    if not materials:
        return
    layers = model.data.uv_layers
    layer = layers.get("UVMap") or layers.new(name="UVMap")
    layers.active = layer
    layer.active_render = True
    select_faces(model, materials)
    with butil.SelectObjects(model), butil.ViewportMode(model, mode="EDIT"):
        bpy.ops.uv.cube_project(cube_size=1.0)


def split_by_surface(model: bpy.types.Object, job: dict[str, Any]) -> list[bpy.types.Object]:
    """The model in pieces: one for all that is baked, one for each material that stays of one colour (glass, light)."""
    constant = [i for i in range(len(model.material_slots)) if constant_surface(model, job, slot=i)]
    pieces: list[bpy.types.Object] = []
    for index in constant:
        if not any(face.material_index == index for face in model.data.polygons):
            continue
        if all(face.material_index == index for face in model.data.polygons):
            break
        before = set(bpy.data.objects)
        select_faces(model, [index])
        with butil.ViewportMode(model, mode="EDIT"):
            bpy.ops.mesh.separate(type="SELECTED")
        pieces += set(bpy.data.objects) - before
    for piece in [model, *pieces]:
        with butil.SelectObjects(piece):
            bpy.ops.object.material_slot_remove_unused()
        surface = constant_surface(piece, job)
        if surface is not None and max(surface.emission) > 0:  # each of a lamp's triangles is a light of its own
            decimate(piece, _LAMP_TRIANGLES)
    return [model, *pieces]


def corners(model: bpy.types.Object) -> Floats:
    """The positions of the mesh's vertices, (V, 3)."""
    positions = np.empty(len(model.data.vertices) * 3, np.float32)
    model.data.vertices.foreach_get("co", positions)
    vertices: Floats = positions.reshape(-1, 3).astype(np.float64)
    return vertices


def part(piece: bpy.types.Object, surface: Surface) -> Part:
    """The piece's triangles, corner by corner."""
    mesh = piece.data
    with butil.SelectObjects(piece):
        bpy.ops.object.modifier_apply(modifier=piece.modifiers.new("triangles", "TRIANGULATE").name)
    loops = len(mesh.loops)
    indices, normals = np.empty(loops, np.int32), np.empty(loops * 3)
    mesh.loops.foreach_get("vertex_index", indices)
    mesh.corner_normals.foreach_get("vector", normals)
    uvs = np.zeros(loops * 2)
    if surface.images:
        mesh.uv_layers["bake"].uv.foreach_get("vector", uvs)
    return Part(corners(piece)[indices], normals.reshape(-1, 3), uvs.reshape(-1, 2), surface)


if __name__ == "__main__":
    main()
