"""A segmenter of pictures with depth: an ONNX file run by onnxruntime on the processor."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.api import Observations
from benchbot.mapping import CLASS_LIST, rotation_matrix, unproject
from benchbot.plugin import BenchbotError, FailureClass
from benchbot_baselines.features import CHANNELS, features, input_size, levelled, sampled

THREADS = 2


class Segmenter:
    """A network with one input of 3 channels (red, green, blue) or of `features.CHANNELS`, uint8 (1, C, H, W).

    Its first output are logits (1, K, h, w); the metadata `classes` names the K classes in lines, else they are
    `CLASS_LIST`. Raises BenchbotError for another one.
    """

    def __init__(self, weights: Path) -> None:
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

    def see(self, observations: Observations) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return points (N, 3) in the map frame, metres, and their class probabilities (N, K)."""
        depth_m, info, pose = (observations[name] for name in ("image_depth", "image_depth_info", "poses"))
        rgb, camera = observations["image_rgb"], pose["camera"]
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
        rows, columns = sampled(height, logits.shape[1]), sampled(width, logits.shape[2])
        likely = np.exp(logits - logits.max(axis=0))
        likely /= likely.sum(axis=0)
        points = points[np.ix_(rows, columns)].reshape(-1, 3)
        finite = np.isfinite(points).all(1)
        return points[finite].astype(np.float32), np.moveaxis(likely, 0, -1).reshape(len(finite), -1)[finite]
