"""The segmenter from its ONNX file, on depth images of boxes, and the mapper that fuses what it says."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchbot.api import ActionResult, Observations
from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError, Pose
from benchbot_baselines.examples.perception_mapper import PerceptionMapper
from benchbot_baselines.features import CHANNELS, features
from benchbot_baselines.network import Weights, random_weights, to_onnx
from benchbot_baselines.segmenter import Segmenter, enlarged, unhidden
from tests.plugins.mapping.casting import BOXES, observe, views

CHAIR = CLASS_LIST.index("chair")


def seen(camera: Pose) -> Observations:
    observations = observe(BOXES, camera)
    observations["image_rgb"] = np.full((*observations["image_depth"].shape, 3), 90, np.uint8)
    return observations


def always(name: str) -> Weights:
    """Return weights of a network that takes everything for one class."""
    weights = random_weights(0)
    kernel, bias = weights["logits"]
    sure = np.zeros_like(bias)
    sure[CLASS_LIST.index(name)] = 3
    return weights | {"logits": (np.zeros_like(kernel), sure)}


@pytest.fixture
def weights_file(tmp_path: Path) -> Path:
    path = tmp_path / "weights.onnx"
    path.write_bytes(to_onnx(random_weights(0)))
    return path


def test_the_file_is_small_enough_for_a_wheel(weights_file: Path) -> None:
    assert weights_file.stat().st_size <= 480_000


def test_each_point_has_probabilities_of_all_classes(weights_file: Path) -> None:
    sighting = Segmenter(weights_file).see(seen(views()[0]))

    assert len(sighting.points) == len(sighting.label_probs) == len(sighting.depth_m) > 100
    assert sighting.label_probs.shape[1] == len(CLASS_LIST)
    assert sighting.label_probs.sum(axis=1) == pytest.approx(1, abs=1e-5)
    assert np.isfinite(sighting.points).all()


def test_the_network_that_is_shipped_knows_the_classes_of_the_tasks() -> None:
    assert list(Segmenter().class_list) == list(CLASS_LIST)


def test_pixels_beside_something_nearer_are_left_out_and_those_of_a_slope_are_not() -> None:
    depth_m = np.tile(np.linspace(3.0, 3.7, 12), (6, 1))
    depth_m[2:4, 5:7] = 1.0
    depth_m[0, 0] = np.nan

    used = unhidden(depth_m)

    hidden = np.zeros_like(used)
    hidden[[1, 1, 2, 2, 3, 3, 4, 4], [5, 6, 4, 7, 4, 7, 5, 6]] = True
    hidden[0, 0] = True
    np.testing.assert_array_equal(used, ~hidden)


@pytest.mark.parametrize("size", [(4, 6), (8, 12), (3, 5)])
def test_an_enlarged_slope_stays_a_slope(size: tuple[int, int]) -> None:
    rows, columns = np.mgrid[0:4, 0:6].astype(np.float32)
    found = enlarged(np.stack([rows, columns], -1), *size)

    for axis, (length, wanted) in enumerate(zip((4, 6), size, strict=True)):
        expected = np.clip((np.arange(wanted) + 0.5) * length / wanted - 0.5, 0, length - 1)
        np.testing.assert_allclose(np.moveaxis(found[..., axis], axis, 0)[:, 0], expected, atol=1e-6)


def test_a_task_without_colours_is_refused(weights_file: Path) -> None:
    blind = seen(views()[0])
    del blind["image_rgb"]

    with pytest.raises(BenchbotError, match="needs image_rgb"):
        Segmenter(weights_file).see(blind)


def test_features_tell_floors_from_walls_and_from_nothing() -> None:
    x, y = np.meshgrid(np.linspace(1, 2, 8), np.linspace(1, -1, 8), indexing="ij")
    floor = np.stack([x[::-1], y, np.zeros_like(x)], -1)
    depth_m = np.full((8, 8), 2.0)
    depth_m[0, 0] = np.inf

    found = features(np.zeros((8, 8, 3), np.uint8), floor, depth_m)

    up, near = found[CHANNELS.index("normal_up")], found[CHANNELS.index("nearness")]
    assert set(up[3:5, 3:5].ravel()) == {255}
    assert near[4, 4] == round(0.25 * 255)
    assert near[0, 0] == 0


def test_the_mapper_says_how_likely_each_class_is(tmp_path: Path) -> None:
    path = tmp_path / "weights.onnx"
    path.write_bytes(to_onnx(always("chair")))
    agent = PerceptionMapper(Segmenter(path))
    for camera in views():
        assert agent.pick_action(seen(camera), ["move_next"]) == ("move_next", {})
    assert agent.is_done(ActionResult.FINISHED)

    agent.save_result(str(tmp_path / "r.json"), {"results": {"objects": [], "class_list": CLASS_LIST}}, {})
    objects = json.loads((tmp_path / "r.json").read_text())["results"]["objects"]
    expected = np.exp(3) / (np.exp(3) + len(CLASS_LIST) - 1)
    assert objects
    for item in objects:
        assert item["label_probs"][CHAIR] == pytest.approx(expected, abs=1e-3)
        assert sum(item["label_probs"]) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(("content", "said"), [(None, "There are no weights"), (b"text", "cannot be run")])
def test_what_is_no_network_is_refused(tmp_path: Path, content: bytes | None, said: str) -> None:
    path = tmp_path / "weights.onnx"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(BenchbotError, match=said):
        Segmenter(path)


def test_a_network_of_another_form_is_refused_with_the_form_that_fits(tmp_path: Path) -> None:
    from onnx import TensorProto, helper

    shape: list[str | int | None] = [1, 3, "h", "w"]
    given, made = (helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name in ("x", "y"))
    graph = helper.make_graph([helper.make_node("Relu", ["x"], ["y"])], "other", [given], [made])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    path = tmp_path / "other.onnx"
    path.write_bytes(model.SerializeToString())

    with pytest.raises(BenchbotError, match="is no segmenter") as caught:
        Segmenter(path)
    assert "uint8" in str(caught.value.fix)
