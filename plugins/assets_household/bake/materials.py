"""Blender materials as glTF has them: pictures of colour, roughness, metal and normals, or one colour alone."""

from typing import Any

import bpy  # type: ignore[import-not-found]
import numpy as np
from infinigen.core.util import blender as butil  # type: ignore[import-not-found]
from infinigen.tools import export  # type: ignore[import-not-found]

from plugins.assets_household.bake.parts import Picture, Surface

_CHANNELS = {"base_color": ("Base Color", "Color"), "roughness": ("Roughness",), "metallic": ("Metallic",)}
_DEFAULTS = {"base_color": 0.8, "roughness": 1.0, "metallic": 0.0}
_SAMPLES = 2
_MARGIN_PX = 6


def constant_surface(piece: bpy.types.Object, job: dict[str, Any], slot: int = 0) -> Surface | None:
    """The surface of a material that is not baked: what the job says of it, or glass; None for all others.

    The job's "surfaces" map a part of a material's name to the fields of `Surface`.
    """
    material = piece.material_slots[slot].material if piece.material_slots else None
    if material is None:
        return None
    for word, fields in job.get("surfaces", {}).items():
        if word in material.name:
            return Surface(name=word, **({"metallic": 0.0} | fields))
    if "glass" in material.name.lower() or any(node.type == "BSDF_GLASS" for node in _nodes(material)):
        return Surface(name="glass", metallic=0.0, roughness=0.05, transmission=1.0)
    return None


def _nodes(material: bpy.types.Material) -> list[bpy.types.Node]:
    """All nodes of the material, those of its groups too."""
    found, pending = [], [material.node_tree]
    while pending:
        for node in pending.pop().nodes:
            found.append(node)
            if node.type == "GROUP" and node.node_tree is not None:
                pending.append(node.node_tree)
    return found


def bake_surface(piece: bpy.types.Object, texture_px: int) -> Surface:
    """Unwrap the piece (layer "bake") and bake its materials to pictures."""
    _unwrap(piece)
    baked = {name: _bake_channel(piece, name, texture_px) for name in _CHANNELS}
    rough = np.zeros_like(baked["roughness"])
    rough[..., 1], rough[..., 2] = baked["roughness"][..., 1], baked["metallic"][..., 2]
    normal = _bake(piece, list(_materials(piece)), texture_px, "NORMAL", is_colour=False)
    images = {"base_color": baked["base_color"], "metallic_roughness": rough, "normal": normal}
    return Surface(name="baked", images=images)


def _materials(piece: bpy.types.Object) -> list[bpy.types.Material]:
    return [slot.material for slot in piece.material_slots]


def _unwrap(piece: bpy.types.Object) -> None:
    layers = piece.data.uv_layers
    with butil.SelectObjects(piece):
        rendered = next((layer.name for layer in layers if layer.active_render), None)
        layers.new(name="bake")
        layers.active = layers["bake"]
        if rendered is not None:  # the materials go on reading their own coordinates
            layers[rendered].active_render = True
        with butil.ViewportMode(piece, mode="EDIT"):
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(angle_limit=np.deg2rad(66), island_margin=0.002, area_weight=0.0)


def _bake_channel(piece: bpy.types.Object, channel: str, texture_px: int) -> Picture:
    """Every shader glows with the channel's value, and that is baked: mixed shaders come out mixed."""
    originals = _materials(piece)
    copies = [export.deep_copy_material(material) for material in originals]
    for slot, copy in zip(piece.material_slots, copies, strict=True):
        slot.material = copy
        _glow(copy.node_tree, channel, set())
    pixels = _bake(piece, copies, texture_px, "EMIT", is_colour=channel == "base_color")
    for slot, material in zip(piece.material_slots, originals, strict=True):
        slot.material = material
    return pixels


def _glow(tree: bpy.types.NodeTree, channel: str, seen: set[str]) -> None:
    seen.add(tree.name)
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None and node.node_tree.name not in seen:
            _glow(node.node_tree, channel, seen)
        if not node.type.startswith("BSDF") and node.type not in ("SUBSURFACE_SCATTERING", "EMISSION"):
            continue
        glow = tree.nodes.new("ShaderNodeEmission")
        socket = next((node.inputs[name] for name in _CHANNELS[channel] if name in node.inputs), None)
        if node.type in ("BSDF_GLOSSY", "BSDF_ANISOTROPIC") and channel == "metallic":
            glow.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        elif socket is None:
            glow.inputs["Color"].default_value = (*(_DEFAULTS[channel],) * 3, 1.0)
        elif socket.is_linked:
            tree.links.new(socket.links[0].from_socket, glow.inputs["Color"])
        else:
            value = socket.default_value
            colour = tuple(value) if hasattr(value, "__len__") else (value, value, value, 1.0)
            glow.inputs["Color"].default_value = colour
        for link in list(node.outputs[0].links):
            tree.links.new(glow.outputs[0], link.to_socket)


def _bake(
    piece: bpy.types.Object, materials: list[bpy.types.Material], texture_px: int, kind: str, is_colour: bool
) -> Picture:
    image = bpy.data.images.new("bake", texture_px, texture_px, float_buffer=not is_colour)
    image.colorspace_settings.name = "sRGB" if is_colour else "Non-Color"
    nodes = []
    for material in materials:
        material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        for other in material.node_tree.nodes:
            other.select = False
        node.select, material.node_tree.nodes.active = True, node
        nodes.append((material.node_tree, node))
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", _SAMPLES
    scene.cycles.use_denoising = False
    piece.data.uv_layers.active = piece.data.uv_layers["bake"]
    with butil.SelectObjects(piece):
        bpy.ops.object.bake(type=kind, margin=_MARGIN_PX, margin_type="EXTEND", use_clear=True)
    for tree, node in nodes:
        tree.nodes.remove(node)
    pixels = np.empty(texture_px * texture_px * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    rows = pixels.reshape(texture_px, texture_px, 4)[::-1, :, :3]
    picture: Picture = np.clip(rows * 255 + 0.5, 0, 255).astype(np.uint8)
    return picture
