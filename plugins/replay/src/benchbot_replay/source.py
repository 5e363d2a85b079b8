"""Recordings as a source of declarations: a robot `replay`, and the environments that are not installed here.

`--recording FILE` is taken out of the words of a command before typer reads them, and kept in `BENCHBOT_RECORDINGS`,
which the back end's processes and a batch's workers inherit.
"""

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, cache_dir, write_text

if TYPE_CHECKING:
    from benchbot.plugin import Evaluator
    from benchbot_replay.recordings import Recorded

VARIABLE = "BENCHBOT_RECORDINGS"
OPTION = "--recording"
ROBOT = "replay"
HELP = "    --recording FILE  replay what was recorded as the robot 'replay'; repeatable\n"
CHANNELS_OF_EPISODES = ("goal",)
_OF_NO_USE = ("address", "driver", "limits", "speed_factor", "stops_before_contact", "tolerances")
"""What a robot's declaration says of how it moves, or is reached: nothing of it applies to a recording."""


@dataclass(frozen=True)
class RecordingFolder:
    """What recordings declare, in files of their own (`benchbot.plugin.DeclarationFolder`)."""

    root: Path
    recordings: "tuple[Recorded, ...]"

    name = "recording"
    version = "recording"
    stands_in = True

    def sources(self, kind: str) -> list[Path]:
        """Return the folder that declares a kind."""
        return [self.root / kind] if kind in ("robots", "environments") else []

    def evaluators(self) -> "Iterable[Evaluator | BenchbotError]":
        """Return nothing: a recording has no code."""
        return ()

    def functions(self, declaration: Path, names: Mapping[str, str]) -> dict[str, Callable[..., Any]]:
        """Return nothing: a recording has no code."""
        return {}

    def require_trust(self) -> None:
        """Return: a recording has no code."""

    def content_hash(self) -> str:
        """Return the SHA-256 of the recordings' own, sorted."""
        return sha256("\n".join(sorted(one.sha256 for one in self.recordings)).encode()).hexdigest()

    def removal(self) -> str:
        """Return the words that declare it no longer."""
        return f"leave out {OPTION} {self.recordings[0].path}"


def named() -> list[Path]:
    """Return the files of the recordings in use in this process."""
    return [Path(name) for name in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep))]


def in_use() -> "tuple[Recorded, ...]":
    """Return the recordings in use in this process; raises BenchbotError for one that cannot be replayed."""
    names = named()
    if not names:
        return ()
    from benchbot_replay.recordings import read  # with all that a recording is read with

    return tuple(map(read, names))


def folders() -> list[RecordingFolder]:
    """Return what the recordings in use declare, all of it as one folder."""
    recordings = in_use() if named() else ()
    return [_folder(recordings)] if recordings else []


def take_options(words: Sequence[str]) -> list[str]:
    """Return the words without `--recording FILE`, which is in use from now on. What follows `--` stays as it is."""
    rest, found, left = list[str](), list[str](), list(words)
    while left and left[0] != "--":
        word = left.pop(0)
        if word == OPTION or word.startswith(f"{OPTION}="):
            found.append(word.partition("=")[2] or (left.pop(0) if "=" not in word and left else ""))
        else:
            rest.append(word)
    if "" in found:
        raise BenchbotError(
            f"{OPTION} names no file.",
            "It is followed by a recording of a run.",
            f"Write it like this: {OPTION} result-recordings/mcap",
        )
    if found:
        use(map(Path, found))
    return rest + left


def use(paths: Iterable[Path]) -> None:
    """Use recordings in this process and those that it starts; raises BenchbotError for one that cannot be replayed."""
    from benchbot_replay.recordings import file_of

    wanted = [*named(), *(file_of(path) for path in paths)]
    os.environ[VARIABLE] = os.pathsep.join(dict.fromkeys(map(str, wanted)))
    folders()


def _folder(recordings: "tuple[Recorded, ...]") -> RecordingFolder:
    robot = robot_of(recordings)
    environments = {name: scene for one in recordings for name, scene in one.environments.items()}
    documents = {f"robots/{ROBOT}.yaml": robot}
    for number, scene in enumerate(environments.values()):
        # Settings of the run are applied to it as to an installed one.
        documents[f"environments/{number}.yaml"] = {key: value for key, value in scene.items() if key != "robots"}
    texts = {name: json.dumps(document, sort_keys=True, indent=1) for name, document in documents.items()}
    root = cache_dir() / ROBOT / sha256(json.dumps(texts, sort_keys=True).encode()).hexdigest()[:32]
    for name, text in texts.items():
        if not (root / name).exists():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            write_text(root / name, text)
    return RecordingFolder(root, recordings)


def robot_of(recordings: "Sequence[Recorded]") -> dict[str, Any]:
    """Return the declaration of the robot `replay`: the recorded one's, with the channels that are recorded.

    Raises BenchbotError for recordings of different robots or localisation, and for two of one scene.
    """
    first = recordings[0]
    played: dict[str, dict[str, Any]] = {}
    for one in recordings:
        if one.robot != first.robot or one.localisation != first.localisation:
            raise BenchbotError(
                "The recordings are not of one robot.",
                f"{first.path} is of '{first.robot['name']}' with {first.localisation} poses, "
                f"{one.path} of '{one.robot['name']}' with {one.localisation} poses.",
                "Replay them one after the other.",
            )
        for scene in one.scenes:
            if scene.name in played:
                raise BenchbotError(
                    f"Two recordings are of '{scene.name}'.",
                    f"One of them is {one.path}; which one a run is to replay is not said.",
                    "Replay them one after the other.",
                )
            played[scene.name] = {
                "robot": first.robot["name"],
                "sha256": one.sha256,
                "steps": scene.steps,
                "from": one.origin,
                **({} if one.bag_sha256 is None else {"bag_sha256": one.bag_sha256}),
                **({"lossy": list(one.lossy)} if one.lossy else {}),
            }
    common = set.intersection(*(set(one.channels) for one in recordings)) - set(CHANNELS_OF_EPISODES)
    kept = {key: value for key, value in first.robot.items() if key not in _OF_NO_USE}
    connections = {channel: {"connection": "ros_to_api"} for channel in first.channels if channel in common}
    types = sorted({str(scene["type"]) for one in recordings for scene in one.environments.values()})
    return {
        **kept,
        "name": ROBOT,
        "type": ROBOT,
        "runs_in": types,
        "description": f"A recording of {first.robot['name']}.",
        "connections": {**connections, "move_next": {"connection": "api_to_ros"}},
        "replay": played,
    }
