"""Networks in the form of TensorFlow.js's graph models, a `.json` beside its `.bin`, as networks of ONNX.

The operations are those of plain convolutional networks. A graph model's pictures are (N, H, W, C); here they are
(N, C, H, W), and as large as one likes: the operations are local, but for means over the whole picture.
"""

import base64
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
ACTIVATIONS = {"Relu": "Relu", "Relu6": "Clip", "Sigmoid": "Sigmoid"}
ARITHMETIC = {"Add": "Add", "AddV2": "Add", "Mul": "Mul", "Sub": "Sub", "Identity": "Identity"}

Array = npt.NDArray[Any]
Node = Mapping[str, Any]


def to_onnx(path: Path, outputs: Sequence[str]) -> onnx.ModelProto:
    """Convert what the named `outputs` of a graph model need; raises ValueError for an operation that is not known."""
    document = json.loads(path.read_text(encoding="utf-8"))
    nodes = {node["name"]: node for node in document["modelTopology"]["node"]}
    converter = _Converter(nodes, constants(document, path.parent))
    for output in outputs:
        converter.add(output)
    read = {name for node in converter.made for name in node.input}
    graph = helper.make_graph(
        converter.made,
        path.stem,
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, [None, 3, None, None]) for name in converter.inputs],
        [helper.make_tensor_value_info(output, TensorProto.FLOAT, [None] * 4) for output in outputs],
        [tensor for tensor in converter.initializers if tensor.name in read],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model)
    return model


def constants(document: Mapping[str, Any], folder: Path) -> dict[str, Array]:
    """Every weight of a graph model by its name, float32 or int32; half precision is all that they may be packed in."""
    found = {}
    for group in document["weightsManifest"]:
        packed = b"".join((folder / name).read_bytes() for name in group["paths"])
        offset = 0
        for weight in group["weights"]:
            stored = np.dtype(weight.get("quantization", weight)["dtype"]).newbyteorder("<")
            count = int(np.prod(weight["shape"], dtype=np.int64))
            values = np.frombuffer(packed, stored, count, offset)
            offset += values.nbytes
            found[weight["name"]] = values.astype(weight["dtype"]).reshape(weight["shape"])
    return found


class _Converter:
    """Nodes of ONNX by their names in the graph model, each made after those that it reads."""

    def __init__(self, nodes: Mapping[str, Node], weights: Mapping[str, Array]) -> None:
        self._nodes, self._weights = nodes, weights
        self._done: set[str] = set()
        self.inputs: list[str] = []
        self.made: list[onnx.NodeProto] = []
        self.initializers: list[onnx.TensorProto] = []

    def add(self, output: str) -> None:
        """Make a node and all before it, those that need nothing first."""
        waiting = [output]
        while waiting:
            name = waiting[-1]
            before = [reads for reads in self._nodes[name].get("input", []) if reads not in self._done]
            if before and name not in self._done:
                waiting += before
                continue
            waiting.pop()
            if name not in self._done:
                self._done.add(name)
                self._make(self._nodes[name])

    def _make(self, node: Node) -> None:
        name, kind, reads = node["name"], node["op"], node.get("input", [])
        if kind == "Placeholder":
            self.inputs.append(name)
        elif kind == "Const":
            self._constant(name, self._weights[name])
        elif kind in ARITHMETIC:
            self._emit(ARITHMETIC[kind], reads, name)
        elif kind in ACTIVATIONS:
            self._activate(kind, reads[0], name)
        elif kind == "ConcatV2":
            self._emit("Concat", reads[:-1], name, axis=1)
        elif kind == "Mean":
            self._emit("ReduceMean", reads[:1], name, axes=[2, 3], keepdims=1)
        elif kind == "ResizeBilinear":
            self._double(node)
        elif "Conv" in kind:
            self._convolve(node)
        else:
            raise ValueError(f"{name} is a {kind}, which this conversion does not know")

    def _convolve(self, node: Node) -> None:
        """A convolution, with what is fused with it: a bias, and an activation."""
        name, (reads, kernel, *bias) = node["name"], node["input"]
        weights = self._weights[kernel]
        is_by_channel = "epthwise" in node["op"]
        if is_by_channel:
            height, width, channels, multiplier = weights.shape
            weights = weights.reshape(height, width, 1, channels * multiplier)
        self._constant(f"{name}/kernel", weights.transpose(3, 2, 0, 1))
        fused = [operation for operation in _texts(node, "fused_ops") if operation != "BiasAdd"]
        self._emit(
            "Conv",
            [reads, f"{name}/kernel", *bias],
            f"{name}/plain" if fused else name,
            strides=_integers(node, "strides")[1:3],
            dilations=(_integers(node, "dilations") or [1, 1, 1, 1])[1:3],
            group=channels if is_by_channel else 1,
            auto_pad={"SAME": "SAME_UPPER", "VALID": "VALID"}[_text(node["attr"]["padding"]["s"])],
        )
        if fused:
            self._activate(fused[0], f"{name}/plain", name)

    def _activate(self, kind: str, reads: str, name: str) -> None:
        bounds = []
        if kind == "Relu6":
            bounds = [f"{name}/least", f"{name}/most"]
            for bound, value in zip(bounds, (0.0, 6.0), strict=True):
                self._constant(bound, np.float32(value))
        self._emit(ACTIVATIONS[kind], [reads, *bounds], name)

    def _double(self, node: Node) -> None:
        """A feature map twice as large: sizes are of a picture of one size, the factor is that of any."""
        name = node["name"]
        self._constant(f"{name}/scales", np.array([1, 1, 2, 2], np.float32))
        is_centred = node["attr"].get("half_pixel_centers", {}).get("b", False)
        rule = "half_pixel" if is_centred else "asymmetric"
        self._emit(
            "Resize",
            [node["input"][0], "", f"{name}/scales"],
            name,
            mode="linear",
            coordinate_transformation_mode=rule,
        )

    def _constant(self, name: str, value: Array | np.float32) -> None:
        self.initializers.append(numpy_helper.from_array(np.ascontiguousarray(value), name))

    def _emit(self, kind: str, reads: Sequence[str], name: str, **attributes: Any) -> None:
        self.made.append(helper.make_node(kind, list(reads), [name], name=name, **attributes))


def _integers(node: Node, attribute: str) -> list[int]:
    return [int(value) for value in node["attr"].get(attribute, {}).get("list", {}).get("i", [])]


def _texts(node: Node, attribute: str) -> list[str]:
    return [_text(value) for value in node["attr"].get(attribute, {}).get("list", {}).get("s", [])]


def _text(encoded: str) -> str:
    return base64.b64decode(encoded).decode()
