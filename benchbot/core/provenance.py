"""Provenance: everything that determined a result, so that two results can be compared."""

import os
import platform as python_platform
import subprocess
from dataclasses import asdict
from functools import cache
from hashlib import file_digest, sha256
from importlib.metadata import requires, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import benchbot
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.selection import Selection
from benchbot.core.session import Session


def provenance(session: Session, solution: dict[str, Any] | None) -> dict[str, Any]:
    """Return the provenance of a session's result.

    It holds nothing that differs between two runs with the same seed on the same machine: wall-clock timings are kept
    apart (see `timings`), so that the same run gives the same bytes.
    """
    selection, progress, spent = session.selection, session.progress, session.progress.spent
    limits = {name: value for name, value in asdict(selection.limits).items() if value is not None}
    failure = None
    if progress.failure is not None:
        failure = {"class": progress.failure.value, "why": progress.failure_why or ""}
    return {
        **software(selection),
        "selection": {
            "task": selection.task.name,
            "robot": selection.robot.name,
            "environment": selection.environment,
            **disclosed(selection),
            **({} if selection.episode is None else {"episode": selection.episode.provenance()}),
            **({"settings": dict(sorted(selection.settings.items()))} if selection.settings else {}),
            **({"limits": limits} if limits else {}),
        },
        **({"replay": _replayed(selection)} if "replay" in selection.robot.data else {}),
        "solution": solution,
        "restarts": spent.restarts,
        **({"spent": spent.repeatable(progress.time_key)} if spent.restarts else {}),
        **({"taken_over": _taken_over(session.taken_over_s)} if session.taken_over_s else {}),
        **({"driven_by_hand": session.driven_by_hand} if session.driven_by_hand else {}),
        "steps": progress.steps,
        "frames": progress.frames,
        progress.time_key: round(progress.simulated_time_s, 9),
        "failure": failure,
        **({"robot": dict(session.robot)} if session.robot is not None else {}),
        "observation_digest": session.digest.hexdigest(),
        "machine": {
            "python": python_platform.python_version(),
            "system": python_platform.system(),
            "architecture": python_platform.machine(),
            **session.machine,
        },
    }


def _replayed(selection: Selection) -> dict[str, Any]:
    return {scene.name: selection.robot.data["replay"][scene.name] for scene in selection.environments}


def _taken_over(durations_s: list[float]) -> dict[str, float]:
    return {"times": len(durations_s), "duration_s": round(sum(durations_s), 3)}


def disclosed(selection: Selection) -> dict[str, Any]:
    """Return the seed, and the secret with the commitment to both if there is one: not for a solution."""
    if not selection.secret:
        return {"seed": selection.seed}
    return {"seed": selection.seed, "secret": selection.secret, "commitment": selection.commitment}


def software(selection: Selection) -> dict[str, Any]:
    """Return versions and hashes of BenchBot and of what determines a run's result beside what was selected."""
    folders = (declaration.folder for declaration in _declared(selection))
    pool = plugin_manager.load().pool("asset_packs")
    # The packs that stand in for the scenes' own models are pinned by the hashes of their catalogues.
    packs = {name: {"sha256": _file_hash(pool[name].value.catalogue)} for name in _assets_named(selection)}
    return {
        "benchbot": benchbot.__version__,
        "plugins": {
            **{
                name: {"version": version(name), "sha256": distribution_hash(name)}
                for name in sorted(distributions_used(selection))
            },
            **{
                one.name: {"version": one.version, "sha256": one.content_hash()}
                for one in dict.fromkeys(folders)
                if one
            },
        },
        **({"assets": packs} if packs else {}),
    }


def source_of_pose(selection: Selection) -> str:
    """Return the source of the track's poses: a `simulation`, a real `robot`, or a `recording` of one of them."""
    if "replay" in selection.robot.data:
        return "recording"
    return "robot" if selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers") else "simulation"


def timings(session: Session) -> dict[str, float]:
    """Return what differs from run to run: wall-clock seconds and frames per second."""
    wall_s = session.progress.wall_time_s
    return {
        "wall_time_s": round(wall_s, 3),
        "frames_per_s": round(session.progress.frames / wall_s, 3) if wall_s > 0 else 0.0,
        "real_time_factor": round(session.progress.simulated_time_s / wall_s, 3) if wall_s > 0 else 0.0,
    }


def distributions_used(selection: Selection) -> set[str]:
    """Return the distributions whose code or declarations determine a run's result."""
    loaded = plugin_manager.load()
    kind = selection.robot.data["type"]
    # The fake robot of the conformance kit runs on nothing.
    runs_on = [pool[kind].distribution for pool in map(loaded.pool, ("simulators", "robot_drivers")) if kind in pool]
    declared = (declaration for declaration in _declared(selection) if declaration.folder is None)
    packs = (loaded.pool("asset_packs")[name].distribution for name in _assets_named(selection))
    return _with_required({"benchbot", *runs_on, *(declaration.distribution for declaration in declared), *packs})


def _with_required(distributions: set[str]) -> set[str]:
    """Return distributions and those that they require, as far as they are plug-ins, too."""
    from packaging.requirements import Requirement
    from packaging.utils import canonicalize_name

    known = {canonicalize_name(info.distribution): info.distribution for info in plugin_manager.installed()}
    found, left = set[str](), set(distributions)
    while left:
        distribution = left.pop()
        found.add(distribution)
        required = map(Requirement, requires(distribution) or ())
        # Without extras: a run uses no more than what it names.
        needed = [one for one in required if one.marker is None or one.marker.evaluate({"extra": ""})]
        names = {canonicalize_name(one.name) for one in needed}
        left |= {known[name] for name in names if name in known} - found
    return found


def _assets_named(selection: Selection) -> list[str]:
    return sorted({str(scene.data["assets"]) for scene in selection.environments if "assets" in scene.data})


def _declared(selection: Selection) -> list[Declaration]:
    results_format = [] if selection.results_format is None else [selection.results_format]
    episodes = [] if selection.episode is None else [selection.episode.listed]
    return [selection.task, selection.robot, *selection.environments, *results_format, *episodes]


@cache
def distribution_hash(distribution: str) -> str:
    """Return the SHA-256 over the names and bytes of the files of a plug-in's top-level packages."""
    digest = sha256()
    modules = {info.module for info in plugin_manager.installed() if info.distribution == distribution}
    for package in sorted({module.partition(".")[0].partition(":")[0] for module in modules}):
        spec = find_spec(package)
        for folder in (spec.submodule_search_locations if spec else None) or ():
            root = Path(folder)
            for file in sorted(Path(top, name) for top, _, names in os.walk(root, followlinks=True) for name in names):
                if "__pycache__" not in file.parts:
                    digest.update(f"{package}/{file.relative_to(root).as_posix()}\0".encode())
                    digest.update(file.read_bytes())
    return digest.hexdigest()


def solution_details(command: list[str], folder: Path) -> dict[str, Any]:
    """Return what ran as the solution: its command, the SHA-256 of each file that it names and its git revision.

    Files are named relative to `folder`, where the command runs; outside a git work tree there is no revision.
    """

    def git(*arguments: str) -> str | None:
        try:
            done = subprocess.run(
                ["git", "-C", str(folder), *arguments],  # noqa: S607
                capture_output=True,
                text=True,
                timeout=5,
                check=True,
            )
        except (OSError, subprocess.SubprocessError):
            return None
        return done.stdout.strip()

    details: dict[str, Any] = {"command": command, "files": files_named(command, folder)}
    revision = git("rev-parse", "HEAD")
    if revision is not None:
        details["git_revision"] = revision
        details["git_dirty"] = git("status", "--porcelain", "--untracked-files=no") != ""
    return details


def files_named(command: list[str], folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file that a command names, relative to `folder`, where it runs."""
    return {word: _file_hash(folder / word) for word in _files_named(command, folder)}


def file_marks(command: list[str], folder: Path) -> dict[str, tuple[int, ...]]:
    """Return what changes, for each file that a command names, with every write to it and when it is replaced."""
    found = {word: (folder / word).stat() for word in _files_named(command, folder)}
    return {word: (one.st_ino, one.st_size, one.st_mtime_ns, one.st_ctime_ns) for word, one in found.items()}


def _files_named(command: list[str], folder: Path) -> list[str]:
    return [word for word in dict.fromkeys(command[1:]) if not word.startswith("-") and is_file(folder / word)]


def is_file(path: Path) -> bool:
    """Say whether a path, perhaps a word that was never meant as one, names a file."""
    try:
        return path.is_file()
    except OSError:  # a word may be longer than a name of a file can be
        return False


def _file_hash(path: Path) -> str:
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
