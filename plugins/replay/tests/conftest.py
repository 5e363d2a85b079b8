"""Runs take place in the sample plug-in's arena, which needs no renderer."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests import conftest
from tests.command_line import BOTTLE, SAMPLE, CommandLine, Finished
from tests.plugin_factory import DECLARES

assert conftest.SAMPLE_PLUGIN

LOOKING = """\
import hashlib, json, sys
import numpy as np
from benchbot.api import ActionResult, Agent, BenchBot

most = int(sys.argv[1]) if len(sys.argv) > 1 else 10**6

def digest(value):
    if isinstance(value, dict):
        return [[key, digest(item)] for key, item in value.items()]
    if isinstance(value, np.ndarray):
        return [value.dtype.str, value.shape, hashlib.sha256(np.ascontiguousarray(value)).hexdigest()]
    return repr(value)

class Looking(Agent):
    def __init__(self):
        self.seen, self.said = [], []

    def is_done(self, result):
        self.said.append([result.name, self.last_outcome])
        return result is not ActionResult.SUCCESS or len(self.seen) >= most

    def pick_action(self, observations, actions):
        self.seen.append(digest(dict(observations)))
        return "move_next", {}

    def save_result(self, filename, empty_results, functions):
        with open(filename, "w") as file:
            json.dump({**empty_results, "seen": self.seen, "said": self.said}, file)

BenchBot(agent=Looking()).run()
"""


PLUGIN = "\n".join(DECLARES.format(kind=kind) for kind in ("environments", "tasks", "robots"))


@dataclass
class Lab:
    """A command line with a solution that writes down what it sees, bit by bit."""

    cli: CommandLine
    solution: str
    make_plugin: Callable[..., Path]
    made: list[str] = field(default_factory=list)
    robots: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __call__(self, *words: str, **changes: str) -> Finished:
        return self.cli(*words, **changes)

    def drive(self, name: str, *words: str, task: str = "sample:passive", env: str = "arena:1", **kept: str) -> "Kept":
        """Drive with the sample robot, and record it."""
        chosen = ["--task", task, "--robot", "sample_robot", "--env", env, "--record", "mcap"]
        return self.kept(name, "submit", *chosen, *words, **kept)

    def replay(self, name: str, recording: Path, *words: str, **kept: str) -> "Kept":
        """Replay a recording."""
        return self.kept(name, "replay", str(recording), *words, **kept)

    def kept(self, name: str, *words: str, argument: str = "") -> "Kept":
        """Submit the solution by a command, which must work, and return what is left of it."""
        native = ["--native", f"{self.solution} {argument}".strip()]
        path = self.cli.folder / f"{name}.json"
        done = self.cli(*words, *native, "-r", str(path), "--display", "none")
        assert done.returncode == 0, done.stderr
        return Kept(json.loads(path.read_text()), path, self.cli.folder / f"{name}-recordings" / "mcap", done.stderr)

    def make(self, name: str, **changes: Any) -> str:
        """Install another arena, with changes; return its name."""
        arena = SAMPLE / "environments" / "arena_1.yaml"
        declared = yaml.safe_load(arena.read_text())
        place, variant = name.split(":")
        absolute = str((arena.parent / declared["map_path"]).resolve())
        document = {**declared, "name": place, "variant": int(variant), "map_path": absolute, **changes}
        self._install(f"test-{place}", "environments", document)
        return name

    def make_task(self, name: str, **changes: Any) -> str:
        """Install another passive task, with changes; return its name."""
        document = yaml.safe_load((SAMPLE / "tasks" / "passive.yaml").read_text())
        self._install(f"test-{len(self.made)}", "tasks", {**document, "name": name, **changes})
        return name

    def make_robot(self, document: dict[str, Any]) -> None:
        """Install a robot."""
        self.robots[document["name"]] = document
        self._install(f"test-{len(self.made)}", "robots", document)

    def robot(self, name: str) -> dict[str, Any]:
        """Return a copy of a robot's declaration that was installed."""
        return deepcopy(self.robots[name])

    def script(self, name: str, code: str) -> Path:
        """Write a program."""
        path = self.cli.folder / name
        path.write_text(code)
        return path

    def run(self, script: Path) -> str:
        """Run a program of its own, and return what it prints."""
        command = [sys.executable, str(script)]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, cwd=self.cli.folder, env=self.cli.variables
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def truth(self, environment: str) -> Path:
        """Write a ground truth of an environment, a bottle, and return its file."""
        name, variant = environment.split(":")
        objects = [{"class": "bottle", "ID_name": "b", "isgroup": False, **BOTTLE}]
        document = {
            "environment": {"name": name, "variant": int(variant)},
            "format": {"name": "object_map_ground_truth"},
            "ground_truth": {"objects": objects, "class_list": ["bottle", "background"], "synonyms": {}},
        }
        path = self.cli.folder / "truth.json"
        path.write_text(json.dumps(document))
        return path

    def forget(self) -> None:
        """Uninstall what was made."""
        kept = [name for name in self.cli.variables["BENCHBOT_PLUGINS"].split(",") if name not in self.made]
        self.cli.variables["BENCHBOT_PLUGINS"] = ",".join(kept)

    def _install(self, distribution: str, kind: str, document: dict[str, Any]) -> None:
        self.made.append(distribution)
        files = {f"{kind}/one.yaml": json.dumps(document)}
        self.make_plugin(
            distribution, PLUGIN, {f"{folder}/none.txt": "" for folder in ("environments", "robots", "tasks")} | files
        )


@dataclass
class Kept:
    """What is left of a submission: its result, that one's file, its recording, and what was said."""

    result: dict[str, Any]
    path: Path
    recording: Path
    said: str

    @property
    def provenance(self) -> dict[str, Any]:
        provenance: dict[str, Any] = self.result["provenance"]
        return provenance


PLUGINS = "benchbot-sample,benchbot-eval-omq,benchbot-record-mcap,benchbot-replay"


@pytest.fixture(scope="session")
def driven_once(tmp_path_factory: pytest.TempPathFactory) -> Kept:
    """What is left of a run along the whole trajectory of arena:1."""
    home = tmp_path_factory.mktemp("driven")
    variables = {
        **{name: value for name, value in os.environ.items() if not name.startswith("BENCHBOT_")},
        "BENCHBOT_STATE_DIR": str(home / "state"),
        "BENCHBOT_CACHE_DIR": str(home / "cache"),
        "BENCHBOT_PLUGINS": PLUGINS,
    }
    cli = CommandLine(home, variables, home)
    return Lab(cli, cli.script("looking.py", LOOKING), lambda: home).drive("driven")


@pytest.fixture
def driven(driven_once: Kept, cli: CommandLine) -> Kept:
    """The same, where the command line under test is."""
    path = Path(shutil.copy(driven_once.path, cli.folder))
    folder = cli.folder / "driven-recordings" / "mcap"
    shutil.copytree(driven_once.recording, folder)
    return Kept(driven_once.result, path, folder, driven_once.said)


@pytest.fixture
def lab(cli: CommandLine, make_plugin: Callable[..., Path]) -> Lab:
    cli.variables["BENCHBOT_PLUGINS"] = PLUGINS
    return Lab(cli, cli.script("looking.py", LOOKING), make_plugin)
