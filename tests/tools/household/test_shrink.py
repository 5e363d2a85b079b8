"""A shrunk model is the same model in fewer bytes."""

import io
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from tools.household.shrink import recode, shrink


def _picture(pixels: np.ndarray, kind: str = "PNG") -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind)
    return stream.getvalue()


def _noise(size: int, channels: int = 3) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 255, (size, size, channels), np.uint8)


def _sphere(columns: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, normals, texture coordinates and triangles of an ellipsoid."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, columns), np.linspace(0.01, 0.99, columns)))
    normals = np.stack(
        [np.cos(2 * np.pi * u) * np.sin(np.pi * v), np.cos(np.pi * v), np.sin(2 * np.pi * u) * np.sin(np.pi * v)], 1
    )
    corner = (np.arange(columns - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    square = np.stack([corner, corner + 1, corner + columns, corner + 1, corner + columns + 1, corner + columns], 1)
    return normals * [0.4, 0.9, 0.3] + [2.0, 1.0, -5.0], normals, np.stack([u, v], 1), square.reshape(-1, 3)


def _model(
    nodes: list[dict[str, object]] | None = None,
    uv_scale: float = 1.0,
    pictures: dict[str, bytes] | None = None,
    alpha_mode: str = "OPAQUE",
) -> bytes:
    """A GLB with one ellipsoid; `pictures` by their role: base, rough, normal."""
    positions, normals, uvs, triangles = _sphere()
    document, blob = pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0"), scene=0), bytearray()

    def view(data: bytes) -> int:
        document.bufferViews.append(pygltflib.BufferView(buffer=0, byteOffset=len(blob), byteLength=len(data)))
        blob.extend(data + bytes(-len(data) % 4))
        return len(document.bufferViews) - 1

    for values, kind in ((positions, "VEC3"), (normals, "VEC3"), (uvs * uv_scale, "VEC2")):
        document.accessors.append(
            pygltflib.Accessor(
                bufferView=view(values.astype("<f4").tobytes()),
                componentType=pygltflib.FLOAT,
                count=len(values),
                type=kind,
            )
        )
    document.accessors.append(
        pygltflib.Accessor(
            bufferView=view(triangles.astype("<u4").tobytes()),
            componentType=pygltflib.UNSIGNED_INT,
            count=triangles.size,
            type="SCALAR",
        )
    )
    attributes = pygltflib.Attributes(POSITION=0, NORMAL=1, TEXCOORD_0=2)
    document.meshes = [
        pygltflib.Mesh(primitives=[pygltflib.Primitive(attributes=attributes, indices=3, material=1)]),
        pygltflib.Mesh(name="nobody's", primitives=[pygltflib.Primitive(attributes=attributes, indices=3)]),
    ]
    roles = {}
    for role, data in (pictures or {}).items():
        document.images.append(pygltflib.Image(bufferView=view(data), mimeType="image/png"))
        document.textures.append(pygltflib.Texture(source=len(document.images) - 1))
        roles[role] = pygltflib.TextureInfo(index=len(document.textures) - 1)
    document.materials = [
        pygltflib.Material(name="unused"),
        pygltflib.Material(
            name="used",
            alphaMode=alpha_mode,
            pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
                baseColorFactor=[0.5, 1.0, 1.0, 1.0],
                roughnessFactor=0.5,
                baseColorTexture=roles.get("base"),
                metallicRoughnessTexture=roles.get("rough"),
            ),
            normalTexture=roles.get("normal"),
            extensions={"KHR_materials_transmission": {"transmissionFactor": 0.0}},
        ),
    ]
    document.extensionsUsed = ["KHR_materials_transmission", "EXT_unused"]
    document.nodes = [pygltflib.Node(**node) for node in nodes or [{"mesh": 0}]]
    document.scenes = [pygltflib.Scene(nodes=[0])]
    document.buffers = [pygltflib.Buffer(byteLength=len(blob))]
    document.set_binary_blob(bytes(blob))
    return b"".join(document.save_to_bytes())


def _load(glb: bytes, folder: Path) -> SceneGeometry:
    path = folder / "model.glb"
    path.write_bytes(glb)
    return load_scene(path)


def _corners(scene: SceneGeometry) -> np.ndarray:
    return scene.vertices[scene.triangles]


def test_shape_survives_in_half_the_bytes(tmp_path: Path) -> None:
    model = _model()
    small = shrink(model)
    before, after = _load(model, tmp_path), _load(small, tmp_path)
    assert len(small) < 0.6 * len(model)
    assert len(after.triangles) == len(before.triangles)
    np.testing.assert_allclose(_corners(after), _corners(before), atol=1.8 / 65000)
    np.testing.assert_allclose(after.uvs[after.triangles], before.uvs[before.triangles], atol=1 / 65535)
    cosines = np.sum(after.normals[after.triangles] * before.normals[before.triangles], axis=-1)
    assert cosines.min() > np.cos(np.deg2rad(0.5))


def test_same_model_gives_same_bytes_and_shrinking_again_changes_no_triangle(tmp_path: Path) -> None:
    once = shrink(_model())
    assert shrink(_model()) == once
    np.testing.assert_allclose(
        _corners(_load(shrink(once), tmp_path)), _corners(_load(once, tmp_path)), atol=2 * 1.8 / 65000
    )


@settings(max_examples=20, deadline=None)
@given(
    translation=st.lists(st.floats(-5, 5), min_size=3, max_size=3),
    axis=st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1),
    scale=st.lists(st.floats(0.2, 3), min_size=3, max_size=3),
)
def test_any_placing_of_the_node_survives(
    tmp_path_factory: pytest.TempPathFactory, translation: list[float], axis: list[float], scale: list[float]
) -> None:
    rotation = (np.array(axis) / np.linalg.norm(axis)).tolist()
    model = _model([{"mesh": 0, "translation": translation, "rotation": rotation, "scale": scale}])
    folder = tmp_path_factory.mktemp("placed")
    np.testing.assert_allclose(
        _corners(_load(shrink(model), folder)), _corners(_load(model, folder)), atol=3 * 1.8 / 60000
    )


def test_matrix_of_the_node_survives(tmp_path: Path) -> None:
    matrix = [0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 4.0, 5.0, 6.0, 1.0]
    model = _model([{"mesh": 0, "matrix": matrix}])
    np.testing.assert_allclose(_corners(_load(shrink(model), tmp_path)), _corners(_load(model, tmp_path)), atol=1e-4)


def test_children_of_a_node_with_a_mesh_stay_where_they_were(tmp_path: Path) -> None:
    leaf = {"mesh": 0, "name": "leaf", "translation": [0.0, 3.0, 0.0]}
    frame = {"mesh": 0, "name": "frame", "children": [1], "extras": {"benchbot": {"class": "chair", "instance": "a"}}}
    model = _model([frame, leaf])
    before, after = _load(model, tmp_path), _load(shrink(model), tmp_path)
    assert {instance.name for instance in after.instances} == {"a", "leaf"}
    for instance in before.instances:
        twin = next(found for found in after.instances if found.name == instance.name)
        assert twin.class_name == instance.class_name
        np.testing.assert_allclose(
            _corners(after)[after.triangle_instance == twin.index],
            _corners(before)[before.triangle_instance == instance.index],
            atol=1e-4,
        )


def test_repeating_texture_keeps_its_repeats(tmp_path: Path) -> None:
    model = _model(uv_scale=7.0)
    before, after = _load(model, tmp_path), _load(shrink(model), tmp_path)
    np.testing.assert_allclose(after.uvs[after.triangles], before.uvs[before.triangles], atol=1e-5)


def test_big_picture_becomes_a_small_jpeg(tmp_path: Path) -> None:
    gradient = np.linspace(0, 255, 1024, dtype=np.uint8)
    pixels = np.stack(np.broadcast_arrays(gradient[:, None], gradient[None, :], np.uint8(90)), -1)
    small = shrink(_model(pictures={"base": _picture(pixels)}), texture_px=256)
    scene = _load(small, tmp_path)
    assert scene.images[0].shape == (256, 256, 4)
    np.testing.assert_allclose(scene.images[0][128, 64, :3].astype(int), pixels[514, 258].astype(int), atol=6)
    assert pygltflib.GLTF2.load_from_bytes(small).images[0].mimeType == "image/jpeg"


def test_pictures_of_normals_may_be_smaller_than_those_of_colour(tmp_path: Path) -> None:
    pictures = {"base": _picture(_noise(128)), "normal": _picture(_noise(64))}
    scene = _load(shrink(_model(pictures=pictures), texture_px=64, detail_px=32), tmp_path)
    assert [image.shape[0] for image in scene.images] == [64, 32]


def test_pictures_of_one_colour_become_factors(tmp_path: Path) -> None:
    pictures = {
        "base": _picture(np.full((64, 64, 3), (255, 188, 0), np.uint8)),
        "rough": _picture(np.full((64, 64, 3), (0, 102, 255), np.uint8)),
        "normal": _picture(np.full((64, 64, 3), (128, 128, 255), np.uint8)),
    }
    scene = _load(shrink(_model(pictures=pictures)), tmp_path)
    material = scene.materials[0]
    assert scene.images == ()
    np.testing.assert_allclose(material.base_color, (0.5, 0.5029, 0.0), atol=0.001)
    np.testing.assert_allclose((material.roughness, material.metallic), (0.2, 1.0), atol=1e-6)
    assert material.normal_image is None


def test_cut_out_picture_keeps_its_alpha(tmp_path: Path) -> None:
    pixels = _noise(64, 4)
    scene = _load(shrink(_model(pictures={"base": _picture(pixels)}, alpha_mode="MASK")), tmp_path)
    np.testing.assert_array_equal(scene.images[0], pixels)


def test_picture_that_would_not_shrink_stays_as_it_is() -> None:
    data = _picture(_noise(32), "JPEG")
    assert recode(data, 512, 100) == (data, "image/jpeg")


def test_what_nothing_uses_is_gone() -> None:
    document = pygltflib.GLTF2.load_from_bytes(shrink(_model(pictures={"unused": _picture(_noise(64))})))
    assert [material.name for material in document.materials] == ["used"]
    assert (len(document.meshes), document.images, document.textures) == (1, [], [])
    assert document.extensionsUsed == ["KHR_materials_transmission", "KHR_mesh_quantization"]


def test_file_that_is_no_glb_is_refused() -> None:
    with pytest.raises(ValueError, match="glTF"):
        shrink(b"not a model at all")
