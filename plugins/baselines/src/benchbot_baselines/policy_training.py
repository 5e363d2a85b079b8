"""Training of the policy that drives to a point: `python -m benchbot_baselines.policy_training PLACES --output RUN`.

Proximal policy optimisation (J. Schulman et al., arXiv:1707.06347) in several processes that average their gradients
(E. Wijmans et al., "DD-PPO", ICLR 2020), each with places of its own, on one device. The reward is what a step shortens
the way that is left, on the floor plan, which is asked for in training only. Needs torch and onnx.
"""

import argparse
import csv
import os
import socket
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.cli.kit import console
from benchbot.mapping import rotation_matrix
from benchbot.plugin import BenchbotError, write_atomically
from benchbot_baselines import navigation
from benchbot_baselines.navigation import BEAMS, CELLS, COLUMNS, FELT_M, FORWARD_M, ROWS, TURN_DEG
from benchbot_baselines.network import told_if_missing
from benchbot_baselines.practice import Course, courses

with told_if_missing(__name__):
    import gymnasium
    import torch
    from gymnasium.vector import AutoresetMode
    from torch import Tensor, distributed, multiprocessing, nn
    from torch.nn import functional

    from benchbot.gymnasium import Move  # importing it registers the environments, too
    from benchbot_baselines.policy_network import Memory, Network, known, read_onnx, to_onnx

MOVES = (Move("move_distance", FORWARD_M), Move("move_angle", TURN_DEG), Move("move_angle", -TURN_DEG))
BATCH_STEPS = 4096
"""Steps of all processes that a gradient is of: of more, a gradient teaches little more, and there are fewer."""
EPOCHS = 3
CRITIC_ALONE = 25
"""Updates in which a critic learns that does not know the policy yet."""
GAMMA, DECAY, CLIP = 0.99, 0.95, 0.2
ARRIVED, COLLIDED, BLOCKED, SLACK = 2.5, -1.0, -0.05, -0.02


@dataclass(frozen=True)
class Options:
    """How to train. `minutes` are those of training, after everything was loaded; `updates` may end it before."""

    minutes: float = 20.0
    updates: int = 1_000_000
    processes: int = 12
    environments: int = 64
    steps: int = 32
    horizon: int = 300
    rate: float = 7e-4
    entropy: float = 0.01
    seed: int = 0


class Driving:
    """Robots that drive in one place, each to its own goals, and what they have seen."""

    def __init__(self, course: Course, options: Options, device: str, seed: int) -> None:
        self._device, self._course = device, course
        self.envs = gymnasium.make_vec(
            "benchbot/PointGoal-v0",
            options.environments,
            env=course.environment,
            image_size=(COLUMNS, ROWS),
            moves=MOVES,
            reward="collision",
            tensors="torch",
            autoreset_mode=AutoresetMode.SAME_STEP,
            max_episode_steps=options.horizon,
            platform_options={"device": "cpu" if device == "cpu" else "cuda"},
        )
        count = options.environments
        self._grid = torch.zeros(count, 3, CELLS * CELLS, device=device)
        self._last = torch.zeros(count, len(MOVES) + 1, device=device)
        self._felt = torch.tensor(FELT_M, device=device).expand(count, -1, -1)
        self._memory = Memory().to(device)
        self._fields = torch.from_numpy(course.distances_m).to(device)
        self._origin = torch.tensor(course.origin_xy, device=device)
        observation, infos = self.envs.reset(seed=seed)
        self._episodes = torch.from_numpy(infos["episode"].astype(np.int64)).to(device)
        self._rig = self._rigged(observation, infos)
        self._ways_m = torch.ones(count, device=device)
        self._driven_m = torch.zeros(count, device=device)
        self._take_in(observation)
        self._left_m = self._distance_m(observation)
        self._ways_m = self._left_m.clone()

    def _rigged(self, observation: dict[str, Tensor], infos: dict[str, Any]) -> navigation.Rig:
        def place(name: str) -> tuple[Any, Any]:
            pose = observation[f"pose_{name}"][0].double().cpu().numpy()
            return rotation_matrix(pose[3:]), pose[:3]

        frames = {"base": place("base_link"), "laser": place("lidar"), "camera": place("camera")}
        matrix = infos["image_depth_info"]["matrix_intrinsics"][0]
        found = navigation.rig(infos["laser_angles_rad"][0], matrix, (ROWS, COLUMNS), frames)
        return navigation.Rig(
            *(
                torch.from_numpy(each).to(self._device)
                for each in (found.beams, found.laser_m, found.rays, found.camera_m)
            )
        )

    def _distance_m(self, observation: dict[str, Tensor]) -> Tensor:
        place = (observation["pose_base_link"][:, :2] - self._origin) / self._course.resolution_m
        rows, columns = self._fields.shape[1:]
        i = place[:, 0].round().long().clamp(0, rows - 1)
        j = place[:, 1].round().long().clamp(0, columns - 1)
        return self._fields[self._episodes, i, j].float()

    def _take_in(self, observation: dict[str, Tensor]) -> None:
        base, start = observation["pose_base_link"], observation["pose_initial_pose"]
        yaw, first = 2 * torch.atan2(base[:, 5], base[:, 6]), 2 * torch.atan2(start[:, 5], start[:, 6])
        x, y = (base[:, :2] - start[:, :2]).unbind(1)
        cosine, sine = first.cos(), first.sin()
        pose = torch.stack([cosine * x + sine * y, cosine * y - sine * x, yaw - first], 1)
        ranges_m = observation["laser"].float()
        chosen = torch.from_numpy(navigation.sampled(BEAMS, ranges_m.shape[1])).to(self._device)
        ends, near, low, stops = self._rig.points(ranges_m[:, chosen], observation["image_depth"].float())
        felt = (self._last[:, 3:] > 0).expand(-1, len(FELT_M))
        points, hits = torch.cat([ends, low, self._felt], 1), torch.cat([near, stops, felt], 1)
        goal = observation["goal"].float()
        self._grid, self.crops = self._memory(self._grid, points, hits, pose, goal)
        self.known = known(pose, goal, self._last)
        self._base = base[:, :2].clone()

    def step(self, actions: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return rewards, what has ended, what has arrived, and SPL of what has ended, (N,) each."""
        observation, collided, terminated, truncated, infos = self.envs.step(actions)
        ended = terminated | truncated
        arrived = terminated & (collided > -0.5)
        before_m, before = self._left_m, self._base
        self._last = torch.cat([functional.one_hot(actions, len(MOVES)).float(), self._last[:, 3:] * 0], 1)
        moved_m = torch.where(
            ended, FORWARD_M * self._last[:, 0], (observation["pose_base_link"][:, :2] - before).norm(dim=1)
        )
        blocked = (self._last[:, 0] > 0) & (moved_m < navigation.BLOCKED_M) & ~ended
        self._last[:, 3] = blocked.float()
        self._driven_m = self._driven_m + moved_m
        spl = arrived * self._ways_m / torch.maximum(self._ways_m, self._driven_m)
        if "episode" in infos:
            again = torch.from_numpy(infos["_episode"]).to(self._device)
            self._episodes = torch.where(
                again, torch.from_numpy(infos["episode"].astype(np.int64)).to(self._device), self._episodes
            )
        self._grid[ended] = 0
        self._last[ended] = 0
        self._driven_m = torch.where(ended, 0.0, self._driven_m)
        self._left_m = self._distance_m(observation)
        self._ways_m = torch.where(ended, self._left_m, self._ways_m)
        won_m = torch.where(ended, torch.where(arrived, before_m, 0.0), before_m - self._left_m)
        reward = won_m + ARRIVED * arrived + COLLIDED * (terminated & ~arrived) + BLOCKED * blocked + SLACK
        self._take_in(observation)
        return reward, ended, arrived, spl


@dataclass(frozen=True)
class Rollout:
    """Steps of robots, (T, N, …) each."""

    crops: Tensor
    known: Tensor
    actions: Tensor
    likely: Tensor
    values: Tensor
    rewards: Tensor
    ended: Tensor
    after: Tensor


def drive(network: Network, driving: Driving, steps: int) -> tuple[Rollout, Tensor]:
    """Drive for some steps; return them, and how many episodes ended, how many of them well, and the sum of SPL."""
    kept: list[tuple[Tensor, ...]] = []
    counts = torch.zeros(3, device=driving.crops.device)
    with torch.no_grad():
        for _ in range(steps):
            crops, facts = driving.crops.half(), driving.known
            logits, value = network(crops.float(), facts)
            choice = torch.distributions.Categorical(logits=logits, validate_args=False)
            action = choice.sample()
            reward, ended, arrived, spl = driving.step(action)
            kept.append((crops, facts, action, choice.log_prob(action), value, reward, ended.float()))
            counts += torch.stack([ended.sum(), arrived.sum(), spl.sum()])
        _, after = network(driving.crops.half().float(), driving.known)
    seen, facts, actions, likely, values, rewards, ends = (torch.stack(rows) for rows in zip(*kept, strict=True))
    return Rollout(seen, facts, actions, likely, values, rewards, ends, after), counts


def learn(
    network: Network,
    optimizer: torch.optim.Optimizer,
    taken: Rollout,
    entropy: float,
    share: int,
    *,
    is_critic_alone: bool = False,
) -> None:
    """Improve the network, or its critic alone, by a rollout, and by those of the other processes."""
    advantage, following = torch.zeros_like(taken.after), taken.after
    advantages = torch.zeros_like(taken.rewards)
    for t in reversed(range(len(taken.rewards))):
        goes_on = 1 - taken.ended[t]
        surprise = taken.rewards[t] + GAMMA * following * goes_on - taken.values[t]
        advantage = surprise + GAMMA * DECAY * goes_on * advantage
        advantages[t], following = advantage, taken.values[t]
    returns = (advantages + taken.values).flatten()
    crops, facts = taken.crops.flatten(0, 1), taken.known.flatten(0, 1)
    actions, likely, gained = taken.actions.flatten(), taken.likely.flatten(), advantages.flatten()
    batches = max(len(actions) * share // BATCH_STEPS, 1)
    for _ in range(EPOCHS):
        for chosen in torch.randperm(len(actions), device=actions.device).chunk(batches):
            logits, value = network(crops[chosen].float(), facts[chosen])
            choice = torch.distributions.Categorical(logits=logits, validate_args=False)
            normal = (gained[chosen] - gained[chosen].mean()) / (gained[chosen].std() + 1e-6)
            ratio = (choice.log_prob(actions[chosen]) - likely[chosen]).exp()
            objective = torch.min(ratio * normal, ratio.clamp(1 - CLIP, 1 + CLIP) * normal).mean()
            loss = 0.5 * functional.mse_loss(value, returns[chosen]) - objective - entropy * choice.entropy().mean()
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            if share > 1:
                _average([each.grad for each in network.parameters()], share)
            if is_critic_alone:
                for name, each in network.named_parameters():
                    each.grad = each.grad if name.startswith("critic") else None
            nn.utils.clip_grad_norm_(network.parameters(), 0.5)
            optimizer.step()


def _average(tensors: Sequence[Tensor], share: int) -> None:
    flat = torch.cat([each.flatten() for each in tensors]).cpu()
    distributed.all_reduce(flat)
    flat = (flat / share).to(tensors[0].device)
    for each, part in zip(tensors, flat.split([each.numel() for each in tensors]), strict=True):
        each.copy_(part.view_as(each))


def train(places: Path, output: Path, options: Options, device: str, begun_from: Path | None = None) -> None:
    """Train, and write `point_goal.onnx`, `point_goal.pt`, `curve.csv` and `card.md`, once a minute and at the end.

    `begun_from` is a policy as an ONNX file. That has no critic, which learns alone first. Raises BenchbotError when it
    is none, or when there is a policy in `output` to go on with.
    """
    found = courses(places)
    if begun_from is not None:
        if (output / "point_goal.pt").is_file():
            raise BenchbotError(
                f"There is a policy in {output} already.",
                f"Training would go on with it, and not begin from {begun_from}.",
                "Leave --begun-from out, or name another folder: --output RUN",
            )
        # What is wrong with it is told here, once, and not by each process.
        read_onnx(Network(), begun_from)
    processes = min(options.processes, len(found))
    output.mkdir(parents=True, exist_ok=True)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    given = (processes, port, places, output, options, device, begun_from)
    if processes == 1:
        _work(0, *given)
    else:
        multiprocessing.spawn(_work, given, processes)


def _work(
    rank: int,
    processes: int,
    port: int,
    places: Path,
    output: Path,
    options: Options,
    device: str,
    begun_from: Path | None,
) -> None:
    if device == "cuda":  # each process sees one of the devices, which is what it calls the first
        os.environ["CUDA_VISIBLE_DEVICES"] = str(rank % torch.cuda.device_count())
    torch.set_num_threads(1)
    if processes > 1:
        distributed.init_process_group("gloo", f"tcp://127.0.0.1:{port}", rank=rank, world_size=processes)
    torch.manual_seed(options.seed)
    network = Network().to(device)
    if (output / "point_goal.pt").is_file():
        network.load_state_dict(torch.load(output / "point_goal.pt", map_location=device))
    elif begun_from is not None:
        read_onnx(network, begun_from)
    torch.manual_seed(options.seed + 1 + rank)
    optimizer = torch.optim.Adam(network.parameters(), lr=options.rate, eps=1e-5)
    mine = courses(places)[rank::processes]
    drivings = [
        Driving(each, options, device, 1000 * (options.seed + 1) + 100 * rank + i) for i, each in enumerate(mine)
    ]
    if processes > 1:
        distributed.barrier()
    begun, told_s = time.monotonic(), 0.0
    curve: list[tuple[int, float, float, float, int]] = []
    recent: list[Tensor] = []
    update = 0
    while True:
        taken, counts = drive(network, drivings[update % len(drivings)], options.steps)
        progress = torch.tensor([(time.monotonic() - begun) / (60 * options.minutes), update / options.updates])
        shared = torch.cat([counts.cpu(), progress])
        if processes > 1:
            distributed.all_reduce(shared)
            shared[3:] /= processes  # all must see the same end
        done = float(shared[3:].max())
        left = max(1 - done, 0.05)
        for group in optimizer.param_groups:
            group["lr"] = options.rate * left
        is_critic_alone = begun_from is not None and update < CRITIC_ALONE
        learn(network, optimizer, taken, options.entropy * left, processes, is_critic_alone=is_critic_alone)
        recent = [*recent[-49:], shared[:3]]
        update += 1
        steps = update * options.steps * options.environments * processes
        elapsed_s = time.monotonic() - begun
        if rank == 0 and (done >= 1 or elapsed_s - told_s > 30):
            told_s = elapsed_s
            ended, arrived, spl = torch.stack(recent).sum(0).tolist()
            curve.append((steps, elapsed_s / 60, arrived / max(ended, 1), spl / max(ended, 1), int(ended)))
            console.note(
                f"{steps / 1e6:.2f} M steps, {elapsed_s:.0f} s, {steps / elapsed_s:.0f}/s: "
                f"success {curve[-1][2]:.3f}, SPL {curve[-1][3]:.3f} of {int(ended)} episodes"
            )
            _write(output, network, curve, options, places)
        if done >= 1:
            break
    for each in drivings:
        each.envs.close()
    if processes > 1:
        distributed.destroy_process_group()


def _write(
    output: Path,
    network: Network,
    curve: Sequence[tuple[int, float, float, float, int]],
    options: Options,
    places: Path,
) -> None:
    copy = Network()
    copy.load_state_dict({name: value.cpu() for name, value in network.state_dict().items()})
    torch.save(copy.state_dict(), output / "point_goal.pt")
    to_onnx(copy, output / "point_goal.onnx")
    with (output / "curve.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("steps", "minutes", "success", "spl", "episodes"))
        writer.writerows((steps, *(round(each, 4) for each in rates), ended) for steps, *rates, ended in curve)
    steps, minutes, success, spl, ended = curve[-1]
    lines = [
        "# Policy that drives to a point",
        "",
        f"Trained in {len(courses(places))} generated places for {steps} steps, {minutes:.1f} minutes on "
        f"{torch.cuda.get_device_name() if torch.cuda.is_available() else 'processors'}, torch {torch.__version__}; "
        + ", ".join(f"{key} {value}" for key, value in asdict(options).items())
        + ". No environment that is shipped was seen.",
        "",
        f"Success {success:.3f} and SPL {spl:.3f} of the last {ended} episodes of training, actions drawn.",
        "",
    ]
    write_atomically(output / "card.md", "\n".join(lines).encode())


def main() -> None:
    """Read the command line and train."""
    parser = argparse.ArgumentParser(
        prog="python -m benchbot_baselines.policy_training", description="Train the policy that drives to a point."
    )
    parser.add_argument("places", type=Path, help="what python -m benchbot_baselines.practice wrote")
    parser.add_argument("--output", type=Path, required=True, help="where point_goal.onnx, curve.csv and card.md go")
    parser.add_argument("--begun-from", type=Path, metavar="FILE", help="a point_goal.onnx to improve")
    for name, default in asdict(Options()).items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    given = vars(parser.parse_args())
    places, output, device, begun_from = (given.pop(name) for name in ("places", "output", "device", "begun_from"))
    os.environ["BENCHBOT_ADDONS"] = str(places)
    try:
        train(places, output, Options(**given), device, begun_from)
    except BenchbotError as error:
        console.error(error)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
