"""Recordings as two independent libraries read them, and sessions to record."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec
from benchbot.core.recording import Recording
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.core.session import Session
from benchbot.supervisor.description import selection_document
from benchbot_record_mcap.bag import TYPES
from benchbot_record_mcap.recording import McapRecording

Bag = dict[str, list[tuple[int, Any]]]


def by_rosbags(path: Path) -> Bag:
    """Read a rosbag2 directory, or one MCAP file, with rosbags: (log time, message) by topic."""
    topics: Bag = defaultdict(list)
    with Reader(path) as reader:
        for connection, time_ns, data in reader.messages():
            topics[connection.topic].append((time_ns, TYPES.deserialize_cdr(data, connection.msgtype)))
    return dict(topics)


def by_mcap(path: Path) -> Bag:
    """Read the same with the MCAP project's reader and decoder, which go by the definitions in the file."""
    file = path if path.is_file() else path / f"{path.name}_0.mcap"
    topics: Bag = defaultdict(list)
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            topics[channel.topic].append((message.log_time, decoded))
    return dict(topics)


def through_cdr(message: Any) -> Any:
    """Serialise a message as a bag does and decode it with the MCAP project's decoder."""
    definition, _ = TYPES.generate_msgdef(message.__msgtype__, ros_version=2)
    schema = Schema(id=1, data=definition.encode(), encoding="ros2msg", name=message.__msgtype__)
    decode = DecoderFactory().decoder_for("cdr", schema)
    assert decode is not None
    return decode(bytes(TYPES.serialize_cdr(message, message.__msgtype__)))


def sample_session(*recordings: Recording, task: str = "sample:passive", environment: str = "arena:1") -> Session:
    selection = select(
        Catalog(plugin_manager.load()), RunRequest(task=task, robot="sample_robot", environment=environment, seed=5)
    )

    def start() -> InProcessHost:
        spec = PlatformSpec(selection.robot.data, selection.localisation, Path())
        platform = plugin_manager.load().record("simulators", "sim_sample").create(spec)
        return InProcessHost(platform, session.scenes, MotionConfig.from_robot(spec.robot, spec.localisation))

    for recording in recordings:
        if isinstance(recording, McapRecording):
            recording.run({**selection_document(selection), "seed": selection.seed})
    session = Session(selection, start, recordings)
    return session


def steps_to_the_end(session: Session) -> Iterator[Any]:
    """Reset and follow the trajectory of every scene, yielding each step."""
    yield session.reset()
    while True:
        while session.actions:
            yield session.step("move_next")
        following = session.next_scene()
        if following is None:
            return
        yield following
