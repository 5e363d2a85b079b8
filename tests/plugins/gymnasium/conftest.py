from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import gymnasium
import pytest

import benchbot.gymnasium  # noqa: F401  registers the environments

SAMPLE = {"task": "sample:active", "robot": "sample_robot", "env": "arena:1"}


@pytest.fixture(autouse=True)
def _folders_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))


@pytest.fixture
def make() -> Iterator[Callable[..., gymnasium.Env[Any, Any]]]:
    """Makes environments of the sample robot that are closed at the end of the test."""
    with ExitStack() as stack:

        def create(**choices: Any) -> gymnasium.Env[Any, Any]:
            env: gymnasium.Env[Any, Any] = gymnasium.make("benchbot/Task-v0", **{**SAMPLE, **choices})
            stack.callback(env.close)
            return env

        yield create
