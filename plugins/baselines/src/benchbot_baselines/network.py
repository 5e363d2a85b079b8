"""The segmenter's network, as a list of operations that torch runs and ONNX is written from.

An encoder of four levels and a decoder that adds them up; depthwise convolutions keep it below 250,000 weights.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchbot.cli.kit import console
from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError
from benchbot_baselines.features import CHANNELS

WIDTHS = (24, 48, 72, 92)
BLOCKS = (1, 2, 2, 2)
OPSET = 17


@dataclass(frozen=True)
class Conv:
    """A convolution of the tensor `source`, with its bias, then perhaps a rectifier; it has weights of its `name`."""

    name: str
    source: str
    channels_in: int
    channels_out: int
    kernel: int = 1
    stride: int = 1
    groups: int = 1
    rectified: bool = True

    @property
    def padding(self) -> int:
        """Rows added on each side."""
        return 0 if self.kernel == self.stride else self.kernel // 2


@dataclass(frozen=True)
class Add:
    """The sum of two tensors; `upsampled` doubles the second's height and width before."""

    name: str
    one: str
    other: str
    upsampled: bool = False


def program() -> list[Conv | Add]:
    """Return the operations in their order: from `features`, scaled to -1 … 1, to `logits` at half the size."""
    made: list[Conv | Add] = []
    made.append(Conv("stem", "features", len(CHANNELS), WIDTHS[0], kernel=3, stride=2))
    source, levels = "stem", []
    for level, (width, blocks) in enumerate(zip(WIDTHS, BLOCKS, strict=True)):
        if level:
            made.append(Conv(f"down{level}", source, WIDTHS[level - 1], width, kernel=2, stride=2))
            source = f"down{level}"
        for block in range(blocks):
            source = _block(made, f"encode{level}_{block}", source, width)
        levels.append(source)
    for level in reversed(range(len(WIDTHS) - 1)):
        made.append(Conv(f"narrow{level}", source, WIDTHS[level + 1], WIDTHS[level], rectified=False))
        made.append(Add(f"joined{level}", levels[level], f"narrow{level}", upsampled=True))
        source = _block(made, f"decode{level}", f"joined{level}", WIDTHS[level])
    made.append(Conv("logits", source, WIDTHS[0], len(CLASS_LIST), rectified=False))
    return made


def _block(made: list[Conv | Add], name: str, source: str, width: int) -> str:
    made.append(Conv(f"{name}_depthwise", source, width, width, kernel=3, groups=width, rectified=False))
    made.append(Conv(f"{name}_wide", f"{name}_depthwise", width, 2 * width))
    made.append(Conv(f"{name}_out", f"{name}_wide", 2 * width, width, rectified=False))
    made.append(Add(name, source, f"{name}_out"))
    return name


Weights = dict[str, tuple[NDArray[np.float32], NDArray[np.float32]]]
"""Kernels (out, in / groups, k, k) and biases (out,) by the name of their convolution."""


def random_weights(seed: int) -> Weights:
    """Return weights that have learned nothing."""
    random = np.random.default_rng(seed)
    found: Weights = {}
    for each in program():
        if isinstance(each, Conv):
            inputs = each.channels_in // each.groups
            shape = (each.channels_out, inputs, each.kernel, each.kernel)
            spread = np.sqrt(2 / (inputs * each.kernel**2))
            kernel = (random.standard_normal(shape) * spread).astype(np.float32)
            found[each.name] = kernel, np.zeros(each.channels_out, np.float32)
    return found


@contextmanager
def told_if_missing(module: str) -> Iterator[None]:
    """Tell of a package that training imports within and that is not installed, and exit; in the main module only."""
    try:
        yield
    except ModuleNotFoundError as missing:
        if module != "__main__":
            raise
        error = BenchbotError(
            "Networks cannot be trained here.",
            f"That needs the package {missing.name}, which is not installed.",
            "Install what training needs: pip install 'benchbot-baselines[train]'",
        )
        console.error(error)
        raise SystemExit(1) from None


def to_onnx(weights: Weights) -> bytes:
    """Return the network as an ONNX file with its kernels in half precision; sums are in single precision.

    `features` uint8 (1, 8, H, W) to `logits` float32 (1, classes, H / 2, W / 2). Needs the package onnx.
    """
    from onnx import TensorProto, checker, helper, numpy_helper

    nodes = [
        helper.make_node("Cast", ["features"], ["features_float"], to=TensorProto.FLOAT),
        helper.make_node("Mul", ["features_float", "scale"], ["features_scaled"]),
        helper.make_node("Add", ["features_scaled", "shift"], ["features_centred"]),
    ]
    constants = {
        "scale": np.float32(1 / 127.5),
        "shift": np.float32(-1),
        "doubling": np.array([1, 1, 2, 2], np.float32),
    }
    for each in program():
        if isinstance(each, Add):
            other = each.other
            if each.upsampled:
                other = f"{each.name}_upsampled"
                sizes = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
                nodes.append(helper.make_node("Resize", [each.other, "", "doubling"], [other], **sizes))
            nodes.append(helper.make_node("Add", [each.one, other], [each.name]))
            continue
        kernel, bias = weights[each.name]
        constants[f"{each.name}_half"] = kernel.astype(np.float16)
        constants[f"{each.name}_bias"] = bias.astype(np.float32)
        nodes.append(helper.make_node("Cast", [f"{each.name}_half"], [f"{each.name}_kernel"], to=TensorProto.FLOAT))
        source = "features_centred" if each.source == "features" else each.source
        result = f"{each.name}_linear" if each.rectified else each.name
        nodes.append(
            helper.make_node(
                "Conv",
                [source, f"{each.name}_kernel", f"{each.name}_bias"],
                [result],
                group=each.groups,
                kernel_shape=[each.kernel] * 2,
                strides=[each.stride] * 2,
                pads=[each.padding] * 4,
            )
        )
        if each.rectified:
            nodes.append(helper.make_node("Relu", [result], [each.name]))
    graph = helper.make_graph(
        nodes,
        "segmenter",
        [helper.make_tensor_value_info("features", TensorProto.UINT8, [1, len(CHANNELS), "height", "width"])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, [1, len(CLASS_LIST), "rows", "columns"])],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    helper.set_model_props(model, {"classes": "\n".join(CLASS_LIST)})
    checker.check_model(model)
    return bytes(model.SerializeToString())
