"""What the ray tracer's benchmark stands on: its scenes, and how it compares pictures."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.scene import SceneGeometry
from benchmarks.rays.cornell import cornell
from benchmarks.rays.measure import Figure, interleave
from benchmarks.rays.mitsuba_scene import without_panes
from benchmarks.rays.peers.job import Job
from benchmarks.rays.picture_error import shrunk, ssim
from benchmarks.rays.scene import generate


@pytest.mark.parametrize("wanted", [20_000, 200_000])
def test_a_scene_has_about_the_triangles_that_were_asked_for(wanted: int) -> None:
    assert len(generate(wanted).triangles) == pytest.approx(wanted, rel=0.1)


def test_a_scene_is_that_of_its_seed() -> None:
    assert generate(6000, seed=5).content_hash == generate(6000, seed=5).content_hash
    assert generate(6000, seed=5).content_hash != generate(6000, seed=6).content_hash


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_surfaces_are_closed_and_face_outwards(seed: int) -> None:
    """Oriented areas of a closed surface add up to nothing, and its volume is positive."""
    assert_closed(generate(8000, seed))


def test_cornells_box_is_closed_too() -> None:
    assert_closed(cornell())


def assert_closed(scene: SceneGeometry) -> None:
    corner = scene.vertices[scene.triangles].astype(np.float64)
    area = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    volume = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6
    for instance in scene.instances:
        mine = scene.triangle_instance == instance.index
        assert np.abs(area[mine].sum(axis=0)).max() < 1e-3 * np.linalg.norm(area[mine], axis=1).sum()
        assert volume[mine].sum() > 0


def test_a_room_without_panes_keeps_all_else() -> None:
    scene = generate(6000)
    glass = replace(scene.materials[0], transmission=1.0)
    opened = without_panes(replace(scene, materials=(glass, *scene.materials[1:])))
    assert set(opened.triangle_instance) == set(scene.triangle_instance) - {1}


def job(measure: str, peer: str, work: int, answer: list[float]) -> Job:
    return Job(measure, peer, work, lambda: sum(range(2000)), lambda _: np.array(answer))


def test_figures_say_how_many_answers_are_ours() -> None:
    jobs = [job("primary", "ours", 10, [1, 1, 0, 0]), job("primary", "theirs", 10, [1, 1, 1, 0])]
    ours, theirs = interleave(jobs, rounds=2, triangles=7)
    assert isinstance(ours, Figure)
    assert (ours.same, theirs.same) == (1.0, 0.75)
    assert (ours.ours_over_it_wall, ours.ours_over_it_processor) == (1.0, 1.0)
    assert theirs.triangles == 7


def test_a_picture_traced_by_others_is_compared_by_its_mean() -> None:
    jobs = [job("path", "ours", 10, [0.5, 0.5, 0.5]), job("path", "theirs", 10, [0.6, 0.5, 0.4])]
    assert interleave(jobs, rounds=1, triangles=1)[1].same == pytest.approx(0)


def test_similarity_is_one_for_equals_and_falls_with_noise() -> None:
    random = np.random.default_rng(1)
    picture = random.uniform(size=(48, 64, 3))
    noisy = np.clip(picture + random.normal(scale=0.1, size=picture.shape), 0, 1)
    noisier = np.clip(picture + random.normal(scale=0.3, size=picture.shape), 0, 1)
    assert ssim(picture, picture) == pytest.approx(1)
    assert 1 > ssim(picture, noisy) > ssim(picture, noisier)


def test_shrinking_keeps_the_mean() -> None:
    picture = np.random.default_rng(1).uniform(size=(8, 12, 3))
    assert shrunk(picture).shape == (2, 3, 3)
    assert shrunk(picture).mean(axis=(0, 1)) == pytest.approx(picture.mean(axis=(0, 1)))
