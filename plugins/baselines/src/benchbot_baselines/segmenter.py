"""A segmenter of pictures with depth: an ONNX file run by onnxruntime on the processor."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.api import Observations
from benchbot.mapping import CLASS_LIST, rotation_matrix, unproject
from benchbot.plugin import BenchbotError, FailureClass
from benchbot_baselines.features import CHANNELS, features, input_size, levelled, sampled

WEIGHTS = Path(__file__).parent / "weights" / "segmenter.onnx"
"""The network that comes with this distribution; `card.md` beside it says what it was trained on."""
NEEDED = ("image_rgb", "image_depth", "image_depth_info", "poses")
THREADS = 2
STEP = 0.05
"""Of the depth: what is nearer by more is something else."""


@dataclass(frozen=True)
class Sighting:
    """Points that a frame shows: `points` (N, 3) in the map frame, metres; `label_probs` float32 (N, K).

    `depth_m` (N,) is along the optical axis.
    """

    points: NDArray[np.float32]
    label_probs: NDArray[np.float32]
    depth_m: NDArray[np.float32]


class Segmenter:
    """A network with one input of 3 channels (red, green, blue) or of `features.CHANNELS`, uint8 (1, C, H, W).

    Its first output are logits (1, K, h, w); the metadata `classes` names the K classes in lines, else they are
    `CLASS_LIST`. Raises BenchbotError for another one.
    """

    def __init__(self, weights: Path = WEIGHTS) -> None:
        import onnxruntime

        if not weights.is_file():
            raise BenchbotError(
                f"There are no weights at {weights}.",
                "The mapper sees with a network that was trained before, an ONNX file.",
                "Train one (python -m benchbot_baselines.training --help), and name it: --args weights=FILE",
                failure=FailureClass.AGENT,
            )
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = THREADS
        state = onnxruntime.capi.onnxruntime_pybind11_state
        try:
            self._session = onnxruntime.InferenceSession(str(weights), options, providers=["CPUExecutionProvider"])
        except (state.Fail, state.InvalidGraph, state.InvalidProtobuf, state.NotImplemented) as error:
            raise BenchbotError(
                f"{weights} cannot be run.",
                f"onnxruntime says: {error}",
                "Name an ONNX file that onnxruntime runs on a processor: --args weights=FILE",
                failure=FailureClass.AGENT,
            ) from error
        (given, *more), outputs = self._session.get_inputs(), self._session.get_outputs()
        named = self._session.get_modelmeta().custom_metadata_map.get("classes")
        self.class_list: Sequence[str] = CLASS_LIST if named is None else named.split("\n")
        self._input, self._channels = given.name, given.shape[1] if len(given.shape) == 4 else None
        fits = given.type == "tensor(uint8)" and self._channels in (3, len(CHANNELS)) and not more
        if not fits or len(outputs[0].shape) != 4:
            raise BenchbotError(
                f"{weights} is no segmenter.",
                f"Its input '{given.name}' is {given.type} {given.shape}, its output {outputs[0].shape}.",
                f"Export one whose input is uint8 (1, 3 or {len(CHANNELS)}, H, W) and whose output is (1, K, h, w).",
                failure=FailureClass.AGENT,
            )

    def see(self, observations: Observations) -> Sighting:
        """Return what a frame shows: its points, but for those beside something nearer, and their classes."""
        missing = [name for name in NEEDED if name not in observations]
        if missing:
            raise BenchbotError(
                f"The mapper needs {' and '.join(missing)}, which the task does not give.",
                "It sees by colours, depth and the pose of the camera.",
                "Choose such a task: --task semantic_slam:passive:ground_truth",
                failure=FailureClass.AGENT,
            )
        rgb, depth_m, info = (observations["image_rgb"], observations["image_depth"], observations["image_depth_info"])
        pose = observations["poses"]
        camera = pose["camera"]
        if rgb.shape[:2] != depth_m.shape:
            raise BenchbotError(
                "Colours and depth have different sizes.",
                f"They are {rgb.shape[:2]} and {depth_m.shape} pixels.",
                "Choose a robot whose depth is registered to its colours.",
                failure=FailureClass.AGENT,
            )
        height, width = input_size(*depth_m.shape)
        chosen = np.ix_(sampled(depth_m.shape[0], height), sampled(depth_m.shape[1], width))
        points = unproject(depth_m, info, camera)[chosen]
        small_m, eye = depth_m[chosen], np.asarray(camera["translation_xyz"])
        channels = np.moveaxis(rgb[chosen], -1, 0)
        if self._channels != 3:
            transform = np.eye(4)
            transform[:3, :3] = rotation_matrix(camera["rotation_xyzw"])
            # From the map frame to that of the camera's heading.
            turn = levelled(transform) @ transform[:3, :3].T
            below = [eye[0], eye[1], pose["robot"]["translation_xyz"][2] if "robot" in pose else 0.0]
            channels = features(rgb[chosen], (points - below) @ turn.T, small_m)
        logits = self._session.run(None, {self._input: np.ascontiguousarray(channels[None])})[0][0]
        used = unhidden(small_m)
        wide = enlarged(np.moveaxis(logits, 0, -1), height, width)[used]
        return Sighting(points[used], softmax(wide), small_m[used])


def softmax(logits: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the probabilities (N, K) of logits (N, K), the sum of each row 1."""
    likely: NDArray[np.float32] = np.exp(logits - logits.max(axis=1, keepdims=True))
    likely /= likely.sum(axis=1, keepdims=True)
    return likely


def unhidden(depth_m: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Say which pixels (H, W) have depth, and no neighbour that is nearer by more than `STEP` of their depth.

    Beside an object, the labels of what is behind it are those of the object: boxes would reach to the wall.
    """
    known = np.isfinite(depth_m) & (depth_m > 0)
    usable: NDArray[np.bool_] = known.copy()
    filled = np.where(known, depth_m, np.inf)
    for ahead, behind in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        for here, beside in ((ahead, behind), (behind, ahead)):
            usable[here] &= filled[beside] > (1 - STEP) * filled[here]
    return usable


def enlarged(image: NDArray[np.float32], height: int, width: int) -> NDArray[np.float32]:
    """Return an image (h, w, K) at another size, (height, width, K), interpolated linearly."""
    for axis, wanted in ((0, height), (1, width)):
        length = image.shape[axis]
        places = np.clip((np.arange(wanted) + 0.5) * length / wanted - 0.5, 0, length - 1)
        below = places.astype(np.intp)
        share = (places - below).astype(np.float32).reshape([-1, 1, 1] if axis == 0 else [1, -1, 1])
        one, other = (np.take(image, row, axis) for row in (below, np.minimum(below + 1, length - 1)))
        image = one + share * (other - one)
    return image
