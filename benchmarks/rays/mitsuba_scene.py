"""A scene of ours as a Mitsuba 3 scene: meshes, materials, glowing surfaces, sun, sky and camera.

Mitsuba's variant has to be set before. Panes do not map (its path tracer finds no light behind them): leave them out
of both scenes with `without_panes`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics

Look = Callable[[Material, SceneGeometry], dict[str, Any]]
SKY_HEIGHT = 256


@dataclass(frozen=True)
class Tables:
    """By the number under which Mitsuba's kernels know a mesh: instance, material, colour (N, 3), emission (N, 3)."""

    instance: npt.NDArray[np.uint32]
    material: npt.NDArray[np.uint32]
    color: npt.NDArray[np.float32]
    emission: npt.NDArray[np.float32]


def matt(material: Material, scene: SceneGeometry) -> dict[str, Any]:
    """A matt surface of the base colour, for measuring speed with what Mitsuba does fastest."""
    reflectance = {"type": "rgb", "value": list(material.base_color)}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def gltf(material: Material, scene: SceneGeometry) -> dict[str, Any]:
    """Metallic and roughness, colour and normal maps, by `mitsuba_material`."""
    from benchmarks.rays import mitsuba_material

    return mitsuba_material.describe(material, scene)


def load(
    scene: SceneGeometry, folder: Path, *, lighting: Lighting | None = None, look: Look = matt
) -> tuple[Any, Tables]:
    """One mesh for each instance and material; files go to `folder`, which can be deleted afterwards."""
    mi: Any = import_module("mitsuba")
    dr: Any = import_module("drjit")
    description: dict[str, Any] = {"type": "scene"}
    pairs = np.stack([scene.triangle_instance, scene.triangle_material], axis=1)
    meshes, member = np.unique(pairs, axis=0, return_inverse=True)
    order = np.argsort(member.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(member.ravel(), minlength=len(meshes)))
    looks = {int(index): mi.load_dict(look(scene.materials[index], scene)) for index in np.unique(meshes[:, 1])}
    for number, (first, last) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
        material = scene.materials[meshes[number, 1]]
        path = folder / f"{number}.ply"
        write_ply(path, scene, order[first:last])
        mesh = {"type": "ply", "filename": str(path), "bsdf": looks[int(meshes[number, 1])]}
        if material.is_emissive:
            radiance = {"type": "rgb", "value": list(material.emission)}
            mesh["emitter"] = {"type": "area", "radiance": radiance}
        description[f"mesh_{number:05d}"] = mesh
    if lighting is not None:
        description |= _outdoors(lighting)
    loaded = mi.load_dict(description, optimize=False)  # or meshes of one material would become one
    numbers = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]) for shape in loaded.shapes()]
    names = [int(shape.id().rsplit("_", 1)[1]) for shape in loaded.shapes()]
    count = max(numbers) + 1
    tables = Tables(
        np.zeros(count, np.uint32),
        np.zeros(count, np.uint32),
        np.zeros((count, 3), np.float32),
        np.zeros((count, 3), np.float32),
    )
    for number, name in zip(numbers, names, strict=True):
        instance, index = meshes[name]
        tables.instance[number], tables.material[number] = instance, index
        tables.color[number] = scene.materials[index].base_color
        tables.emission[number] = scene.materials[index].emission
    return loaded, tables


def without_panes(scene: SceneGeometry) -> SceneGeometry:
    """The scene with empty windows."""
    opaque = np.array([not m.is_glass for m in scene.materials], bool)[scene.triangle_material]
    return replace(
        scene,
        triangles=scene.triangles[opaque],
        triangle_instance=scene.triangle_instance[opaque],
        triangle_material=scene.triangle_material[opaque],
    )


def sensor(pose: npt.NDArray[np.float64], camera: Intrinsics) -> Any:
    """A pinhole camera of the same view (optical axis through the centre): Mitsuba's has x to the left and y up."""
    mi: Any = import_module("mitsuba")
    turned = pose.copy()
    turned[:3, :2] *= -1
    return mi.load_dict(
        {
            "type": "perspective",
            "fov_axis": "x",
            "fov": float(np.degrees(2 * np.arctan(camera.width / 2 / camera.fx))),
            "near_clip": 1e-3,
            "far_clip": 1e4,
            "to_world": mi.ScalarTransform4f(turned),
            "film": {
                "type": "hdrfilm",
                "width": camera.width,
                "height": camera.height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
        }
    )


def _outdoors(lighting: Lighting) -> dict[str, Any]:
    """Sky as a picture of all directions, sun as parallel light."""
    from benchmarks.rays.kernels import sky

    mi: Any = import_module("mitsuba")
    parts: dict[str, Any] = {}
    if max(lighting.sun.irradiance) > 0:
        parts["sun"] = {
            "type": "directional",
            "direction": [-value for value in lighting.sun.direction],
            "irradiance": {"type": "rgb", "value": list(lighting.sun.irradiance)},
        }
    around, down = np.meshgrid(
        2 * np.pi * (np.arange(2 * SKY_HEIGHT) + 0.5) / (2 * SKY_HEIGHT),
        np.pi * (np.arange(SKY_HEIGHT) + 0.5) / SKY_HEIGHT,
    )
    # The picture's upright axis is y; turned by a quarter about x it becomes our z.
    world = np.stack([np.sin(around) * np.sin(down), np.cos(around) * np.sin(down), np.cos(down)], axis=-1)
    radiance = sky(lighting, world.reshape(-1, 3)).reshape(*world.shape)
    if radiance.max() > 0:
        upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
        parts["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(radiance), "to_world": upright}
    return parts


def write_ply(path: Path, scene: SceneGeometry, chosen: npt.NDArray[np.int64]) -> None:
    """Positions, normals, texture coordinates and faces of the chosen triangles (binary PLY)."""
    used, faces = np.unique(scene.triangles[chosen], return_inverse=True)
    vertices = np.concatenate([scene.vertices[used], scene.normals[used], scene.uvs[used]], axis=1).astype("<f4")
    rows = np.zeros(len(chosen), [("count", "u1"), ("index", "<i4", 3)])
    rows["count"], rows["index"] = 3, faces.reshape(-1, 3)
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{properties}"
        f"element face {len(rows)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + rows.tobytes())
