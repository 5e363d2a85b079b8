"""Graph models compute as ONNX what their operations say."""

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
from scipy.signal import correlate2d

from benchmarks.graph_models import to_onnx
from tests.benchmarks.made_detector import convolution, write_graph

RANDOM = np.random.default_rng(5)
PICTURE = RANDOM.normal(size=(1, 3, 10, 14)).astype(np.float32)


def run(path: Path, output: str) -> np.ndarray:
    model = to_onnx(path, [output]).SerializeToString()
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    (value,) = session.run([output], {"picture": PICTURE})
    return np.asarray(value)


def test_a_convolution_pads_as_tensorflow_does_and_adds_and_clips_what_is_fused(tmp_path: Path) -> None:
    """With stride 2 an even size is padded at its end only."""
    kernel = (RANDOM.integers(-8, 8, (3, 3, 3, 2)) / 4).astype(np.float32)
    bias = np.array([0.5, -1.0], np.float32)
    node = convolution("out", ["picture", "kernel", "bias"], 2, fused=("BiasAdd", "Relu6"))
    path = write_graph(tmp_path / "one.json", {"kernel": kernel, "bias": bias}, {}, [node])
    padded = np.pad(PICTURE[0], ((0, 0), (0, 1), (0, 1)))
    plain = [
        sum(correlate2d(padded[channel], kernel[:, :, channel, output], "valid")[::2, ::2] for channel in range(3))
        for output in range(2)
    ]
    assert run(path, "out")[0] == pytest.approx(np.clip(np.array(plain) + bias[:, None, None], 0, 6), abs=1e-4)


def test_a_depthwise_convolution_keeps_channels_apart(tmp_path: Path) -> None:
    kernel = RANDOM.normal(size=(1, 1, 3, 1)).astype(np.float32)
    node = convolution("out", ["picture", "kernel"], 1, op="DepthwiseConv2dNative", padding="VALID")
    path = write_graph(tmp_path / "one.json", {}, {"kernel": kernel}, [node])
    assert run(path, "out") == pytest.approx(PICTURE * kernel.reshape(1, 3, 1, 1), abs=1e-5)


def test_what_is_between_convolutions(tmp_path: Path) -> None:
    """A picture twice as large beside itself scaled by its channels' means."""
    nodes: list[dict[str, Any]] = [
        {"name": "mean", "op": "Mean", "input": ["picture", "axes"]},
        {"name": "half", "op": "Mul", "input": ["mean", "factor"]},
        {"name": "scaled", "op": "AddV2", "input": ["picture", "half"]},
        {"name": "both", "op": "ConcatV2", "input": ["picture", "scaled", "axis"]},
        {"name": "large", "op": "ResizeBilinear", "input": ["both", "size"], "attr": {}},
        {"name": "out", "op": "Sigmoid", "input": ["large"]},
    ]
    integers = {"axes": np.array([1, 2], np.int32), "axis": np.array(3, np.int32), "size": np.array([20, 28], np.int32)}
    path = write_graph(tmp_path / "one.json", {"factor": np.array(0.5, np.float32)}, integers, nodes)
    scaled = PICTURE + 0.5 * PICTURE.mean(axis=(2, 3), keepdims=True)
    both = np.concatenate([PICTURE, scaled], axis=1)
    found = run(path, "out")
    assert found.shape == (1, 6, 20, 28)
    assert found[:, :, ::2, ::2] == pytest.approx(1 / (1 + np.exp(-both)), abs=1e-5)
    between = (both[:, :, :, 1:] + both[:, :, :, :-1]) / 2
    assert found[:, :, ::2, 1:-1:2] == pytest.approx(1 / (1 + np.exp(-between)), abs=1e-5)


def test_an_operation_that_is_not_known_is_named(tmp_path: Path) -> None:
    path = write_graph(tmp_path / "one.json", {}, {}, [{"name": "out", "op": "FloorMod", "input": ["picture"]}])
    with pytest.raises(ValueError, match="out is a FloorMod"):
        to_onnx(path, ["out"])
