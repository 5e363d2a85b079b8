"""A scene as a USD stage: meshes with UsdPreviewSurface, collision by UsdPhysics, classes as semantic labels."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes.exporting.labels import unique_names
from benchbot_scenes.exporting.parts import Part, lamps, parts, png
from benchbot_scenes.scene import Material, SceneGeometry

LABELS = "class"
"""The taxonomy of the labels (UsdSemanticsLabelsAPI)."""


def files(geometry: SceneGeometry, name: str) -> dict[str, bytes]:
    """NAME.usdc, and a folder NAME with its textures (PNG); raises BenchbotError where usd-core is not installed."""
    try:
        from pxr import Gf, Tf, Usd, UsdGeom, UsdLux, UsdPhysics, UsdSemantics, UsdShade
    except ImportError as error:
        raise BenchbotError(
            "A scene cannot be written as USD here.", str(error), 'pip install "benchbot-scenes[usd]"'
        ) from error

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.usdc"
        stage: Any = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
        instances = {found.index: found for found in geometry.instances}
        names = unique_names(geometry)
        bodies: dict[int, str] = {}
        materials: dict[int, Any] = {}
        for part in parts(geometry):
            if part.instance not in bodies:
                bodies[part.instance] = f"/World/{Tf.MakeValidIdentifier(names[part.instance])}_{part.instance}"
                prim = UsdGeom.Xform.Define(stage, bodies[part.instance]).GetPrim()
                prim.SetDisplayName(names[part.instance])
                class_name = instances[part.instance].class_name
                if class_name is not None:
                    UsdSemantics.LabelsAPI.Apply(prim, LABELS).CreateLabelsAttr([class_name])
            mesh = UsdGeom.Mesh.Define(stage, f"{bodies[part.instance]}/part_{part.material}")
            _fill(mesh, geometry, part)
            UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
            # The triangles themselves: nothing here moves.
            UsdPhysics.MeshCollisionAPI.Apply(mesh.GetPrim()).CreateApproximationAttr(UsdPhysics.Tokens.none)
            if part.material not in materials:
                materials[part.material] = _material(stage, part.material, geometry.materials[part.material], name)
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(materials[part.material])
        for lamp in lamps(geometry):
            # Beside the objects: a sphere of light would widen the box of the object that it is in.
            light = UsdLux.SphereLight.Define(stage, f"/World/lamps/lamp_{lamp.instance}")
            strength = float(lamp.radiance.max())
            light.CreateIntensityAttr(strength)
            light.CreateColorAttr(Gf.Vec3f(*(lamp.radiance / strength).tolist()))
            light.CreateRadiusAttr(0.1)
            UsdGeom.XformCommonAPI(light).SetTranslate(Gf.Vec3d(*lamp.position.tolist()))
        stage.GetRootLayer().Save()
        written = {path.name: path.read_bytes()}
    used = {geometry.materials[index].base_color_image for index in materials}
    return written | {f"{name}/{image}.png": png(geometry.images[image]) for image in used if image is not None}


def _fill(mesh: Any, geometry: SceneGeometry, part: Part) -> None:
    from pxr import Sdf, UsdGeom, Vt

    used, corners = np.unique(part.triangles, return_inverse=True)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(geometry.vertices[used])))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.triangles), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners.ravel().astype(np.int32)))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(geometry.normals[used])))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(geometry.materials[part.material].double_sided)
    uvs = (geometry.uvs[used] * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32)
    kind = Sdf.ValueTypeNames.TexCoord2fArray
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", kind, UsdGeom.Tokens.vertex).Set(Vt.Vec2fArray.FromNumpy(uvs))


def _material(stage: Any, index: int, material: Material, name: str) -> Any:
    from pxr import Gf, Sdf, UsdShade

    kinds: Any = Sdf.ValueTypeNames
    path = f"/World/materials/material_{index}"
    made = UsdShade.Material.Define(stage, path)
    surface = UsdShade.Shader.Define(stage, f"{path}/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    color = surface.CreateInput("diffuseColor", kinds.Color3f)
    color.Set(Gf.Vec3f(*material.base_color))
    surface.CreateInput("metallic", kinds.Float).Set(material.metallic)
    surface.CreateInput("roughness", kinds.Float).Set(material.roughness)
    surface.CreateInput("ior", kinds.Float).Set(material.refractive_index)
    surface.CreateInput("opacity", kinds.Float).Set(1.0 - material.transmission)
    surface.CreateInput("emissiveColor", kinds.Color3f).Set(Gf.Vec3f(*material.emission))
    if material.base_color_image is not None:
        reader = UsdShade.Shader.Define(stage, f"{path}/st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", kinds.String).Set("st")
        texture = UsdShade.Shader.Define(stage, f"{path}/texture")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", kinds.Asset).Set(f"./{name}/{material.base_color_image}.png")
        texture.CreateInput("wrapS", kinds.Token).Set("repeat")
        texture.CreateInput("wrapT", kinds.Token).Set("repeat")
        texture.CreateInput("scale", kinds.Float4).Set(Gf.Vec4f(*material.base_color, 1.0))
        texture.CreateInput("st", kinds.Float2).ConnectToSource(reader.CreateOutput("result", kinds.Float2))
        color.ConnectToSource(texture.CreateOutput("rgb", kinds.Float3))
    made.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", kinds.Token))
    return made
