"""Recordings of runs, as `--record mcap` writes them: which run, and which observation followed from which action.

Only this is read here, and kept in BenchBot's cache; what was observed is read from the file when it is replayed.
"""

import json
import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any, NamedTuple

from benchbot.plugin import BenchbotError, Pose, cache_dir, write_text
from benchbot_record_mcap import exact
from benchbot_record_mcap.bag import NOTES
from benchbot_record_mcap.reading import decoded
from benchbot_record_mcap.topics import ACTION, EXACT, PROGRESS

INDEX_VERSION = 1
SAME = ("start_pose", "trajectory_poses", "object_labels")
"""Keys of an environment that must be as they were when it was recorded."""
NEW_ONE = "Record the run again: benchbot submit … --record mcap=FOLDER"


class Moment(NamedTuple):
    """One observation: its stamp, the action that led to it (None: a look), that one's outcome, and what followed.

    Time in seconds and path in metres are those of the episode; they and the true pose are None where the task hides
    them.
    """

    stamp_ns: int
    action: str | None
    outcome: str | None
    collided: bool
    time_s: float | None
    path_m: float | None
    pose_xyyaw: tuple[float, float, float] | None


@dataclass(frozen=True)
class RecordedScene:
    """One scene of a recording: its name, `NAME:VARIANT`, and its observations in order."""

    name: str
    moments: tuple[Moment, ...]

    @property
    def steps(self) -> int:
        """The number of actions."""
        return sum(moment.action is not None for moment in self.moments)


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording: its file with its SHA-256, the run as solutions were told of it, channels and scenes."""

    path: Path
    sha256: str
    run: Mapping[str, Any]
    channels: tuple[str, ...]
    scenes: tuple[RecordedScene, ...]

    @property
    def robot(self) -> dict[str, Any]:
        """The declaration of the robot that was recorded, under its own name also in a recording of a replay."""
        declared = dict(self.run["robot"])
        return {**declared, "name": self._replayed.get("robot", declared["name"])}

    @property
    def _replayed(self) -> dict[str, Any]:
        """What the first scene was a replay of, when this was recorded in one."""
        return dict(self.run["robot"].get("replay", {}).get(self.scenes[0].name, {}))

    @property
    def localisation(self) -> str:
        """The kind of poses that were shown: `ground_truth` or `noisy`."""
        return "noisy" if self.run["task"].get("localisation") == "noisy" else "ground_truth"

    @property
    def origin(self) -> str:
        """The source of what is recorded: a `run`, or a `bag` of ROS 2."""
        return "bag" if "bag" in self.run else str(self._replayed.get("from", "run"))

    @property
    def bag_sha256(self) -> str | None:
        """The SHA-256 of the bag that it was made of; None for a run."""
        found: str | None = self.run.get("bag", {}).get("sha256", self._replayed.get("bag_sha256"))
        return found

    @property
    def lossy(self) -> tuple[str, ...]:
        """Channels that are not what the sensor gave."""
        return tuple(self.run.get("bag", self._replayed).get("lossy", ()))

    @cached_property
    def environments(self) -> dict[str, dict[str, Any]]:
        """The scenes' environments as solutions were told of them, by name."""
        return {f"{scene['name']}:{scene['variant']}": scene for scene in self.run["environments"]}

    def require_localisation(self, wanted: str) -> None:
        """Raise BenchbotError when a task is about other poses than those that were recorded."""
        if self.localisation != wanted:
            shown = {"noisy": "those of drifting odometry", "ground_truth": "true ones"}
            raise refused(
                self.path,
                f"Its poses are {shown[self.localisation]}, and the task is about {shown[wanted]}.",
                f"Choose a task with the localisation of the recorded one, {self.run['selection']['task']}.",
            )

    def require_same(self, name: str, environment: Mapping[str, Any]) -> None:
        """Raise BenchbotError when an environment is another one than when it was recorded."""
        changed = [key for key in SAME if environment.get(key) != self.environments[name].get(key)]
        if changed:
            raise refused(
                self.path,
                f"'{name}' is not the environment that was recorded: {', '.join(changed)} differ.",
                "Record it anew, or install the version of the environment that was recorded.",
            )


def file_of(path: Path) -> Path:
    """Return the absolute path of the one MCAP file that a path names, itself or its folder; raises BenchbotError."""
    found = sorted(path.glob("*.mcap")) if path.is_dir() else [path] if path.is_file() else []
    if len(found) != 1:
        raise BenchbotError(
            f"There is no recording in {path}.",
            f"It holds {len(found)} files *.mcap, and a recording is one."
            if path.is_dir()
            else "There is no such file.",
            "Name the folder or the file that --record mcap=FOLDER has written.",
        )
    return found[0].absolute()


def read(path: Path) -> Recorded:
    """Return a recording that can be replayed; raises BenchbotError, with the reason, for one that cannot.

    What was found out before of a file that has not changed since is taken from the cache.
    """
    file = file_of(path)
    marks = file.stat()
    key = sha256(f"{INDEX_VERSION} {file} {marks.st_size} {marks.st_mtime_ns}".encode()).hexdigest()
    return _read(file, cache_dir() / "replay" / f"{key[:32]}.json")


@cache
def _read(file: Path, kept: Path) -> Recorded:
    if kept.is_file():
        index = json.loads(kept.read_text("utf-8"))
    else:
        index = _index(file)
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_text(kept, json.dumps(index))
    scenes = (RecordedScene(name, tuple(Moment(*moment) for moment in moments)) for name, moments in index["scenes"])
    return Recorded(file, index["sha256"], index["run"], tuple(index["channels"]), tuple(scenes))


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


@contextmanager
def opened(file: Path) -> Iterator[Any]:
    """Open an MCAP file; what cannot be read in it is raised as a BenchbotError that says so."""
    from mcap.exceptions import McapError
    from mcap.reader import make_reader
    from rosbags.serde import SerdeError
    from zstandard import ZstdError

    try:
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            _require_index(file, reader)
            yield reader
    except BenchbotError:
        raise
    # The library trusts lengths and references in the file: wrong ones end in any of these.
    except (McapError, SerdeError, ZstdError, struct.error, OSError, MemoryError, RuntimeError) as error:
        raise refused(file, f"It cannot be read: {error or type(error).__name__}.") from error
    except (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise refused(file, f"It is damaged: {error or type(error).__name__}.") from error


def _require_index(file: Path, reader: Any) -> None:
    if reader.get_summary() is None:
        raise refused(file, "It has no index: what wrote it was killed, and nobody knows what is missing.")


def refused(file: Path, why: str, fix: str = NEW_ONE) -> BenchbotError:
    """Return the error of a recording that cannot be replayed."""
    return BenchbotError(f"{file} cannot be replayed.", why, fix)


def _index(file: Path) -> dict[str, Any]:
    with opened(file) as reader:
        notes = next((entry.metadata for entry in reader.iter_metadata() if entry.name == NOTES), None)
        if notes is None:
            raise refused(
                file,
                "It says nothing of its run: it is a bag that ROS 2 has recorded, or a recording of an older BenchBot.",
                "Of a bag say which robot's topics it holds, and of what: "
                "benchbot replay BAG --robot NAME --task TASK --env ENVIRONMENT …",
            )
        run = json.loads(notes["run"])
        found = _moments(file, reader, [f"{scene['name']}:{scene['variant']}" for scene in run["environments"]])
    channels, scenes = found
    recorded = Recorded(file, "", run, channels, scenes)
    _require_passive(recorded)
    return {
        "sha256": file_sha256(file),
        "run": run,
        "channels": channels,
        "scenes": [[scene.name, [list(moment) for moment in scene.moments]] for scene in scenes],
    }


def _moments(file: Path, reader: Any, names: list[str]) -> tuple[tuple[str, ...], tuple[RecordedScene, ...]]:
    actions: dict[int, dict[str, Any]] = {}
    channels: list[list[str]] = []
    scenes: dict[int, list[Moment]] = defaultdict(list)
    frames = 0
    for schema, channel, message in reader.iter_messages([ACTION, EXACT, PROGRESS]):
        if channel.topic == EXACT:
            channels.append(exact.decode(decoded(schema, message))[0])
            continue
        document = json.loads(decoded(schema, message).data)
        if channel.topic == ACTION:
            actions[message.log_time] = document
            continue
        frames += 1
        if document["frames"] != frames:
            why = f"Observation {frames} is not in it: " + (
                "it was begun when the run was under way." if frames == 1 else "the disk was slower than the run."
            )
            raise refused(file, why)
        taken = actions.get(message.log_time, {})
        scenes[document["scene_number"]].append(_moment(message.log_time, taken, document))
    # Chunks that a damaged index does not name are passed over in silence.
    summary = reader.get_summary()
    counts = summary.statistics.channel_message_counts
    written = sum(counts.get(key, 0) for key, one in summary.channels.items() if one.topic == PROGRESS)
    if written != frames:
        raise refused(file, f"It is damaged: {frames} of {written} observations can be read.")
    if len(channels) != frames or not frames:
        why = "There is not one observation in it." if not frames else "It is a recording of an older BenchBot."
        raise refused(file, why)
    if len(scenes) < len(names):
        raise refused(
            file, f"It ends in {names[len(scenes) - 1]}; {', '.join(names[len(scenes) :])} was never entered."
        )
    common = tuple(channel for channel in channels[0] if all(channel in each for each in channels))
    return common, tuple(RecordedScene(name, tuple(scenes[number])) for number, name in enumerate(names))


def _moment(stamp_ns: int, taken: Mapping[str, Any], progress: Mapping[str, Any]) -> Moment:
    pose = progress.get("pose_xyyaw")
    return Moment(
        stamp_ns,
        taken.get("action"),
        taken.get("outcome"),
        progress["state"] == "collided",
        progress.get("simulated_time_s"),
        progress.get("path_length_m"),
        None if pose is None else (pose[0], pose[1], pose[2]),
    )


def _require_passive(recorded: Recorded) -> None:
    taken = {moment.action for scene in recorded.scenes for moment in scene.moments} - {None, "move_next"}
    if taken:
        raise refused(
            recorded.path,
            f"Its solution chose where to drive ({', '.join(sorted(filter(None, taken)))}): "
            "what would have been seen elsewhere was not recorded.",
            "Replay a recording of a passive task, whose robot follows a trajectory.",
        )


def base_pose(moment: Moment) -> Pose | None:
    """Return the true pose of the robot's base, None where the task hid it."""
    return None if moment.pose_xyyaw is None else Pose.planar(*moment.pose_xyyaw)
