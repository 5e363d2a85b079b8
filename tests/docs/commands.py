"""The commands on a page of the documentation, and how tests run them: as they stand, in a folder of their own."""

import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.docs.blocks import blocks

START_TIMEOUT_S = 120.0
_PROMPT = re.compile(r"^\$ ", re.MULTILINE)


def commands(page: str) -> list[str]:
    """Return the `benchbot` commands in the shell blocks of a page, each on one line, without comments and prompts."""
    shells = [_PROMPT.sub("", block.text) for block in blocks(page) if block.language in {"bash", "console"}]
    lines = [line for text in shells for line in text.replace("\\\n", " ").splitlines()]
    return [shlex.join(shlex.split(line, comments=True)) for line in lines if line.startswith("benchbot ")]


def words(command: str, folder: Path) -> list[str]:
    """Return a command's words as a shell in `folder` would; `benchbot` and `python` are those of this Python."""
    program, *rest = shlex.split(command.replace("$PWD", str(folder)))
    assert program == "benchbot"
    return [sys.executable, "-m", "benchbot", *(sys.executable if word == "python" else word for word in rest)]


def variables(folder: Path, cache: Path) -> dict[str, str]:
    """Return the environment of commands whose runs are kept in `folder`."""
    return {**os.environ, "BENCHBOT_STATE_DIR": str(folder / "state"), "BENCHBOT_CACHE_DIR": str(cache)}


@contextmanager
def back_end(command: str, folder: Path, cache: Path) -> Iterator[dict[str, str]]:
    """Run a back end, on any free port, and yield the variables that lead to it."""
    environment = variables(folder, cache)
    with (folder / "run.log").open("w") as log:
        running = subprocess.Popen([*words(command, folder), "--port", "0"], env=environment, stderr=log, stdout=log)
        try:
            deadline_s = time.monotonic() + START_TIMEOUT_S
            while not list(folder.glob("state/runs/*/run.json")):
                assert running.poll() is None, (folder / "run.log").read_text()
                assert time.monotonic() < deadline_s
                time.sleep(0.05)
            yield environment
        finally:
            running.terminate()
            running.wait()


def succeed(command: str, folder: Path, environment: dict[str, str]) -> "subprocess.CompletedProcess[str]":
    """Run a command that must succeed."""
    done = subprocess.run(
        words(command, folder), cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done
