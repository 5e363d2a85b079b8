"""A graph model of TensorFlow.js that sees what is red: its heatmap is the redness, its boxes have 16 pixels a side."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.detection import COCO, HEATMAP, SIZES, STRIDE_PX

CLASS_NAME = "dining table"
HALF_PX = 8.0


def write(folder: Path) -> Path:
    """Write the graph model; return its file."""
    redness = np.zeros((STRIDE_PX, STRIDE_PX, 3, len(COCO)), np.float32)
    redness[..., COCO.index(CLASS_NAME)] = np.array([1.0, -1.0, -1.0]) / (255 * STRIDE_PX**2)
    none = np.zeros((STRIDE_PX, STRIDE_PX, 3, 4), np.float32)
    return write_graph(
        folder / "detector.json",
        {"redness": redness, "no_class": np.zeros(len(COCO), np.float32), "none": none},
        {"half": np.full(4, HALF_PX, np.float32)},
        [
            convolution(HEATMAP, ["picture", "redness", "no_class"], STRIDE_PX, fused=("BiasAdd", "Relu")),
            convolution(SIZES, ["picture", "none", "half"], STRIDE_PX, fused=("BiasAdd",)),
        ],
    )


def convolution(
    name: str, reads: list[str], stride: int, *, fused: tuple[str, ...] = (), **more: str
) -> dict[str, Any]:
    """A node of a graph model that convolves."""
    return {
        "name": name,
        "op": more.get("op", "_FusedConv2D"),
        "input": reads,
        "attr": {
            "strides": {"list": {"i": ["1", str(stride), str(stride), "1"]}},
            "padding": {"s": text(more.get("padding", "SAME"))},
            "fused_ops": {"list": {"s": [text(operation) for operation in fused]}},
        },
    }


def text(word: str) -> str:
    """A word as attributes have it."""
    return base64.b64encode(word.encode()).decode()


def write_graph(
    path: Path, halves: dict[str, np.ndarray], singles: dict[str, np.ndarray], nodes: list[dict[str, Any]]
) -> Path:
    """Write a graph model of these nodes, of which `picture` is the input: weights in half or full precision."""
    packed, listed = b"", []
    for weights, stored in ((halves, "<f2"), (singles, None)):
        for name, values in weights.items():
            packed += values.astype(stored or values.dtype).tobytes()
            described = {"name": name, "shape": list(values.shape), "dtype": values.dtype.name}
            listed.append(described | ({"quantization": {"dtype": "float16"}} if stored else {}))
    constants = [{"name": name, "op": "Const"} for name in (*halves, *singles)]
    document = {
        "modelTopology": {"node": [{"name": "picture", "op": "Placeholder"}, *constants, *nodes]},
        "weightsManifest": [{"paths": [f"{path.stem}.bin"], "weights": listed}],
    }
    path.with_suffix(".bin").write_bytes(packed)
    path.write_text(json.dumps(document))
    return path
