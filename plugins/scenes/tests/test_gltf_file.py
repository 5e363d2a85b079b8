"""What real exporters write: sparse accessors, strips and fans, files beside the file."""

import base64
from typing import Any

import numpy as np
import pytest

from benchbot_scenes.gltf import geometry_of
from benchbot_scenes.gltf_file import GltfFile, UnsupportedError

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)


def _document(primitive: dict[str, Any], *arrays: np.ndarray, **extra: Any) -> dict[str, Any]:
    """One mesh, whose accessors are the arrays in turn."""
    kinds = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
    types = {"float32": 5126, "uint8": 5121, "uint16": 5123}
    blob, views, accessors = b"", [], []
    for array in arrays:
        width = 1 if array.ndim == 1 else array.shape[1]
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": types[array.dtype.name],
                "count": len(array),
                "type": kinds[width],
                "normalized": array.dtype == np.uint8,
            }
        )
        blob += array.tobytes() + bytes(-array.nbytes % 4)
    uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    return {
        "buffers": [{"uri": uri, "byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0}],
        **extra,
    }


@pytest.mark.parametrize(("mode", "order"), [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])])
def test_strips_and_fans_face_one_way(mode: int, order: list[int]) -> None:
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}
    geometry, _ = geometry_of(GltfFile(_document(primitive, SQUARE, np.array(order, np.uint16)), b""))
    corners = geometry.vertices[geometry.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # The file's +z is the map's -y.
    assert cross == pytest.approx(np.array([[0, -1, 0], [0, -1, 0]]))


def test_points_and_lines_are_passed_over() -> None:
    document = _document({"attributes": {"POSITION": 0}, "mode": 1}, SQUARE)
    with pytest.raises(UnsupportedError, match="no triangles"):
        geometry_of(GltfFile(document, b""))


def test_a_sparse_accessor_changes_some_of_another() -> None:
    document = _document({"attributes": {}}, SQUARE, np.array([2, 3], np.uint16), SQUARE[:2] + 5)
    document["accessors"][0]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 2},
    }
    assert GltfFile(document, b"").accessor(0).tolist() == [[0, 0, 0], [1, 0, 0], [5, 5, 5], [6, 5, 5]]


def test_a_texture_may_be_moved_turned_and_scaled() -> None:
    uvs = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    transform = {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 4], "texCoord": 1}
    texture = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    document = _document(
        {"attributes": {"POSITION": 0, "TEXCOORD_1": 1}, "mode": 5, "material": 0},
        SQUARE,
        uvs,
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": texture}}],
        textures=[{}],
    )
    geometry, _ = geometry_of(GltfFile(document, b""))
    first = geometry.uvs[geometry.triangles[0]]
    # As the extension's own matrix: scale, then turn clockwise with v downwards, then move.
    assert first == pytest.approx(np.array([[0.5, 0.25], [0.5, -1.75], [4.5, 0.25]]), abs=1e-6)


def test_names_lead_from_the_root_to_the_mesh() -> None:
    document = _document({"attributes": {"POSITION": 0}, "mode": 5}, SQUARE)
    document["nodes"] = [{"name": "Room", "children": [1]}, {"children": [2]}, {"name": "Chair", "mesh": 0}]
    document["meshes"][0]["name"] = "seat"
    document |= {"scenes": [{"nodes": [0]}], "scene": 0}
    assert geometry_of(GltfFile(document, b""))[1] == (("Room", "Chair", "seat"),)


def test_files_beside_are_read_when_that_is_allowed() -> None:
    document = _document({"attributes": {"POSITION": 0}, "mode": 5}, SQUARE)
    document["buffers"][0]["uri"] = "square.bin"
    geometry, _ = geometry_of(GltfFile(document, b"", {"square.bin": SQUARE.tobytes()}.__getitem__))
    assert len(geometry.triangles) == 2
    with pytest.raises(UnsupportedError, match=r"square\.bin"):
        geometry_of(GltfFile(document, b""))


def test_an_older_files_diffuse_colour_is_the_base_colour() -> None:
    gloss = {"diffuseFactor": [0.1, 0.2, 0.3, 1], "glossinessFactor": 0.75}
    document = _document(
        {"attributes": {"POSITION": 0}, "mode": 5, "material": 0},
        SQUARE,
        materials=[{"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}],
    )
    material = geometry_of(GltfFile(document, b""))[0].materials[0]
    assert material.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert (material.roughness, material.metallic) == (0.25, 0.0)


def test_colours_of_vertices_tint_what_has_no_picture() -> None:
    colors = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255]], np.uint8)
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": 5}
    geometry, _ = geometry_of(GltfFile(_document(primitive, SQUARE, colors), b""))
    (number,) = {geometry.materials[m].base_color_image for m in geometry.triangle_material}
    assert number is not None
    image = geometry.images[number]
    u, v = geometry.uvs[geometry.triangles[0]].T
    shown = image[(v * image.shape[0]).astype(int), (u * image.shape[1]).astype(int), :3]
    assert shown.tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]


def test_white_vertices_need_no_picture() -> None:
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": 5}
    geometry, _ = geometry_of(GltfFile(_document(primitive, SQUARE, np.full((4, 4), 255, np.uint8)), b""))
    assert geometry.images == ()
