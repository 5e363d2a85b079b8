"""Training of the segmenter: `python -m benchbot_baselines.training FOLDER --output RUN`.

Reads what `benchbot collect --size 320x240` wrote, keeps all pictures on the device, and works out features and
augmentation there. Needs torch and onnx, which BenchBot does not install.
"""

import argparse
import csv
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.cli.kit import console
from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError, write_atomically
from benchbot_baselines.collecting import Shots, place_file, read_shots
from benchbot_baselines.features import NEAREST_M, STRIDE, TALLEST_M, levelled
from benchbot_baselines.network import Add, Conv, Weights, program, to_onnx, told_if_missing
from benchbot_baselines.seeds import HELD_OUT_OF, seeds_of

with told_if_missing(__name__):
    import onnx  # noqa: F401 - it is needed at the end: its lack is to be told at the start
    import onnxruntime
    import torch
    from torch import Tensor, nn
    from torch.nn import functional

READERS = 8
CURVE_ROWS = 12
MOST_EVALUATED = 2048
EVALUATED_AT_ONCE = 64
ALIKE = 0.02


@dataclass(frozen=True)
class Options:
    """How to train; it ends after `minutes` of training, or after `steps`, whichever comes first."""

    minutes: float = 8.0
    steps: int = 1_000_000
    batch: int = 64
    rate: float = 3e-3
    decay: float = 0.02
    seed: int = 0
    every_s: float = 60.0


@dataclass(frozen=True)
class Pictures:
    """Pictures on a device, N of them: a sample is one index.

    `rgb` uint8 (N, H, W, 3); `depth_mm` int16 (N, H, W), whose bits are those of unsigned ones; `labels` uint8
    (N, H, W) over `CLASS_LIST`; `level` (N, 3, 3) from the optical frame to one of the camera's heading with z up;
    `eye_m` (N,) above the floor; `intrinsics` (N, 4), fx, fy, cx, cy.
    """

    rgb: Tensor
    depth_mm: Tensor
    labels: Tensor
    level: Tensor
    eye_m: Tensor
    intrinsics: Tensor


def load(folder: Path, seeds: Sequence[int], device: str) -> Pictures:
    """Read the places of seeds onto a device, several at once."""
    with ThreadPoolExecutor(READERS) as pool:
        parts = list(pool.map(lambda seed: _pictures(place_file(folder, seed), device), seeds))
    height, width = parts[0].rgb.shape[1:3]
    if any(part.rgb.shape[1:3] != (height, width) for part in parts) or height % STRIDE or width % STRIDE:
        raise BenchbotError(
            f"The pictures in {folder} cannot be trained on together.",
            f"All must have one size, whose height and width {STRIDE} divides.",
            "Collect them again: benchbot collect --size 320x240",
        )
    return Pictures(**{name: torch.cat([getattr(part, name) for part in parts]) for name in Pictures.__annotations__})


def _pictures(path: Path, device: str) -> Pictures:
    shots: Shots = read_shots(path)
    count = len(shots.rgb)
    level = np.stack([levelled(pose) for pose in shots.camera_to_map]).astype(np.float32)
    # Generated floors are at z = 0.
    eye_m = shots.camera_to_map[:, 2, 3].astype(np.float32)
    arrays = (shots.rgb, shots.depth_mm.view(np.int16), shots.classes[shots.instance], level, eye_m)
    intrinsics = shots.intrinsics.astype(np.float32).reshape(count, 4)
    return Pictures(*(torch.from_numpy(np.ascontiguousarray(each)).to(device) for each in (*arrays, intrinsics)))


def device_features(rgb: Tensor, points: Tensor, depth_m: Tensor) -> Tensor:
    """Return what `features.features` does, of a batch: (B, 8, h, w) from 0 to 255, as floats, not rounded.

    `rgb` float (B, h, w, 3) from 0 to 255, `points` (B, h, w, 3) and `depth_m` (B, h, w), 0 where there is none.
    """
    valid = depth_m > 0
    points = torch.where(valid[..., None], points, 0.0)
    across, down = torch.zeros_like(points), torch.zeros_like(points)
    across[:, :, 1:-1] = points[:, :, 2:] - points[:, :, :-2]
    down[:, 1:-1] = points[:, 2:] - points[:, :-2]
    normals = torch.linalg.cross(down, across)
    lengths = normals.norm(dim=-1, keepdim=True)
    normals = torch.where((lengths > 0) & valid[..., None], normals / lengths.clamp(min=1e-9), 0.0)
    near = torch.where(valid, NEAREST_M / depth_m.clamp(min=NEAREST_M), 0.0)
    height = torch.where(valid, (points[..., 2] / TALLEST_M).clamp(0, 1), 0.0)
    measured = torch.cat([near[..., None], height[..., None], 0.5 + 0.5 * normals], -1) * 255
    return torch.cat([rgb, measured], -1).permute(0, 3, 1, 2)


def batch_of(pictures: Pictures, chosen: Tensor, random: torch.Generator | None) -> tuple[Tensor, Tensor]:
    """Return features (B, 8, H, W) from -1 to 1, and labels (B, H / 2, W / 2), of pictures; augmented if `random`."""
    height, width = pictures.rgb.shape[1:3]
    device, count = pictures.rgb.device, len(chosen)

    def drawn(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand((count, *shape), generator=random, device=device)

    rows = (torch.arange(height, device=device) + 0.5).expand(count, height)
    columns = (torch.arange(width, device=device) + 0.5).expand(count, width)
    if random is not None:
        part = drawn(0.55, 1.0, 1)
        rows = rows * part + drawn(0, 1, 1) * (1 - part) * height
        columns = columns * part + drawn(0, 1, 1) * (1 - part) * width
        mirrored = drawn(0, 1, 1) < 0.5
        columns = torch.where(mirrored, columns.flip(1), columns)
    v, u = rows.long().clamp(0, height - 1), columns.long().clamp(0, width - 1)
    at = chosen[:, None, None], v[:, :, None], u[:, None, :]
    rgb = pictures.rgb[at].float()
    depth_m = (pictures.depth_mm[at].int() & 0xFFFF).float() / 1000
    labels = pictures.labels[at][:, 1::2, 1::2].long()
    if random is not None:
        gamma, gain, tint = drawn(0.7, 1.4, 1, 1, 1), drawn(0.7, 1.25, 1, 1, 1), drawn(0.9, 1.1, 1, 1, 3)
        rgb = (rgb / 255).pow(gamma) * 255 * gain * tint
        noise = torch.randn(rgb.shape, generator=random, device=device)
        rgb = (rgb + drawn(0, 8, 1, 1, 1) * noise).clamp(0, 255)
        noise = torch.randn(depth_m.shape, generator=random, device=device)
        depth_m = depth_m + drawn(0, 0.003, 1, 1) * depth_m**2 * noise * (depth_m > 0)
        missing = torch.rand(depth_m.shape, generator=random, device=device) < drawn(0, 0.03, 1, 1)
        depth_m = torch.where(missing, 0.0, depth_m.clamp(min=0))
    fx, fy, cx, cy = pictures.intrinsics[chosen].T[:, :, None, None]
    x = ((u[:, None, :] - cx) / fx).expand_as(depth_m)
    if random is not None:
        x = torch.where(mirrored[:, :, None], -x, x)
    y = ((v[:, :, None] - cy) / fy).expand_as(depth_m)
    rays = torch.stack([x, y, torch.ones_like(x)], -1)
    points = torch.einsum("bhwi,bji->bhwj", rays * depth_m[..., None], pictures.level[chosen])
    points[..., 2] += pictures.eye_m[chosen][:, None, None]
    return device_features(rgb, points, depth_m) / 127.5 - 1, labels


class Network(nn.Module):  # type: ignore[misc]  # types of torch are not looked into
    """The operations of `program`, with a batch normalisation behind each convolution but the last."""

    def __init__(self) -> None:
        super().__init__()
        self.operations = program()
        convolutions = [each for each in self.operations if isinstance(each, Conv)]
        self.last = convolutions[-1].name
        self.convolutions = nn.ModuleDict(
            {
                each.name: nn.Conv2d(
                    each.channels_in,
                    each.channels_out,
                    each.kernel,
                    each.stride,
                    each.padding,
                    groups=each.groups,
                    bias=each.name == self.last,
                )
                for each in convolutions
            }
        )
        self.norms = nn.ModuleDict(
            {each.name: nn.BatchNorm2d(each.channels_out) for each in convolutions if each.name != self.last}
        )

    def forward(self, features: Tensor) -> Tensor:
        """Return logits (B, classes, H / 2, W / 2) of features (B, 8, H, W) from -1 to 1."""
        found = {"features": features}
        for each in self.operations:
            if isinstance(each, Add):
                other = found[each.other]
                if each.upsampled:
                    other = functional.interpolate(other, scale_factor=2.0, mode="nearest")
                found[each.name] = found[each.one] + other
                continue
            value = self.convolutions[each.name](found[each.source])
            if each.name != self.last:
                value = self.norms[each.name](value)
            found[each.name] = functional.relu(value) if each.rectified else value
        return found[self.last]

    def folded(self) -> Weights:
        """Return kernels and biases that do what convolutions and their normalisations do together."""
        weights: Weights = {}
        for name, convolution in self.convolutions.items():
            kernel = convolution.weight.detach().float()
            if name == self.last:
                bias = convolution.bias.detach().float()
            else:
                norm = self.norms[name]
                factor = norm.weight.detach() / (norm.running_var + norm.eps).sqrt()
                kernel, bias = kernel * factor[:, None, None, None], norm.bias.detach() - norm.running_mean * factor
            weights[name] = kernel.cpu().numpy(), bias.float().cpu().numpy()
        return weights


def class_weights(labels: Tensor) -> Tensor:
    """Return a weight of each class, 1 on average over pixels: the rarer, the heavier, by the root of its share."""
    share = torch.bincount(
        labels.reshape(-1)[:: max(labels.numel() // 50_000_000, 1)].long(), minlength=len(CLASS_LIST)
    )
    share = share.float() / share.sum()
    weights = (share + 1e-4).rsqrt()
    return weights / (weights * share).sum()


def evaluate(network: Network, pictures: Pictures) -> NDArray[np.float64]:
    """Return the intersection over union of each class, NaN for those that neither labels nor answers have."""
    known = len(CLASS_LIST)
    device = pictures.rgb.device
    confusion = torch.zeros(known * known, dtype=torch.int64, device=device)
    picked = torch.linspace(0, len(pictures.rgb) - 1, min(len(pictures.rgb), MOST_EVALUATED), device=device).long()
    network.eval()
    with torch.no_grad():
        for chosen in picked.split(EVALUATED_AT_ONCE):
            features, labels = batch_of(pictures, chosen, None)
            with torch.autocast(device.type, torch.bfloat16, enabled=device.type == "cuda"):
                answers = network(features.contiguous(memory_format=torch.channels_last)).argmax(1)
            confusion += torch.bincount((labels * known + answers).reshape(-1), minlength=known * known)
    network.train()
    table: NDArray[np.float64] = confusion.reshape(known, known).double().cpu().numpy()
    either = table.sum(0) + table.sum(1) - np.diag(table)
    ious = np.full(known, np.nan)
    np.divide(np.diag(table), either, out=ious, where=either > 0)
    return ious


def train(folder: Path, output: Path, options: Options, device: str) -> dict[str, float]:
    """Train, write `weights.onnx`, `curve.csv` and `card.md` every `every_s` and at the end; return IoU by class."""
    trained, held_out = seeds_of(folder)
    output.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(options.seed)
    random = torch.Generator(device).manual_seed(options.seed)
    pictures, others = load(folder, trained, device), load(folder, held_out, device)
    console.note(f"{len(pictures.rgb)} pictures of {len(trained)} places; held out: {len(others.rgb)}")
    network = Network().to(device, memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
    weights = class_weights(pictures.labels)
    curve: list[tuple[int, float, float, float]] = []
    begun = time.monotonic()
    step, told_s, mean, ious = 0, 0.0, torch.zeros((), device=device), np.zeros(0)
    while True:
        elapsed_s = time.monotonic() - begun
        progress = max(elapsed_s / (60 * options.minutes), step / options.steps)
        if progress >= 1 or elapsed_s - told_s > options.every_s:
            told_s, ious = elapsed_s, evaluate(network, others)
            curve.append((step, elapsed_s / 60, float(mean), float(np.nanmean(ious))))
            console.note(f"step {step}, {elapsed_s:.0f} s: loss {curve[-1][2]:.3f}, mean IoU {curve[-1][3]:.3f}")
            _write(output, network, curve, _card(options, device, trained, held_out, pictures, others, curve, ious))
        if progress >= 1:
            check(network, output / "weights.onnx", others)
            return dict(zip(CLASS_LIST, ious.tolist(), strict=True))
        for group in optimizer.param_groups:
            warm = min((step + 1) / 200, 1)
            group["lr"] = options.rate * warm * (0.5 + 0.5 * np.cos(np.pi * progress))
        chosen = torch.randint(len(pictures.rgb), (options.batch,), generator=random, device=device)
        features, labels = batch_of(pictures, chosen, random)
        with torch.autocast(torch.device(device).type, torch.bfloat16, enabled=device != "cpu"):
            logits = network(features.contiguous(memory_format=torch.channels_last))
        loss = functional.cross_entropy(logits.float(), labels, weights)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        mean = loss.detach() if step == 0 else mean + 0.02 * (loss.detach() - mean)
        step += 1


def check(network: Network, path: Path, pictures: Pictures) -> None:
    """Raise BenchbotError unless the ONNX file answers as the network does, but for half precision."""
    features, _ = batch_of(pictures, torch.zeros(1, dtype=torch.int64, device=pictures.rgb.device), None)
    pixels = ((features + 1) * 127.5).round().to(torch.uint8)
    network.eval()
    with torch.no_grad():
        wanted = network(pixels.float() / 127.5 - 1)[0].float().cpu().numpy()
    network.train()
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    answered = session.run(None, {"features": pixels.cpu().numpy()})[0][0]
    apart = float(np.abs(answered - wanted).max() / max(float(np.abs(wanted).max()), 1.0))
    if apart > ALIKE:
        raise BenchbotError(
            f"{path} does not answer as the network that was trained.",
            f"Logits differ by {apart:.3f} of the largest.",
            "Report it with the versions of torch and onnx.",
        )


def _write(output: Path, network: Network, curve: Sequence[tuple[int, float, float, float]], card: str) -> None:
    write_atomically(output / "weights.onnx", to_onnx(network.folded()))
    write_atomically(output / "card.md", card.encode())
    with (output / "curve.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("step", "minutes", "loss", "mean_iou"))
        writer.writerows((step, round(minutes, 3), round(loss, 4), round(iou, 4)) for step, minutes, loss, iou in curve)


def _card(
    options: Options,
    device: str,
    trained: Sequence[int],
    held_out: Sequence[int],
    pictures: Pictures,
    others: Pictures,
    curve: Sequence[tuple[int, float, float, float]],
    ious: NDArray[np.float64],
) -> str:
    name = torch.cuda.get_device_name() if device != "cpu" else "processor"
    step, minutes, loss, mean = curve[-1]
    rows = (f"| {label} | {iou:.3f} |" for label, iou in zip(CLASS_LIST, ious, strict=True) if np.isfinite(iou))
    settings: Mapping[str, object] = asdict(options)
    shown = [*curve[:-1][:: len(curve) // CURVE_ROWS + 1], curve[-1]]
    return "\n".join(
        [
            "# Segmenter of RGB-D pictures",
            "",
            (
                f"Trained on {len(pictures.rgb)} pictures of {len(trained)} generated places, seeds {trained[0]} to "
                f"{trained[-1]}; held out are {len(others.rgb)} pictures of the seeds that {HELD_OUT_OF} divides: "
                f"{', '.join(map(str, held_out))}. No environment that is shipped was seen."
            ),
            "",
            f"{step} steps in {minutes:.1f} minutes on {name}, torch {torch.__version__}; "
            + ", ".join(f"{key} {value}" for key, value in settings.items())
            + ".",
            "",
            f"Loss {loss:.3f}, mean IoU {mean:.3f} on the places held out:",
            "",
            "| Class | IoU |",
            "|---|---|",
            *rows,
            "",
            "How it went, by `curve.csv`:",
            "",
            "| Step | Minutes | Loss | Mean IoU |",
            "|---|---|---|---|",
            *(f"| {step} | {minutes:.1f} | {loss:.3f} | {mean:.3f} |" for step, minutes, loss, mean in shown),
            "",
        ]
    )


def main() -> None:
    """Read the command line and train."""
    parser = argparse.ArgumentParser(prog="python -m benchbot_baselines.training", description="Train the segmenter.")
    parser.add_argument("folder", type=Path, help="what benchbot collect --size 320x240 wrote")
    parser.add_argument("--output", type=Path, required=True, help="where weights.onnx, curve.csv and card.md go")
    parser.add_argument("--minutes", type=float, default=Options.minutes)
    parser.add_argument("--steps", type=int, default=Options.steps)
    parser.add_argument("--batch", type=int, default=Options.batch)
    parser.add_argument("--seed", type=int, default=Options.seed)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    given = parser.parse_args()
    options = Options(given.minutes, given.steps, given.batch, seed=given.seed)
    try:
        train(given.folder, given.output, options, given.device)
    except BenchbotError as error:
        console.error(error)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
