"""GLB files, whole and broken."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot_scenes.gltf import load_scene
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.glb import Glb


def test_a_room_comes_back_in_the_map_frame(tmp_path: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    table = next(instance for instance in scene.instances if instance.name == "table top")
    assert (table.class_name, table.is_group) == ("table", False)
    corners = scene.vertices[scene.triangles[scene.triangle_instance == table.index]].reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx([2.2, 1.2, 0.70], abs=1e-5)
    assert corners.max(axis=0) == pytest.approx([3.4, 2.0, 0.74], abs=1e-5)
    assert [instance.index for instance in scene.instances] == list(range(1, len(scene.instances) + 1))
    assert np.allclose(np.linalg.norm(scene.normals, axis=1), 1.0, atol=1e-4)


def test_materials_keep_their_extensions(tmp_path: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    assert [material.is_glass for material in scene.materials].count(True) == 1
    lamp = next(material for material in scene.materials if material.is_emissive)
    assert lamp.emission == pytest.approx((12.0, 9.0, 6.0))
    (color_image,) = {m.base_color_image for m in scene.materials if m.base_color_image is not None}
    assert scene.images[color_image].shape == (64, 64, 4)


def test_structure_has_no_class(tmp_path: Path) -> None:
    glb = Glb()
    glb.box("plain", (0, 0, 0), (1, 1, 1), glb.material(), extras=False)
    (instance,) = load_scene(glb.write(tmp_path / "a.glb")).instances
    assert (instance.index, instance.name, instance.class_name) == (1, "plain", None)


def test_nodes_may_be_nested_turned_scaled_and_mirrored(tmp_path: Path) -> None:
    glb = Glb()
    glb.box("box", (0, 0, 0), (1, 1, 1), glb.material())
    glb.nodes[0] |= {"scale": [-2.0, 1.0, 1.0]}
    half_turn_about_y = [0.0, 1.0, 0.0, 0.0]
    glb.nodes.append({"children": [0], "translation": [10.0, 0.0, 0.0], "rotation": half_turn_about_y})
    path = glb.write(tmp_path / "a.glb")
    scene = load_scene(_edit(path, lambda document: document["scenes"][0].update(nodes=[1])))
    assert scene.vertices.min(axis=0) == pytest.approx([10.0, -1.0, 0.0], abs=1e-6)
    assert scene.vertices.max(axis=0) == pytest.approx([12.0, 0.0, 1.0], abs=1e-6)
    corner = scene.vertices[scene.triangles]
    outward = corner.mean(axis=1) - scene.vertices.mean(axis=0)
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert ((outward * facing).sum(axis=1) > 0).all()
    assert ((outward * scene.normals[scene.triangles[:, 0]]).sum(axis=1) > 0).all()


def test_the_hash_tells_scenes_apart(tmp_path: Path) -> None:
    def scene(color: float, size: float) -> str:
        glb = Glb()
        glb.box("box", (0, 0, 0), (size, 1, 1), glb.material((color, 0, 0)))
        return load_scene(glb.write(tmp_path / "a.glb")).content_hash

    assert scene(0.5, 1) == scene(0.5, 1)
    assert len({scene(0.5, 1), scene(0.6, 1), scene(0.5, 2)}) == 3


def test_a_missing_file_says_where_it_is_named(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError) as caught:
        load_scene(tmp_path / "nowhere.glb")
    assert "nowhere.glb" in caught.value.title
    assert "map_path" in caught.value.why


@pytest.mark.parametrize("content", [b"", b"glTF", b"<html>not found</html>", b"glTF" + struct.pack("<II", 2, 10**6)])
def test_what_is_not_a_glb_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(content)
    with pytest.raises(BenchbotError, match=r"not a valid GLB"):
        load_scene(path)


def test_a_scene_without_triangles_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError) as caught:
        load_scene(Glb().write(tmp_path / "a.glb"))
    assert "no triangles" in caught.value.why


def test_what_is_not_supported_is_named(tmp_path: Path) -> None:
    path = rooms.plaza(tmp_path / "a.glb")
    with pytest.raises(BenchbotError) as caught:
        load_scene(_edit(path, lambda document: document.update(extensionsRequired=["KHR_draco_mesh_compression"])))
    assert "KHR_draco_mesh_compression" in caught.value.why


def test_nodes_in_a_ring_are_refused(tmp_path: Path) -> None:
    path = rooms.plaza(tmp_path / "a.glb")
    with pytest.raises(BenchbotError) as caught:
        load_scene(_edit(path, lambda document: document["nodes"][0].update(children=[0])))
    assert "tree" in caught.value.why


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rooms.plaza(tmp_path_factory.mktemp("plaza") / "plaza.glb")


@settings(max_examples=60, deadline=None)
@given(place=st.floats(0, 1, exclude_max=True), byte=st.integers(0, 255), cut=st.floats(0, 1))
def test_damage_never_gives_a_traceback(whole: Path, place: float, byte: int, cut: float) -> None:
    data = bytearray(whole.read_bytes())
    data[int(place * len(data))] = byte
    damaged = whole.with_name("damaged.glb")
    damaged.write_bytes(bytes(data[: int((0.5 + cut) * len(data))]))
    try:
        load_scene(damaged)
    except BenchbotError as error:
        assert error.fix  # noqa: PT017 - damage may also go unnoticed


def _edit(path: Path, change: object) -> Path:
    """Change the JSON chunk of a GLB file in place."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + size])
    change(document)  # type: ignore[operator]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    header = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON")
    path.write_bytes(header + text + rest)
    return path
