"""What is broken, hostile or no scene at all is refused with a reason and a way out, or used as far as it is sound."""

import io
import json
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image

from benchbot.core.errors import BenchbotError
from benchbot_scenes.importing import reading
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.understanding import convert, understand
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.places import trimesh

OUTSIDE = [
    "../../etc/passwd",
    "/etc/passwd",
    "http://127.0.0.1/a.png",
    "file:///etc/passwd",
    "C:\\a.png",
    "%2e%2e/a.png",
    "~/a.png",
    "..\\..\\a.png",
]
SQUARE = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 1\nvt 0 0\n"


def _refused(path: Path) -> BenchbotError:
    with pytest.raises(BenchbotError) as caught:
        understand(path, Guesses())
    assert caught.value.title
    assert caught.value.why
    assert caught.value.fix
    return caught.value


@pytest.mark.parametrize("suffix", reading.SUFFIXES)
def test_an_empty_file_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.touch()
    assert "empty" in _refused(path).title


@pytest.mark.parametrize("suffix", [suffix for suffix in reading.SUFFIXES if suffix not in (".obj", ".usd")])
def test_a_truncated_file_is_refused(tmp_path: Path, suffix: str) -> None:
    path = places.write(tmp_path / f"a{suffix}", places.flat())
    whole = path.read_bytes()
    for share in (0.2, 0.6, 0.98):
        path.write_bytes(whole[: int(share * len(whole))])
        assert "not a" in _refused(path).title


def test_an_obj_file_that_was_cut_short_is_used_as_far_as_it_goes_and_says_so(tmp_path: Path) -> None:
    path = places.write(tmp_path / "a.obj", places.flat())
    text = path.read_text()
    path.write_text(text[: text.index("f ", int(0.9 * len(text))) + 3])
    assert "cut short" in understand(path, Guesses()).notes[0]


@pytest.mark.parametrize("uri", OUTSIDE)
def test_textures_from_outside_are_refused(tmp_path: Path, uri: str) -> None:
    (tmp_path / "a.mtl").write_text(f"newmtl m\nmap_Kd {uri}\n")
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/1 3/1 4/1\n")
    assert "outside its folder" in _refused(path).title


@pytest.mark.parametrize("uri", OUTSIDE)
@pytest.mark.parametrize("key", ["buffers", "images"])
def test_buffers_and_images_from_outside_are_refused(tmp_path: Path, uri: str, key: str) -> None:
    path = places.write(tmp_path / "a.gltf", places.flat())
    document = json.loads(path.read_text())
    if key == "images":
        document[key] = [{}]
    document[key][0]["uri"] = uri
    path.write_text(json.dumps(document))
    assert "outside its folder" in _refused(path).title


@pytest.mark.parametrize("uri", OUTSIDE)
@pytest.mark.parametrize("way", ["references", "payload", "subLayers"])
def test_layers_from_outside_are_refused_before_they_are_opened(tmp_path: Path, uri: str, way: str) -> None:
    path = tmp_path / "a.usda"
    head = f"(\n    subLayers = [@{uri}@]\n)\n" if way == "subLayers" else ""
    prim = "" if way == "subLayers" else f'def "A" ({way} = @{uri}@) {{}}\n'
    path.write_text(f"#usda 1.0\n{head}{prim}")
    assert "outside its folder" in _refused(path).title


def test_a_link_out_of_the_folder_is_outside_too(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"secret")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "a.png").symlink_to(tmp_path / "secret.png")
    (inner / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    (inner / "a.obj").write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/1 3/1 4/1\n")
    assert "outside its folder" in _refused(inner / "a.obj").title


def test_missing_textures_and_materials_are_noted(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd wood.png\n")
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib a.mtl\nmtllib b.mtl\n{SQUARE}usemtl m\nf 1/1 2/1 3/1 4/1\n")
    notes = " ".join(understand(path, Guesses()).notes)
    assert "wood.png" in notes
    assert "b.mtl" in notes


def test_a_texture_that_is_no_picture_is_noted(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"no picture")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/1 3/1 4/1\n")
    assert "no usable picture" in understand(path, Guesses()).notes[0]


def test_a_picture_that_unpacks_to_far_too_much_is_no_picture(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("1", (20000, 20000)).save(stream, "PNG")
    (tmp_path / "a.png").write_bytes(stream.getvalue())
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/1 3/1 4/1\n")
    assert "no usable picture" in understand(path, Guesses()).notes[0]


def test_a_compressed_package_is_refused_without_unpacking_it(tmp_path: Path) -> None:
    path = tmp_path / "bomb.usdz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.usda", b"#usda 1.0\n" + b" " * 20_000_000)
    assert path.stat().st_size < 100_000
    assert "compressed" in _refused(path).why


def test_a_package_that_claims_more_than_it_has_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.usdz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("a.usda", b"#usda 1.0\n")
    data = bytearray(path.read_bytes())
    central = data.index(b"PK\x01\x02")
    struct.pack_into("<II", data, central + 20, 2**31, 2**31)
    path.write_bytes(bytes(data))
    assert "more bytes" in _refused(path).why


def test_a_point_cloud_is_told_from_a_mesh(tmp_path: Path) -> None:
    path = tmp_path / "cloud.ply"
    trimesh.PointCloud(np.random.default_rng(0).random((50, 3))).export(path)
    assert "mesh of the points" in _refused(path).fix


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_corners_that_are_no_places_are_left_out(tmp_path: Path, suffix: str, value: float) -> None:
    mesh = trimesh.creation.box((3, 4, 2.5))
    mesh.vertices[0] = value
    path = tmp_path / f"a{suffix}"
    with np.errstate(all="ignore"):
        mesh.export(path)
    understood = understand(path, Guesses(units="m", up="z"))
    assert np.isfinite(understood.geometry.vertices).all()
    assert 0 < len(understood.geometry.triangles) < 12
    assert "no places" in understood.notes[0]


def test_surveyed_places_keep_their_shape(tmp_path: Path) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
    near = mesh.vertices.copy()
    path = tmp_path / "far.obj"
    path.write_text(
        "\n".join([f"v {x + 454321.0:.9f} {y + 5234567.0:.9f} {z + 1234.0:.9f}" for x, y, z in near])
        + "\n"
        + "\n".join(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces)
        + "\n"
    )
    understood = understand(path, Guesses(units="m", up="z", floor_z_m=-2.0))
    found = understood.geometry.vertices[understood.geometry.triangles].astype(float)
    longest = np.linalg.norm(found[:, 0] - found[:, 1], axis=1).max()
    assert longest == pytest.approx(mesh.edges_unique_length.max(), abs=1e-5)
    assert "moved by" in understood.notes[0]


@pytest.mark.parametrize("factor", [0.0, 1e-6, 1e6])
def test_what_is_no_room_is_refused(tmp_path: Path, factor: float) -> None:
    mesh = trimesh.creation.box((3, 4, 2.5))
    mesh.vertices *= factor
    path = tmp_path / "a.ply"
    mesh.export(path)
    with pytest.raises(BenchbotError):
        understand(path, Guesses(units="m"))


def test_a_mesh_with_holes_is_a_scene(tmp_path: Path) -> None:
    mesh = trimesh.util.concatenate([box.mesh.subdivide().subdivide() for box in places.flat()])
    kept = np.random.default_rng(0).random(len(mesh.faces)) > 0.1
    mesh.update_faces(kept)
    path = tmp_path / "holes.stl"
    mesh.apply_scale(1000.0)
    mesh.export(path)
    understood = understand(path, Guesses())
    assert (understood.unit, understood.up) == ("mm", "z")
    assert understood.floor_z_m == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.obj", "v 0 0 0\nv 1 1 1\n", "no faces"),
        ("a.obj", "v 0 0 x\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "'x'"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "not there"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "not there"),
        ("a.gltf", "[1, 2]", "list"),
        ("a.usda", "#usda 1.0\n", "visible"),
        ("a.ply", "ply\nformat ascii 1.0\nend_header\n", ""),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, name: str, content: str, why: str) -> None:
    path = tmp_path / name
    path.write_text(content)
    assert why in _refused(path).why


@pytest.mark.parametrize("extension", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu"])
def test_compressed_gltf_says_how_to_export_without(tmp_path: Path, extension: str) -> None:
    path = places.write(tmp_path / "a.gltf", places.flat())
    document = json.loads(path.read_text()) | {"extensionsRequired": [extension]}
    path.write_text(json.dumps(document))
    assert "gltf-transform" in _refused(path).why


@pytest.mark.parametrize("corner", [-1, -(2**31), 8, 2**31 - 1])
def test_a_triangle_between_points_that_are_not_there_is_refused(tmp_path: Path, corner: int) -> None:
    path = tmp_path / "a.ply"
    head = trimesh.creation.box((3, 4, 2.5)).export(file_type="ply", vertex_normal=False)
    path.write_bytes(head[:-12] + struct.pack("<3i", 0, 1, corner))
    assert "not there" in _refused(path).why


@settings(max_examples=40, deadline=None)
@example(suffix=".ply", seed=292, bytes_changed=2)
@given(
    suffix=st.sampled_from([".glb", ".obj", ".ply", ".stl"]),
    seed=st.integers(0, 10**6),
    bytes_changed=st.integers(1, 8),
)
def test_damage_never_gives_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, seed: int, bytes_changed: int
) -> None:
    path = places.write(tmp_path_factory.mktemp("damage") / f"a{suffix}", places.flat()[:3])
    data, rng = bytearray(path.read_bytes()), np.random.default_rng(seed)
    for place in rng.integers(0, len(data), bytes_changed):
        data[place] = rng.integers(0, 256)
    path.write_bytes(bytes(data))
    try:
        convert(path)
    except BenchbotError as error:
        assert error.fix  # noqa: PT017 - damage may also go unnoticed


def test_usd_files_say_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = places.write(tmp_path / "a.usda", places.flat())
    monkeypatch.setitem(sys.modules, "pxr", None)
    assert 'pip install "benchbot-scenes[usd]"' in _refused(path).fix
