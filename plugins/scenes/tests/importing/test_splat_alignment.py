"""Splats that are not where the mesh is: found, and told apart from those that are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchbot_scenes.importing import reading, splat_alignment, understanding
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.splat_alignment import Alignment
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.splats import Splats, transformed
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.trained import on_mesh, write_ply
from plugins.scenes.tests.test_gltf_splats import assert_same

pytestmark = pytest.mark.xdist_group("renderer")

POSES = [[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2), x, y, 0.0] for x, y, yaw in ((1.0, 0.8, 0.4), (2.8, 1.4, 2.0))]


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> SceneGeometry:
    path = places.write(tmp_path_factory.mktemp("flat") / "flat.glb", places.flat(window=False))
    found = understanding.understand(path, Guesses(units="m", up="y", floor_z_m=0.0)).geometry
    return replace(found, splats=on_mesh(found, per_m2=500.0))


def measured(flat: SceneGeometry, splats: Splats, cache: Path) -> Alignment:
    found = splat_alignment.measure(replace(flat, splats=splats), POSES, cache)
    assert found is not None
    return found


def test_splats_on_the_mesh_agree_with_it(flat: SceneGeometry, kernel_cache: Path) -> None:
    assert flat.splats is not None
    found = measured(flat, flat.splats, kernel_cache)
    assert found.near_share > 0.9
    assert found.opaque_share > 0.99
    assert not found.is_off
    assert not found.is_other_place


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_shift_of_20_cm_is_found_and_measured(flat: SceneGeometry, kernel_cache: Path, axis: int) -> None:
    assert flat.splats is not None
    shift = 0.2 * np.eye(3)[axis]
    found = measured(flat, transformed(flat.splats, offset=shift), kernel_cache)
    assert found.is_off
    np.testing.assert_allclose(found.shift_m, shift, atol=0.03)
    assert abs(found.scale - 1.0) < 0.02
    assert "seem shifted" in found.cause


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_a_wrong_scale_is_found_and_measured(flat: SceneGeometry, kernel_cache: Path, scale: float) -> None:
    assert flat.splats is not None
    found = measured(flat, transformed(flat.splats, scale=scale), kernel_cache)
    assert found.is_off
    assert abs(found.scale - scale) < 0.02
    assert f"scaled by {found.scale:.3f}" in found.cause


@pytest.mark.parametrize(
    "turn", [Rotation.from_euler("x", 90, degrees=True), Rotation.from_euler("x", 180, degrees=True)]
)
def test_another_up_axis_is_another_place(flat: SceneGeometry, kernel_cache: Path, turn: Rotation) -> None:
    assert flat.splats is not None
    found = measured(flat, transformed(flat.splats, turn.as_matrix()), kernel_cache)
    assert found.is_other_place
    assert "No small movement explains it" in found.cause


def test_another_unit_is_another_place(flat: SceneGeometry, kernel_cache: Path) -> None:
    assert flat.splats is not None
    assert measured(flat, transformed(flat.splats, scale=100.0), kernel_cache).is_other_place


@pytest.mark.parametrize(
    ("suffix", "unit", "up"), [(".obj", 100.0, "y"), (".glb", 1.0, "y"), (".stl", 1000.0, "z"), (".ply", 1.0, "z")]
)
def test_splats_go_where_the_mesh_goes(tmp_path: Path, flat: SceneGeometry, suffix: str, unit: float, up: str) -> None:
    """Unit, up axis and floor change both, from whatever frame the files are in."""
    assert flat.splats is not None
    turn = np.eye(3) if up == "z" else np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    slopes = np.random.default_rng(1).normal(size=(flat.splats.count, 3, 3))
    splats = replace(flat.splats, color_slopes=slopes.astype(np.float32))
    lifted = transformed(splats, turn, scale=unit, offset=unit * turn @ [0.0, 0.0, 0.5])
    boxes = [
        replace(box, low=(*box.low[:2], box.low[2] + 0.5), high=(*box.high[:2], box.high[2] + 0.5))
        for box in places.flat(window=False)
    ]
    mesh = places.write(tmp_path / f"flat{suffix}", boxes, unit, up)
    found = understanding.understand(mesh, Guesses(), splats=write_ply(tmp_path / "point_cloud.ply", lifted, 1))
    assert_same(found.geometry.splats, splats)
    assert found.floor_z_m == pytest.approx(0.5, abs=0.01)


def test_splats_follow_a_place_that_is_far_from_its_origin(tmp_path: Path, flat: SceneGeometry) -> None:
    assert flat.splats is not None
    far = (50_000.0, 20_000.0, 0.0)
    boxes = [
        replace(
            box,
            low=tuple(np.add(box.low, far).tolist()),
            high=tuple(np.add(box.high, far).tolist()),
        )
        for box in places.flat(window=False)
    ]
    path = places.write(tmp_path / "flat.obj", boxes, up="z")
    model = reading.read(path)
    assert any(model.origin)
    cloud = write_ply(tmp_path / "point_cloud.ply", transformed(flat.splats, offset=far))
    found = understanding.understand(path, Guesses(units="m", up="z"), splats=cloud).geometry
    assert found.splats is not None
    low, high = found.vertices.min(axis=0), found.vertices.max(axis=0)
    assert (found.splats.positions_m > low - 0.01).all()
    assert (found.splats.positions_m < high + 0.01).all()
