"""Learners as they are on environments stepped as arrays: Stable-Baselines3, and a loop as CleanRL has it.

python -m benchmarks learners [--device cuda] [--envs 16] [--steps 2048] [--json FILE]

Needs stable-baselines3, which is no part of what tests install: pip install stable-baselines3.
Both train PPO on depth and goal of benchbot/PointGoal-v0 for a few updates, and print their steps per second, learning
included. It fails where a value is not finite, or where Gymnasium's or Stable-Baselines3's checkers complain.
"""

import argparse
import json
import time
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env as check_for_stable_baselines
from torch import nn

import benchbot.gymnasium  # noqa: F401  registers the environments
from benchbot.plugins.gymnasium.stable_baselines import StableBaselinesEnv

NAME = "benchbot/PointGoal-v0"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--steps", type=int, default=2048, help="of all environments together")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the rates to this file")
    options = parser.parse_args()
    choices: dict[str, Any] = {"image_size": (64, 64), "platform_options": {"device": options.device}}
    with warnings.catch_warnings():
        warnings.filterwarnings("error", category=UserWarning, module="gymnasium")
        check_env(gymnasium.make(NAME, **choices).unwrapped)
        print("gymnasium's check_env: clean")
    check_for_stable_baselines(gymnasium.make(NAME, **choices), warn=True)
    print("stable_baselines3's check_env: clean")
    rates = {
        name: learn(options.envs, options.steps, options.device, choices)
        for name, learn in (("stable_baselines3", stable_baselines), ("clean_loop", clean_loop))
    }
    if options.json:
        options.json.write_text(json.dumps(rates, indent=1) + "\n", encoding="utf-8")


def stable_baselines(count: int, steps: int, device: str, choices: dict[str, Any]) -> float:
    """Train by Stable-Baselines3's own PPO; return steps per second."""
    made = gymnasium.make_vec(NAME, count, autoreset_mode=AutoresetMode.SAME_STEP, max_episode_steps=40, **choices)
    envs = StableBaselinesEnv(made)
    model = PPO("MultiInputPolicy", envs, n_steps=32, batch_size=128, n_epochs=2, seed=0, device=device)
    started_s = time.perf_counter()
    model.learn(steps)
    rate = float(model.num_timesteps / (time.perf_counter() - started_s))
    episodes = list(model.ep_info_buffer)
    assert episodes
    assert all(np.isfinite(each["r"]) and 0 < each["l"] <= 40 for each in episodes)
    masks = np.stack(envs.env_method("action_masks"))
    assert masks.shape == (count, 3)
    envs.close()
    print(f"stable_baselines3 PPO: {model.num_timesteps} steps, {rate:.0f}/s, {len(episodes)} episodes ended")
    return rate


class Agent(nn.Module):  # type: ignore[misc]  # it is not installed where types are checked
    """Depth and goal in, the logits of three moves and a value out."""

    def __init__(self) -> None:
        super().__init__()
        self.eye = nn.Sequential(nn.Conv2d(1, 8, 8, 8), nn.ReLU(), nn.Flatten(), nn.Linear(8 * 64, 32), nn.ReLU())
        self.actor, self.critic = nn.Linear(32 + 9, 3), nn.Linear(32 + 9, 1)

    def forward(self, observation: dict[str, torch.Tensor]) -> tuple[torch.Tensor, torch.Tensor]:
        seen = self.eye(observation["image_depth"][:, None] / 20.0)
        known = torch.cat([seen, observation["goal"], observation["pose_base_link"]], 1)
        return self.actor(known), self.critic(known)[:, 0]


def clean_loop(count: int, steps: int, device: str, choices: dict[str, Any]) -> float:
    """Train by a loop over tensors, with generalised advantages and a clipped objective; return steps per second."""
    envs = gymnasium.make_vec(NAME, count, tensors="torch", max_episode_steps=40, **choices)
    agent = Agent().to(device)
    optimizer = torch.optim.Adam(agent.parameters(), lr=2.5e-4)
    rollout, gamma, decay = 32, 0.99, 0.95
    observation, _ = envs.reset(seed=1)
    done = torch.zeros(count, device=device)
    ended, started_s = 0, time.perf_counter()
    for _ in range(max(steps // (rollout * count), 1)):
        kept: list[tuple[Any, ...]] = []
        for _ in range(rollout):
            with torch.no_grad():
                logits, value = agent(observation)
            choice = torch.distributions.Categorical(logits=logits)
            action = choice.sample()
            following, reward, terminated, truncated, _ = envs.step(action)
            kept.append((observation, action, choice.log_prob(action), value, reward, done))
            observation, done = following, (terminated | truncated).float()
            ended += int(done.sum())
        with torch.no_grad():
            _, following_value = agent(observation)
        advantage, following_done = torch.zeros(count, device=device), done
        advantages: list[torch.Tensor] = []
        for _, _, _, value, reward, was_done in reversed(kept):
            surprise = reward + gamma * following_value * (1 - following_done) - value
            advantage = surprise + gamma * decay * (1 - following_done) * advantage
            advantages.insert(0, advantage)
            following_value, following_done = value, was_done
        for (seen, action, likely, value, _, _), gained in zip(kept, advantages, strict=True):
            logits, now = agent(seen)
            choice = torch.distributions.Categorical(logits=logits)
            ratio = (choice.log_prob(action) - likely).exp()
            objective = torch.min(ratio * gained, ratio.clamp(0.8, 1.2) * gained).mean()
            loss = 0.5 * (now - (gained + value)).pow(2).mean() - objective - 0.01 * choice.entropy().mean()
            assert torch.isfinite(loss)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    taken = max(steps // (rollout * count), 1) * rollout * count
    rate = taken / (time.perf_counter() - started_s)
    envs.close()
    print(f"CleanRL-like PPO: {taken} steps, {rate:.0f}/s, {ended} episodes ended")
    return rate


if __name__ == "__main__":
    main()
