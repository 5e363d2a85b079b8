"""The network of the policy that drives to a point, and the ONNX file that it is kept in. Needs torch and onnx."""

from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]  # which onnx raises
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn
from torch.nn import functional

from benchbot.plugin import BenchbotError, write_atomically
from benchbot_baselines.navigation import BEAMS, CELLS, POINTS

ACTIONS = 3
"""Ahead, a turn to the left, a turn to the right."""
CELL_M = 0.1
CROP = 48
COARSER = 4
SWEPT = 24
WIDTHS = (16, 24, 32, 24)
KNOWN = 8
ALIKE = 0.02


class Memory(nn.Module):  # type: ignore[misc]  # it is not installed where types are checked
    """A map around the start, (B, 3, CELLS * CELLS), and what of it is around the robot."""

    def __init__(self) -> None:
        super().__init__()
        centres = (torch.arange(CROP) - CROP / 2 + 0.5) * CELL_M
        around = torch.stack(torch.meshgrid(centres, centres, indexing="ij"), -1).reshape(1, -1, 2)
        self.register_buffer("around", around, persistent=False)
        self.register_buffer("along", ((torch.arange(SWEPT) + 0.5) / SWEPT * 0.96)[:, None], persistent=False)

    def forward(self, grid: Tensor, points: Tensor, hits: Tensor, pose: Tensor, goal: Tensor) -> tuple[Tensor, Tensor]:
        """Return the map with what is seen, and two crops of it (B, 2, 4, CROP, CROP), the second one coarser.

        `points` (B, POINTS, 2) in the robot's frame, beams first, of which `hits` (B, POINTS) are obstacles; `pose`
        (B, 3) x, y and yaw from the start, `goal` (B, 2).
        """
        swept = (points[:, :BEAMS, None] * self.along).reshape(points.shape[0], -1, 2)
        obstacles = torch.where(hits, _cells(_placed(points, pose)), 0)
        free = _cells(_placed(swept, pose))
        way = _cells(pose[:, None, :2])
        one = torch.ones_like(grid[:, :1, :1])
        marked = [
            layer.scatter(1, cells, one[:, 0].expand_as(cells))
            for layer, cells in zip(grid.unbind(1), (obstacles, free, way), strict=True)
        ]
        grid = torch.stack(marked, 1)
        coarse = functional.max_pool2d(grid.reshape(-1, 3, CELLS, CELLS), COARSER).flatten(2)
        around = _placed(self.around.expand(pose.shape[0], -1, -1), pose) - pose[:, None, :2]
        crops = [_crop(grid, around, pose, goal, 1), _crop(coarse, around, pose, goal, COARSER)]
        return grid, torch.stack(crops, 1)


def _crop(layers: Tensor, around: Tensor, pose: Tensor, goal: Tensor, coarser: int) -> Tensor:
    places = pose[:, None, :2] + coarser * around
    cells = _cells(places, coarser)
    seen = layers.gather(2, cells[:, None].expand(-1, 3, -1))
    away_m = (places - goal[:, None]).norm(dim=-1) - (pose[:, :2] - goal).norm(dim=-1)[:, None]
    nearer = away_m / (CROP / 2 * CELL_M * coarser)
    return torch.cat([seen, nearer[:, None]], 1).reshape(-1, 4, CROP, CROP)


def _placed(points: Tensor, pose: Tensor) -> Tensor:
    cosine, sine = pose[:, 2].cos()[:, None], pose[:, 2].sin()[:, None]
    x, y = points[..., 0], points[..., 1]
    return torch.stack([pose[:, :1] + cosine * x - sine * y, pose[:, 1:2] + sine * x + cosine * y], -1)


def _cells(places: Tensor, coarser: int = 1) -> Tensor:
    across = CELLS // coarser
    nodes = (places / (CELL_M * coarser) + across / 2).floor().long().clamp(0, across - 1)
    return nodes[..., 0] * across + nodes[..., 1]


class Network(nn.Module):  # type: ignore[misc]
    """Crops of the map and what else is known in, the logits of three actions and a value out."""

    def __init__(self) -> None:
        super().__init__()
        self.towers = nn.ModuleList([self._tower() for _ in range(2)])
        self.joined = nn.Linear(2 * WIDTHS[-1] * 9 + KNOWN, 96)
        self.actor, self.critic = nn.Linear(96, ACTIONS), nn.Linear(96, 1)
        nn.init.orthogonal_(self.actor.weight, 0.01)

    def _tower(self) -> nn.Sequential:
        layers: list[nn.Module] = []
        for before, width in zip((4, *WIDTHS), WIDTHS, strict=False):
            layers += [nn.Conv2d(before, width, 3, 2, 1), nn.ReLU()]
        return nn.Sequential(*layers, nn.Flatten())

    def forward(self, crops: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits (B, 3) and values (B,) of crops (B, 2, 4, CROP, CROP) and of what is known (B, KNOWN)."""
        seen = [tower(crops[:, number]) for number, tower in enumerate(self.towers)]
        joined = functional.relu(self.joined(torch.cat([*seen, known], 1)))
        return self.actor(joined), self.critic(joined)[:, 0]


def known(pose: Tensor, goal: Tensor, last: Tensor) -> Tensor:
    """Return the direction and distance of the goal, and what was done last, (B, KNOWN)."""
    x, y = (goal - pose[:, :2]).unbind(1)
    away_m = (x * x + y * y).sqrt().clamp(min=1e-3)
    cosine, sine = pose[:, 2].cos(), pose[:, 2].sin()
    ahead, left = (cosine * x + sine * y) / away_m, (cosine * y - sine * x) / away_m
    return torch.cat([torch.stack([ahead, left, away_m / 10, away_m.clamp(max=1)], 1), last], 1)


class Exported(nn.Module):  # type: ignore[misc]
    """What the ONNX file does: the map and what is seen in, the map and logits out."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self.memory, self.network = Memory(), network

    def forward(
        self, grid: Tensor, points: Tensor, hits: Tensor, pose: Tensor, goal: Tensor, last: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the map and logits (1, 3)."""
        grid, crops = self.memory(grid, points, hits, pose, goal)
        return grid, self.network(crops, known(pose, goal, last))[0]


def read_onnx(network: Network, path: Path) -> None:
    """Give a network the weights of a policy that `to_onnx` wrote, but for the critic.

    Raises BenchbotError for a file that is none.
    """
    try:
        model = onnx.load(str(path))
    except (OSError, DecodeError) as error:
        raise BenchbotError(
            f"{path} cannot be read.",
            str(error),
            "Name a policy that benchbot_baselines.policy_training has written.",
        ) from error
    kept = {each.name: numpy_helper.to_array(each) for each in model.graph.initializer}
    for name, weights in network.named_parameters():
        if not name.startswith("critic"):
            found = kept.get(f"network.{name}_half", kept.get(f"network.{name}"))
            if found is None or found.shape != tuple(weights.shape):
                raise BenchbotError(
                    f"{path} is no policy to begin from.",
                    f"It has no {name} of the shape {tuple(weights.shape)}.",
                    "Name one that benchbot_baselines.policy_training has written.",
                )
            weights.data.copy_(torch.from_numpy(found.astype(np.float32)))


def to_onnx(network: Network, path: Path) -> None:
    """Write the policy as an ONNX file, weights in half precision, and hold it to the network."""
    exported = Exported(network).to("cpu").eval()
    random = torch.Generator().manual_seed(0)
    given = {
        "grid": torch.zeros(1, 3, CELLS * CELLS),
        "points": 6 * torch.rand(1, POINTS, 2, generator=random) - 3,
        "hits": torch.rand(1, POINTS, generator=random) < 0.5,
        "pose": torch.tensor([[1.0, 2.0, 0.5]]),
        "goal": torch.tensor([[3.0, -4.0]]),
        "last": torch.zeros(1, ACTIONS + 1),
    }
    torch.onnx.export(
        exported,
        tuple(given.values()),
        str(path),
        input_names=list(given),
        output_names=["grid_next", "logits"],
        opset_version=17,
        do_constant_folding=False,
        dynamo=False,
    )
    model = onnx.load(str(path))
    for node in model.graph.node:
        node.ClearField("doc_string")  # where in this file it was made
    kept = [each for each in model.graph.initializer if each.data_type == TensorProto.FLOAT and len(each.dims) > 1]
    for weights in kept:
        if weights.name.startswith("memory"):
            continue
        half = numpy_helper.from_array(numpy_helper.to_array(weights).astype(np.float16), f"{weights.name}_half")
        model.graph.initializer.remove(weights)
        model.graph.initializer.append(half)
        model.graph.node.insert(0, helper.make_node("Cast", [half.name], [weights.name], to=TensorProto.FLOAT))
    write_atomically(path, bytes(model.SerializeToString()))
    with torch.no_grad():
        grid, logits = exported(*given.values())
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    answered = session.run(None, {name: value.numpy() for name, value in given.items()})
    apart = float(np.abs(answered[1] - logits.numpy()).max()) / max(float(logits.abs().max()), 1.0)
    if apart > ALIKE or not np.array_equal(answered[0], grid.numpy()):
        raise BenchbotError(
            f"{path} does not answer as the policy that was trained.",
            f"Its logits differ by {apart:.3f} of the largest, or its map does.",
            "Report it with the versions of torch and onnx.",
        )
