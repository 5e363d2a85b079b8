"""Measuring the same solutions in two simulators: two batches, of which that of the reference is kept for the next."""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchbot.core import atomic, resources, results
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.findings import Finding, Level
from benchbot.core.plugin_manager import installed
from benchbot.core.provenance import distribution_hash
from benchbot.plugins.certification.certificate import Row

MAPPER = Path(__file__).parent / "solutions" / "ranked_mapper.py"
REFERENCE_SUFFIX = "_by_reference"
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Measurement:
    """What is measured: solutions by name, as `--solution` of a batch takes them, in rooms, by a method."""

    task: str
    method: str
    rooms: tuple[str, ...]
    solutions: Mapping[str, str]


def measurement(rooms: Sequence[str], *, quick: bool) -> Measurement:
    """Return what a certificate measures: mappers of four qualities, or with `quick` two of them."""
    solutions = {
        "mapper": mapper(),
        "mapper_near": mapper("--reach-m", "1.5"),
        "mapper_sparse": mapper("--every", "12"),
        "blind": "example:hello_passive",
    }
    kept = {name: solutions[name] for name in ("mapper", "mapper_sparse")} if quick else solutions
    return Measurement("semantic_slam:passive:ground_truth:segmentation", "omq", tuple(rooms), kept)


def mapper(*words: str) -> str:
    """Return the command of a mapper, as `--solution` takes it."""
    return shlex.join([sys.executable, str(MAPPER), *words])


def conformance(simulator: str, robot: str, environment: str) -> list[Finding]:
    """Return the findings of the conformance kit, of a process of its own; one that says so where that died."""
    words = ["-m", "benchbot.plugins.certification.conformance_run", simulator, robot, environment]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["It said nothing."])[-1]
        detail = f"The simulator ended the process that checked it, with status {done.returncode}: {last}"
        fix = f"Run it by itself: {shlex.join(['python', *words])}"
        return [Finding(Level.BROKEN, "conformance", detail, fix)]
    entries = json.loads(done.stdout.strip().splitlines()[-1])
    return [Finding(Level(one["level"]), one["subject"], one["detail"], one["fix"]) for one in entries]


def in_the_reference(robot: Declaration, reference: str) -> dict[str, Any]:
    """Return the declaration of the same robot, with the same sensors, in the reference simulator."""
    worlds = robot.data.get("runs_in", [robot.data["type"]])
    name = f"{robot.data['name']}{REFERENCE_SUFFIX}"
    return {**robot.data, "name": name, "type": reference, "runs_in": [*dict.fromkeys([*worlds, reference])]}


def reference_folder(declared: Mapping[str, Any], measured: Measurement, catalog: Catalog) -> Path:
    """Return where the reference's batch is kept: a folder of a name that says all that its scores depend on."""
    rooms = [room.data for name in measured.rooms for room in catalog.environments(name)]
    software = {name: distribution_hash(name) for name in {info.distribution for info in installed()}}
    solutions = [*measured.solutions.items(), sha256(MAPPER.read_bytes()).hexdigest()]
    content = json.dumps([declared, rooms, solutions, measured.task, measured.method, software], sort_keys=True)
    return resources.cache_dir() / "certificates" / sha256(content.encode()).hexdigest()[:16]


def scores(
    robot: str, measured: Measurement, folder: Path, tell: Tell, declared: Mapping[str, Any] | None = None
) -> dict[tuple[str, str], float]:
    """Return the scores by solution and room of a batch in `folder`, which goes on where it was ended.

    `declared` is the declaration of a robot that is not installed. Raises BenchbotError for a batch that cannot be.
    """
    addons = []
    if declared is not None:
        path = folder / "addons" / "robots" / f"{robot}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        # JSON is YAML; `robots` is a folder of an add-on, as --addons reads it.
        atomic.write_text(path, json.dumps(declared, indent=1))
        addons = ["--addons", str(folder / "addons")]
    named = [word for name, solution in measured.solutions.items() for word in ("--solution", f"{name}={solution}")]
    words = [
        *("batch", "run", *addons, "--task", measured.task, "--robots", robot, "--envs", ",".join(measured.rooms)),
        *(*named, "--evaluate-with", measured.method, "--output-location", str(folder / "batch"), "--no-canary"),
        *("--display", "plain", "--json"),
    ]
    tell(f"{robot}: {len(measured.solutions)} solutions in {', '.join(measured.rooms)}")
    # Its status lines go where this one's go; its JSON is nobody's business.
    done = subprocess.run(
        [sys.executable, "-m", "benchbot", *words], stdout=subprocess.PIPE, text=True, check=False, env=dict(os.environ)
    )
    if done.returncode not in (ExitCode.OK, ExitCode.SUBMISSION_FAILED):
        raise BenchbotError(
            f"The solutions could not be run with the robot '{robot}'.",
            f"The batch ended with status {done.returncode}; what it said is above.",
            f"Mend that, and run the same command again; or run the batch alone: {shlex.join(['benchbot', *words])}",
            exit_code=ExitCode.INTERNAL,
        )
    found = {}
    for name in measured.solutions:
        path = folder / "batch" / "scores" / name / "scores.json"
        if path.is_file():
            document = results.read_scores(path)
            headline = document["method"]["headline"]
            for row in document["rows"]:
                if row.get("failure") is None and headline in row["scores"]:
                    found[name, str(row["environment"])] = float(row["scores"][headline])
    return found


def rows(
    measured: Measurement, here: Mapping[tuple[str, str], float], there: Mapping[tuple[str, str], float]
) -> tuple[Row, ...]:
    """Return a row for each solution in each room, in order."""
    return tuple(
        Row(name, room, here.get((name, room)), there.get((name, room)))
        for name in measured.solutions
        for room in measured.rooms
    )
