"""The same flat in every format, unit and axis is the same scene, and what trimesh reads of a file is what we read."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchbot.core.errors import BenchbotError
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing import reading
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.understanding import convert, understand
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.vertex_colors import linear_to_srgb
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.places import trimesh

NAMED = (".glb", ".gltf", ".obj", ".usda", ".usdc", ".usdz")
UNNAMED = (".ply", ".stl")
LOW, HIGH = (-0.1, -0.1, -0.1), (5.1, 4.1, 2.7)


@pytest.mark.parametrize("suffix", [*NAMED, *UNNAMED])
def test_every_format_gives_the_flat_in_metres_with_its_floor_at_zero(tmp_path: Path, suffix: str) -> None:
    path = places.write(tmp_path / f"flat{suffix}", places.flat())
    understood = understand(path, Guesses())
    assert understood.geometry.vertices.min(axis=0) == pytest.approx(LOW, abs=1e-4)
    assert understood.geometry.vertices.max(axis=0) == pytest.approx(HIGH, abs=1e-4)
    expected = places.CLASSES if suffix in NAMED else {}
    found = {thing.name: thing.class_name for thing in understood.recognised.objects if thing.class_name}
    assert found == {name if "usd" not in suffix else name.replace(".", "_"): kind for name, kind in expected.items()}


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "m"), (100.0, "cm"), (1000.0, "mm"), (39.3701, "in")])
@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("suffix", [".obj", ".stl", ".usdc"])
def test_unit_and_axis_are_told(tmp_path: Path, suffix: str, scale: float, unit: str, up: str) -> None:
    understood = understand(places.write(tmp_path / f"flat{suffix}", places.flat(), scale, up), Guesses())
    assert (understood.unit, understood.up) == (unit, up)
    assert understood.size_m == pytest.approx((5.2, 4.2, 2.8), abs=1e-3)


def test_a_gltf_file_in_centimetres_is_found_out(tmp_path: Path) -> None:
    understood = understand(places.write(tmp_path / "flat.glb", places.flat(), 100.0), Guesses())
    assert understood.unit == "cm"
    assert understood.size_m == pytest.approx((5.2, 4.2, 2.8), abs=1e-3)


def test_what_a_person_knows_better_counts(tmp_path: Path) -> None:
    path = places.write(tmp_path / "flat.stl", places.flat(), up="z")
    understood = understand(path, Guesses(units="ft", up="y", floor_z_m=0.5))
    assert understood.size_m == pytest.approx((5.2 * 0.3048, 2.8 * 0.3048, 4.2 * 0.3048), abs=1e-3)
    assert "units" not in understood.reasons


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb"])
def test_triangles_and_their_places_are_those_that_trimesh_reads(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.5)
    ball.visual.vertex_colors = rng.integers(0, 256, (len(ball.vertices), 4), np.uint8)
    path = tmp_path / f"ball{suffix}"
    ball.export(path)
    mine, theirs = reading.read(path).geometry, trimesh.load_scene(path, process=False).to_mesh()
    assert len(mine.triangles) == len(theirs.faces)
    assert _apart(_middles(mine), theirs.triangles_center) < 1e-5


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_colours_of_vertices_are_painted_where_they_are(tmp_path: Path, suffix: str) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=1.5)
    colors = np.column_stack([(ball.vertices + 1.5) / 3.0 * 255, np.full(len(ball.vertices), 255)])
    ball.visual.vertex_colors = colors.astype(np.uint8)
    path = tmp_path / f"ball{suffix}"
    ball.export(path)
    geometry = reading.read(path).geometry
    position = geometry.vertices[geometry.triangles].reshape(-1, 3)
    shown = _texels(geometry).reshape(-1, 3)
    encoded = (position + 1.5) / 3.0
    if suffix == ".glb":  # whose colours are linear by the standard, while images are sRGB
        encoded = linear_to_srgb(np.clip(encoded, 0.0, 1.0))
    assert np.abs(shown / 255.0 - encoded).max() < (0.03 if suffix == ".glb" else 0.006)


def test_a_usd_stage_says_what_unit_it_has(tmp_path: Path) -> None:
    understood = understand(places.write(tmp_path / "flat.usdc", places.flat(), 12.5), Guesses())
    assert understood.unit == pytest.approx(0.08)
    assert understood.reasons["units"] == "the file says so"


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".usdz"])
def test_the_converted_file_is_the_scene_that_was_understood(tmp_path: Path, suffix: str) -> None:
    path = places.write(tmp_path / f"flat{suffix}", places.flat())
    glb = tmp_path / "made.glb"
    glb.write_bytes(convert(path))
    made, understood = load_scene(glb), understand(path, Guesses()).geometry
    assert [(found.name, found.class_name, found.is_group) for found in made.instances] == [
        (found.name, found.class_name, found.is_group) for found in understood.instances
    ]
    assert _apart(_middles(made), _middles(understood)) < 1e-5
    assert [m.double_sided for m in made.materials[:-1]] == [m.double_sided for m in understood.materials]
    assert glb.read_bytes() == convert(path)


def test_an_unknown_kind_says_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "house.blend"
    path.write_bytes(b"BLENDER")
    with pytest.raises(BenchbotError) as caught:
        understand(path, Guesses())
    assert "In Blender" in caught.value.fix


def _middles(geometry: SceneGeometry) -> np.ndarray:
    return np.asarray(geometry.vertices[geometry.triangles].mean(axis=1))


def _apart(first: np.ndarray, second: np.ndarray) -> float:
    """The farthest that a point of one set is from the nearest of the other."""
    return float(max(cKDTree(first).query(second)[0].max(), cKDTree(second).query(first)[0].max()))


def _texels(geometry: SceneGeometry) -> np.ndarray:
    """What bilinear look-up at corners gives: their uvs are middles of texels."""
    (number,) = {geometry.materials[m].base_color_image for m in np.unique(geometry.triangle_material)}
    assert number is not None
    image = geometry.images[number]
    uv = geometry.uvs[geometry.triangles]
    shown: np.ndarray = image[(uv[..., 1] * image.shape[0]).astype(int), (uv[..., 0] * image.shape[1]).astype(int), :3]
    return shown
