"""A scene as an MJCF model for MuJoCo: one static body for each object."""

from collections.abc import Iterable
from xml.etree import ElementTree as ET

import numpy as np

from benchbot_scenes.exporting.collision import pieces
from benchbot_scenes.exporting.labels import unique_names
from benchbot_scenes.exporting.parts import display_color, lamps, parts, png, wavefront
from benchbot_scenes.scene import Material, SceneGeometry

GLASS_ALPHA = 0.25
LAMPS_BRIGHTNESS = 0.6
"""Of all lamps together, beside MuJoCo's own headlight: it adds lights up without exposure."""
VISUAL, COLLISION = "visual", "collision"
CLASS_TEXT = "class/"
"""What the name of a custom text begins with that says a body's class; the rest is the body's name."""


def files(geometry: SceneGeometry, name: str) -> dict[str, bytes]:
    """NAME.xml, and a folder NAME with its meshes (OBJ) and textures (PNG).

    Visual geoms are in group 2 and touch nothing, collision geoms are in group 3. Coordinates are those of the map.
    """
    root = ET.Element("mujoco", model=name)
    ET.SubElement(root, "compiler", meshdir=name, texturedir=name, autolimits="true")
    default = ET.SubElement(root, "default")
    looks = ET.SubElement(default, "default", {"class": VISUAL})
    ET.SubElement(looks, "geom", type="mesh", contype="0", conaffinity="0", group="2", mass="0")
    touches = ET.SubElement(default, "default", {"class": COLLISION})
    ET.SubElement(touches, "geom", type="mesh", group="3", rgba="0.5 0.5 0.5 0.3")
    asset, world = ET.SubElement(root, "asset"), ET.SubElement(root, "worldbody")
    names = unique_names(geometry)
    bodies: dict[int, ET.Element] = {}
    written: dict[str, bytes] = {}

    def body(instance: int) -> ET.Element:
        if instance not in bodies:
            bodies[instance] = ET.SubElement(world, "body", name=names[instance])
        return bodies[instance]

    used: set[int] = set()
    for part in parts(geometry):
        is_open = geometry.materials[part.material].double_sided
        written[f"{name}/{part.name}.obj"] = wavefront(geometry, part, both_sides=is_open)
        ET.SubElement(asset, "mesh", name=part.name, file=f"{part.name}.obj", inertia="shell")
        shown = {"class": VISUAL, "mesh": part.name, "material": f"{part.material}"}
        ET.SubElement(body(part.instance), "geom", shown)
        used.add(part.material)
    for number, piece in enumerate(pieces(geometry)):
        mesh = f"{COLLISION}_{number}"
        ET.SubElement(asset, "mesh", name=mesh, vertex=_numbers(piece.corners.ravel()), inertia="shell")
        ET.SubElement(body(piece.instance), "geom", {"class": COLLISION, "mesh": mesh})
    pictures = {index: _material(asset, index, geometry.materials[index]) for index in sorted(used)}
    for image in sorted({image for image in pictures.values() if image is not None}):
        written[f"{name}/{image}.png"] = png(geometry.images[image], has_alpha=False)
        ET.SubElement(asset, "texture", name=f"{image}", type="2d", file=f"{image}.png")
    _add_lamps(world, geometry)
    labelled = [found for found in geometry.instances if found.class_name is not None and found.index in bodies]
    custom = ET.SubElement(root, "custom") if labelled else root
    for found in labelled:
        ET.SubElement(custom, "text", name=f"{CLASS_TEXT}{names[found.index]}", data=f"{found.class_name}")
    ET.indent(root)
    written[f"{name}.xml"] = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return written


def _material(asset: ET.Element, index: int, material: Material) -> int | None:
    """Add a material; returns the image that its texture needs."""
    opacity = GLASS_ALPHA if material.is_glass else 1.0
    attributes = {
        "name": f"{index}",
        "rgba": _numbers([*display_color(material.base_color), opacity]),
        "specular": f"{0.5 * (1 - material.roughness):.4g}",
        "shininess": f"{1 - material.roughness:.4g}",
        "metallic": f"{material.metallic:.4g}",
        "roughness": f"{material.roughness:.4g}",
        "emission": f"{min(max(material.emission), 1.0):.4g}",
    }
    if material.base_color_image is not None:
        attributes["texture"] = f"{material.base_color_image}"
    ET.SubElement(asset, "material", attributes)
    return material.base_color_image


def _add_lamps(world: ET.Element, geometry: SceneGeometry) -> None:
    found = lamps(geometry)
    strongest = max((float(lamp.radiance.max()) for lamp in found), default=1.0)
    for lamp in found:
        diffuse = display_color(lamp.radiance / strongest) * LAMPS_BRIGHTNESS / len(found)
        # Clear of the lamp itself, whose shade would keep all light in.
        position = lamp.position + 0.02 * lamp.direction
        ET.SubElement(
            world,
            "light",
            {"type": "point", "pos": _numbers(position), "diffuse": _numbers(diffuse), "castshadow": "false"},
        )


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.5f}".rstrip("0").rstrip(".") for value in np.asarray(list(values), np.float64))
