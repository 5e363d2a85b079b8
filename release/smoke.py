"""A short look at an installation from outside, as its user would: nothing of the checkout is in reach."""

import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from release.contents import SCRIPTS
from release.environments import Environment

TIMEOUT_S = 900
TASK = "semantic_slam:passive:ground_truth:segmentation"
RESULT = {
    "task_details": {"name": "sample", "results_format": "object_map"},
    "environment_details": [{"name": "miniroom", "variant": 1}],
    "results": {"class_list": ["bottle", "background"], "objects": []},
}
IMPORT_ALL = """
import importlib, pkgutil, sys
missing = set()
for root in sys.argv[1:]:
    package = importlib.import_module(root)
    for module in pkgutil.walk_packages(package.__path__, f"{root}.", onerror=lambda name: None):
        if module.name.endswith("__main__"):
            continue
        try:
            importlib.import_module(module.name)
        except Exception as error:
            cause = error if isinstance(error, ModuleNotFoundError) else error.__cause__ or error
            missing.add(f"{module.name} needs {getattr(cause, 'name', repr(cause))}")
print("\\n".join(sorted(missing)))
"""
TOOLS = {"pytest", "_pytest", "IPython", "matplotlib"}
CHALLENGE = {"alembic", "sqlalchemy"}
GO_WITHOUT = {*TOOLS, *CHALLENGE, "aiohttp", "docker", "greenlet", "gymnasium", "textual_serve"}
"""What modules of benchbot may import at once although nothing requires it: each is for people who have it."""


@dataclass
class Place:
    """An environment, and an empty folder to be in."""

    environment: Environment
    folder: Path
    problems: list[str] = field(default_factory=list)

    def run(self, *words: str, codes: tuple[int, ...] = (0,), says: str = "") -> str:
        """Run a command of the environment; note what is not as it should be. Returns its stdout."""
        environment = {
            "PATH": os.pathsep.join([str(self.environment.commands), os.defpath]),
            "HOME": str(self.folder),
            "LANG": "C.UTF-8",
            **{f"BENCHBOT_{kind}_DIR": str(self.folder / kind.lower()) for kind in ("CACHE", "STATE", "DATA")},
        }
        command = [str(self.environment.commands / words[0]), *words[1:]]
        done = subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
        told = f"{done.stdout}\n{done.stderr}".strip()
        if done.returncode not in codes or says not in told or "Traceback" in told or "Internal error" in told:
            wanted = f"exit code {' or '.join(map(str, codes))}" + (f", '{says}'" if says else "")
            said = "\n    ".join(told.splitlines()[-15:])
            self.problems.append(
                f"{' '.join(words)}: {wanted} was wanted; it ended with {done.returncode}:\n    {said}"
            )
        return done.stdout


def try_alone(environment: Environment, folder: Path, version: str) -> list[str]:
    """Return what is wrong with an installation of benchbot without plug-ins."""
    place = Place(environment, folder)
    (folder / "result.json").write_text(json.dumps(RESULT))
    (folder / "task.yaml").write_text("name: tour\nactions: [move_nxt]\nobservations: [laser]\n")
    place.run("benchbot", "--version", says=f"benchbot {version}")
    for script in sorted(SCRIPTS):
        place.run(script, "--help", says="Usage: ")
    place.run("benchbot", "list", "formats", says="object_map")
    place.run("benchbot", "list", "examples", says="hello_passive")
    place.run("benchbot", "list", "tasks")
    place.run("benchbot", "doctor", says="install benchbot-sim-taichi", codes=(0, 2))
    place.run("benchbot", "check", "task.yaml", codes=(2,), says="Did you mean 'move_next'?")
    place.run("benchbot", "check", "benchbot", says="nothing is wrong")
    json.loads(place.run("benchbot", "schema", "task") or "{}")
    place.run("benchbot", "eval", "result.json", codes=(2,), says="Fix: ")
    run = ("benchbot", "run", "--task", TASK, "--robot", "carter", "--env", "miniroom:1")
    place.run(*run, codes=(2,), says="Fix: ")
    place.run("benchbot", "new", "task", "acme-tour", says="acme-tour")
    place.run("benchbot", "check", "acme-tour")
    for words in ("challenge init demo", "challenge log demo", "challenge verify demo", "key make my.key"):
        place.run("benchbot", *words.split(), codes=(2,), says="pip install 'benchbot[challenge]'")
    # Whoever takes part without signing needs nothing more.
    place.run("benchbot", "challenge", "status", "http://127.0.0.1:1", codes=(2,), says="which team hands in")
    place.problems += _imports(place, "benchbot", "benchbot_addons", "benchbot_api", "benchbot_eval")
    return place.problems


def try_full(environment: Environment, folder: Path) -> list[str]:
    """Return what is wrong with an installation of benchbot[full]: it drives a robot, and scores the map."""
    place = Place(environment, folder)
    place.run("benchbot", "list", "tasks", says=TASK)
    place.run("benchbot", "list", "environments", says="miniroom:1")
    place.run("benchbot", "doctor")
    place.run("benchbot", "check", "benchbot-envs-bear", says="nothing is wrong")
    words = ["--task", TASK, "--robot", "carter_lowres", "--env", "miniroom:1", "--example", "segmentation_mapper"]
    words += ["--results-location", "result.json", "--evaluate-with", "omq", "--require", "OMQ>=0.01"]
    place.run("benchbot", "submit", *words)
    place.run("benchbot", "eval", "result.json", "--method", "omq")
    place.run("benchbot", "check", "result.json", says="nothing is wrong")
    return place.problems


def _imports(place: Place, *packages: str) -> Iterator[str]:
    for line in place.run("python", "-c", IMPORT_ALL, *packages).splitlines():
        if line and line.rpartition(" ")[2].partition(".")[0] not in GO_WITHOUT:
            yield f"an import: {line}"
