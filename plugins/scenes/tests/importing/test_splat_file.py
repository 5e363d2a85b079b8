"""Files of splats: what trainers write, and what is none."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import splat_file
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.trained import write_ply
from plugins.scenes.tests.test_gltf_splats import assert_same
from plugins.scenes.tests.test_splats import cloud


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_what_a_trainer_writes_is_read(tmp_path: Path, degree: int) -> None:
    splats = cloud(0)
    if degree == 0:
        splats = replace(splats, color_slopes=np.zeros_like(splats.color_slopes))
    found, notes = splat_file.read(write_ply(tmp_path / "point_cloud.ply", splats, degree))
    assert_same(found, splats)
    assert any("up to degree 1 are kept" in note for note in notes) == (degree > 1)


def test_splats_that_are_no_numbers_or_cannot_be_seen_are_left_out(tmp_path: Path) -> None:
    splats = cloud(0, 1000)
    splats.positions_m[3, 1] = np.nan
    splats.scales_m[4, 0] = 1e7
    splats.opacities[5] = 0.001
    found, notes = splat_file.read(write_ply(tmp_path / "point_cloud.ply", splats))
    assert found.count == 997
    assert any("2 splats with numbers that are none" in note for note in notes)
    assert any("1 splats that cannot be seen" in note for note in notes)


def without(name: str) -> Callable[[bytes], bytes]:
    return lambda data: data.replace(f"property float {name}\n".encode(), f"property float other_{name}\n".encode())


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (without("opacity"), "lack opacity: it is incomplete"),
        (without("rot_2"), "lack rot_2"),
        (without("f_rest_44"), "44 properties f_rest_"),
        (lambda data: data[:-200], "should have 20 splats but ends after 19"),
        (lambda data: data[: data.index(b"end_header")], "head of a PLY file"),
        (lambda data: data.replace(b"vertex 20", b"vertex 0"), "holds no splats"),
        (lambda data: data.replace(b"vertex 20", b"vertex 9000000"), "too many splats"),
        (lambda data: data.replace(b"vertex 20", b"vertex -1"), "list of vertices"),
        (lambda data: data.replace(b"element vertex", b"element chunk"), "compressed splats"),
        (lambda data: data.replace(b"binary_little_endian", b"ascii"), "format ascii"),
        (lambda data: data.replace(b"property float nx", b"property list uchar int nx"), "no single numbers"),
        (lambda data: data.replace(b"property float ny", b"property float nx"), "the same name"),
        (lambda _: b"not a file of points", "head of a PLY file"),
        (lambda _: b"", "is empty"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, damage: Callable[[bytes], bytes], said: str) -> None:
    path = write_ply(tmp_path / "point_cloud.ply", cloud(0))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(BenchbotError) as refused:
        splat_file.read(path)
    assert said in f"{refused.value}"
    assert refused.value.fix


@pytest.mark.parametrize(("name", "value"), [("positions_m", np.nan), ("scales_m", np.inf), ("scales_m", 1e8)])
def test_a_training_that_diverged_is_refused(tmp_path: Path, name: str, value: float) -> None:
    splats = cloud(0)
    getattr(splats, name)[::5] = value
    with pytest.raises(BenchbotError, match="numbers that are none"):
        splat_file.read(write_ply(tmp_path / "point_cloud.ply", splats))


def test_a_mesh_is_no_file_of_splats(tmp_path: Path) -> None:
    path = places.write(tmp_path / "flat.ply", places.flat(), up="z")
    with pytest.raises(BenchbotError, match="a mesh or a point cloud"):
        splat_file.read(path)


def test_splats_that_nobody_sees_are_refused(tmp_path: Path) -> None:
    splats = cloud(0)
    splats.opacities[:] = 0.001
    with pytest.raises(BenchbotError, match="can be seen"):
        splat_file.read(write_ply(tmp_path / "point_cloud.ply", splats))
