"""A scene as an SDFormat world, as Gazebo reads it: one static model for each object."""

import re
from collections.abc import Iterable
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from benchbot_scenes.exporting.labels import unique_names
from benchbot_scenes.exporting.parts import display_color, lamps, parts, png, wavefront
from benchbot_scenes.scene import Instance, Material, SceneGeometry

VERSION = "1.9"
GLASS_TRANSPARENCY = 0.75
LAMP_RANGE_M = 20.0
NAMESPACE = "urn:benchbot:sdf:1"
CLASS = f"{{{NAMESPACE}}}class"
"""The custom element beside a label that says its class."""
LABELS = {"filename": "gz-sim-label-system", "name": "gz::sim::systems::Label"}
"""The plug-in from which Gazebo's segmentation camera has the number of a class."""


def files(geometry: SceneGeometry, name: str) -> dict[str, bytes]:
    """NAME.sdf, and a folder NAME with its meshes (OBJ) and textures (PNG); coordinates are those of the map.

    Everything is static, so that engines collide with the triangles themselves.
    """
    ET.register_namespace("benchbot", NAMESPACE)
    root = ET.Element("sdf", version=VERSION)
    world = ET.SubElement(root, "world", name=name)
    allowed = tuple(replace(found, name=_allowed(found.name)) for found in geometry.instances)
    names = unique_names(replace(geometry, instances=allowed))
    classes = sorted({found.class_name for found in allowed if found.class_name is not None})
    instances = {found.index: found for found in allowed}
    links: dict[int, ET.Element] = {}
    written: dict[str, bytes] = {}
    for part in parts(geometry):
        mesh = f"{name}/{part.name}.obj"
        written[mesh] = wavefront(geometry, part)
        if part.instance not in links:
            links[part.instance] = _model(world, names[part.instance], instances[part.instance], classes)
        material = geometry.materials[part.material]
        collision = ET.SubElement(links[part.instance], "collision", name=f"collision_{part.material}")
        _add_mesh(collision, mesh)
        visual = ET.SubElement(links[part.instance], "visual", name=f"visual_{part.material}")
        if material.is_glass:
            ET.SubElement(visual, "transparency").text = f"{GLASS_TRANSPARENCY}"
        _add_mesh(visual, mesh)
        image = material.base_color_image
        picture = None if image is None else f"{name}/{image}.png"
        visual.append(_material(material, picture))
        if image is not None and picture is not None and picture not in written:
            written[picture] = png(geometry.images[image])
    strongest = max((float(lamp.radiance.max()) for lamp in lamps(geometry)), default=1.0)
    for lamp in lamps(geometry):
        light = ET.SubElement(links[lamp.instance], "light", name="lamp", type="point")
        # Clear of the lamp itself, whose shade would keep all light in.
        _add(light, "pose", [*(lamp.position + 0.02 * lamp.direction), 0, 0, 0])
        ET.SubElement(light, "cast_shadows").text = "false"
        _add(light, "diffuse", [*display_color(lamp.radiance / strongest), 1])
        attenuation = ET.SubElement(light, "attenuation")
        for word, value in (("range", LAMP_RANGE_M), ("constant", 1), ("linear", 0), ("quadratic", 1)):
            _add(attenuation, word, [value])
    ET.indent(root)
    written[f"{name}.sdf"] = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return written


def _model(world: ET.Element, name: str, instance: Instance, classes: list[str]) -> ET.Element:
    """Add a model with its class, if it has one; returns its link."""
    model = ET.SubElement(world, "model", name=name)
    ET.SubElement(model, "static").text = "true"
    link = ET.SubElement(model, "link", name="link")
    if instance.class_name is not None:
        plugin = ET.SubElement(model, "plugin", LABELS)
        # 0 is what has no label.
        ET.SubElement(plugin, "label").text = f"{classes.index(instance.class_name) + 1}"
        ET.SubElement(plugin, CLASS).text = instance.class_name
    return link


def _add_mesh(shape: ET.Element, path: str) -> None:
    mesh = ET.SubElement(ET.SubElement(shape, "geometry"), "mesh")
    ET.SubElement(mesh, "uri").text = path


def _material(material: Material, picture: str | None) -> ET.Element:
    found = ET.Element("material")
    color = display_color(material.base_color)
    _add(found, "ambient", [*color, 1])
    _add(found, "diffuse", [*color, 1])
    _add(found, "specular", [*[0.5 * (1 - material.roughness)] * 3, 1])
    _add(found, "emissive", [*np.clip(material.emission, 0, 1), 1])
    ET.SubElement(found, "double_sided").text = str(material.double_sided).lower()
    metal = ET.SubElement(ET.SubElement(found, "pbr"), "metal")
    if picture is not None:
        ET.SubElement(metal, "albedo_map").text = picture
    _add(metal, "roughness", [material.roughness])
    _add(metal, "metalness", [material.metallic])
    return found


def _add(parent: ET.Element, word: str, values: Iterable[float]) -> None:
    ET.SubElement(parent, word).text = " ".join(f"{value:.5f}".rstrip("0").rstrip(".") for value in values)


def _allowed(name: str) -> str:
    """A name without what SDFormat keeps for itself: `::`, which separates, `world` and `__…__`."""
    plain = re.sub(r"[^\w .-]", "_", name).strip()
    return f"{plain}_object" if plain in ("", "world") or re.fullmatch("__.*__", plain) else plain
