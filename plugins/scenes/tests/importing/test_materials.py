"""Materials and textures as OBJ, USD and glTF have them."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing import reading
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import SUFFIX, Guesses
from benchbot_scenes.importing.understanding import understand
from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_scenes.scene_file import scene_file
from plugins.scenes.tests.importing import places

QUADRANTS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
SQUARE = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nvt 0.25 0.75\nvt 0.75 0.75\nvt 0.75 0.25\nvt 0.25 0.25\n"


def _colors(geometry: SceneGeometry) -> list[tuple[int, ...]]:
    """What the texture shows at the corners of the first triangle."""
    (number,) = {geometry.materials[m].base_color_image for m in np.unique(geometry.triangle_material)}
    assert number is not None
    image = geometry.images[number]
    u, v = (geometry.uvs[geometry.triangles[0]] % 1.0).T
    return [tuple(int(c) for c in image[int(y * 2), int(x * 2), :3]) for x, y in zip(u, v, strict=True)]


def _picture(path: Path) -> Path:
    Image.fromarray(QUADRANTS).save(path)
    return path


def test_a_texture_of_an_obj_file_lies_as_trimesh_and_blender_lay_it(tmp_path: Path) -> None:
    _picture(tmp_path / "my picture.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 0 0 0\nmap_Kd -s 1 1 1 my picture.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3 4/4\n")
    geometry = reading.read(tmp_path / "a.obj").geometry
    # In OBJ files v runs upwards: (0.25, 0.75) is in the upper left of the picture.
    assert _colors(geometry) == [(255, 0, 0), (0, 255, 0), (255, 255, 255)]
    assert {geometry.materials[m].base_color for m in geometry.triangle_material} == {(1.0, 1.0, 1.0)}


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("Kd 0.1 0.2 0.3", {"base_color": (0.1, 0.2, 0.3)}),
        ("Ke 2 1 0", {"emission": (2.0, 1.0, 0.0)}),
        ("d 0.2", {"transmission": 1.0}),
        ("Tr 0.8", {"transmission": 1.0}),
        ("d 0.9", {"transmission": 0.0}),
        ("Pr 0.35\nPm 1", {"roughness": 0.35, "metallic": 1.0}),
        ("Ns 0", {"roughness": 1.0}),
        ("Kd what ever", {"base_color": (0.6, 0.6, 0.6)}),
    ],
)
def test_keywords_of_materials(tmp_path: Path, lines: str, expected: dict[str, object]) -> None:
    (tmp_path / "a.mtl").write_text(f"# by hand\nnewmtl m\n{lines}\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3 4\n")
    geometry = reading.read(tmp_path / "a.obj").geometry
    material = geometry.materials[geometry.triangle_material[0]]
    assert {key: getattr(material, key) for key in expected} == pytest.approx(expected)


def test_faces_of_any_form_are_read(tmp_path: Path) -> None:
    faces = "f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
    faces += "f -4 -3 -2 -1\nf 1/ 2/ 3/\nf 1 2 \\\n3 4\n"
    (tmp_path / "a.obj").write_text(f"{SQUARE}vn 0 0 1\n{faces}")
    geometry = reading.read(tmp_path / "a.obj").geometry
    assert len(geometry.triangles) == 3 + 2 + 2 + 1 + 2
    assert (geometry.normals[:, 2] > 0.99).all()


def test_a_polygon_with_a_dent_is_cut_within_its_outline(tmp_path: Path) -> None:
    arrow = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\n"
    for order in ("1 2 3 4 5", "5 4 3 2 1"):
        (tmp_path / "a.obj").write_text(f"{arrow}f {order}\n")
        geometry = reading.read(tmp_path / "a.obj").geometry
        corners = geometry.vertices[geometry.triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
        assert np.abs(cross).sum() / 2 == pytest.approx(10.0)
        assert (np.sign(cross) == (1 if order[0] == "1" else -1)).all()


@pytest.mark.parametrize("suffix", [".usda", ".usdz"])
def test_a_usd_preview_surface_with_a_texture(tmp_path: Path, suffix: str) -> None:
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils

    _picture(tmp_path / "picture.png")
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    mesh = UsdGeom.Mesh.Define(stage, "/Square")
    stage.SetDefaultPrim(mesh.GetPrim())
    mesh.CreatePointsAttr([Gf.Vec3f(x, y, 0) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    primvar.Set([Gf.Vec2f(*uv) for uv in ((0.25, 0.75), (0.75, 0.75), (0.75, 0.25), (0.25, 0.25))])
    material = UsdShade.Material.Define(stage, "/Look")
    surface = UsdShade.Shader.Define(stage, "/Look/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.25)
    texture = UsdShade.Shader.Define(stage, "/Look/Texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("./picture.png")
    texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(texture.ConnectableAPI(), "rgb")
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.GetRootLayer().Save()
    if suffix == ".usdz":
        assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usda"), str(tmp_path / "a.usdz"))
    geometry = reading.read(tmp_path / f"a{suffix}").geometry
    assert _colors(geometry) == [(255, 0, 0), (0, 255, 0), (255, 255, 255)]
    assert {geometry.materials[m].roughness for m in geometry.triangle_material} == {0.25}


def test_what_a_usd_stage_hides_is_left_out(tmp_path: Path) -> None:
    path = places.write_usd(tmp_path / "a.usda", places.flat())
    text = path.read_text().replace(
        'def Mesh "Ceiling"\n    {', 'def Mesh "Ceiling"\n    {\n        token visibility = "invisible"'
    )
    path.write_text(text)
    model = reading.read(path)
    assert "Ceiling" not in {found.name for found in model.geometry.instances}
    assert "1 meshes" in model.notes[0]


def test_instances_of_usd_stand_where_they_are_put(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text(
        """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
class "Model"
{
    def Cube "Body"
    {
        double size = 2
    }
}
def Xform "Chair_1" (
    instanceable = true
    references = </Model>
)
{
    double3 xformOp:translate = (5, 0, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Chair_2" (
    instanceable = true
    references = </Model>
)
{
    double3 xformOp:translate = (-5, 0, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
    )
    understood = understand(path, Guesses())
    assert [(found.name, found.class_name) for found in understood.geometry.instances] == [
        ("Chair_1", "chair"),
        ("Chair_2", "chair"),
    ]
    assert understood.geometry.vertices.min(axis=0) == pytest.approx([-6, -1, 0])
    assert understood.geometry.vertices.max(axis=0) == pytest.approx([6, 1, 2])


def test_a_gltf_file_with_its_buffer_and_picture_beside_it(tmp_path: Path) -> None:
    _picture(tmp_path / "picture.png")
    path = places.write(tmp_path / "a.gltf", places.flat()[:1])
    document = json.loads(path.read_text())
    assert "uri" in document["buffers"][0]
    document |= {"images": [{"uri": "picture.png"}], "textures": [{"source": 0}]}
    document["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"},
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.2]}, "alphaMode": "BLEND"},
    ]
    document["meshes"][0]["primitives"][0]["material"] = 0
    path.write_text(json.dumps(document))
    geometry = reading.read(path).geometry
    assert geometry.images[0].shape == (2, 2, 4)
    assert geometry.materials[0].alpha_cutoff == 0.5
    assert geometry.materials[1].is_glass


def test_materials_survive_being_written(tmp_path: Path) -> None:
    base = reading.read(places.write(tmp_path / "a.obj", places.flat()[:1])).geometry
    noise = np.random.default_rng(0).integers(0, 256, (4, 4, 4), np.uint8)
    materials = (
        Material("lamp", emission=(12.0, 9.0, 3.0)),
        Material("pane", transmission=1.0, refractive_index=1.4, is_solid=True),
        Material("leaf", base_color_image=0, normal_image=0, normal_scale=0.5, alpha_cutoff=0.3, double_sided=True),
    )
    count = len(base.triangles)
    geometry = SceneGeometry(
        **{
            **vars(base),
            "materials": materials,
            "images": (noise,),
            "triangle_material": np.arange(count, dtype=np.int32) % 3,
        }
    )
    path = tmp_path / "a.glb"
    path.write_bytes(to_glb(geometry))
    again = load_scene(path)
    for mine, theirs in zip(materials, again.materials[:3], strict=True):
        assert theirs.emission == pytest.approx(mine.emission)
        assert (theirs.transmission, theirs.is_solid) == (mine.transmission, mine.is_solid)
        assert theirs.refractive_index == pytest.approx(mine.refractive_index)
        assert (theirs.alpha_cutoff, theirs.normal_scale, theirs.double_sided) == (
            mine.alpha_cutoff,
            mine.normal_scale,
            mine.double_sided,
        )
    assert (again.images[0] == noise).all()


def test_a_scan_with_a_texture(tmp_path: Path) -> None:
    _picture(tmp_path / "picture.png")
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile picture.png\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nproperty float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0 0.25 0.75\n4 0 0 0.75 0.75\n4 4 1 0.75 0.25\n3 0 1 2\n"
    )
    assert _colors(reading.read(tmp_path / "a.ply").geometry) == [(255, 0, 0), (0, 255, 0), (255, 255, 255)]


def test_a_scene_may_be_named_as_it_is(tmp_path: Path) -> None:
    path = places.write(tmp_path / "flat.obj", places.flat(), 100.0)
    first = scene_file(path, tmp_path / "cache")
    assert load_scene(first).vertices.max(axis=0) == pytest.approx([5.1, 4.1, 2.7], abs=1e-4)
    assert scene_file(path, tmp_path / "cache") == first
    path.with_suffix(SUFFIX).write_text("units: mm\nfloor_z_m: 0\n")
    second = scene_file(path, tmp_path / "cache")
    assert second != first
    assert load_scene(second).vertices.max(axis=0) == pytest.approx([0.51, 0.41, 0.27], abs=1e-4)


def test_pictures_in_scenes_that_are_written_are_pictures(tmp_path: Path) -> None:
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (300, 300, 3), np.uint8)).save(tmp_path / "big.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd big.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3 4/4\n")
    data = to_glb(reading.read(tmp_path / "a.obj").geometry)
    start = data.index(b"\xff\xd8\xff")
    with Image.open(io.BytesIO(data[start:])) as picture:
        assert (picture.format, picture.size) == ("JPEG", (300, 300))
