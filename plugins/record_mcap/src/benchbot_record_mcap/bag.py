"""A rosbag2 directory being written: one MCAP file of ROS 2 messages, and its `metadata.yaml`.

Messages are serialised by rosbags, which knows the definitions of ROS 2 Jazzy's types, and stored by the MCAP project's
own writer, which can be made to write what it has at any time (the one of rosbags cannot).
Format: https://mcap.dev/spec and https://mcap.dev/spec/registry#ros2-profile.
"""

import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from benchbot_record_mcap import metadata

TYPES = get_typestore(Stores.ROS2_JAZZY)
NOTES = "benchbot"
"""The name of the metadata record that notes are in, at the start of the file."""


class Bag:
    """Writes `<folder>/<folder's name>_0.mcap`, replacing it; `notes` are those of BenchBot, at its start.

    After each `write` the file is a complete MCAP that only lacks an index, whatever happens to this process.
    Every method raises OSError when the file system refuses to write; the file then is what it was before.
    """

    def __init__(self, folder: Path, notes: Mapping[str, str] | None = None) -> None:
        self._folder = folder
        self._topics: dict[str, metadata.Topic] = {}
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._start_ns = self._end_ns = 0
        self._path = folder / f"{folder.resolve().name}_0.mcap"
        self._file = self._path.open("wb")
        # A chunk is a step: there as a whole, or not at all.
        self._writer = Writer(self._file, chunk_size=sys.maxsize, compression=CompressionType.ZSTD)
        self._whole_bytes = 0
        try:
            self._writer.start(profile="ros2", library="benchbot-record-mcap")
            if notes:
                self._writer.add_metadata(NOTES, dict(notes))
            self._end_here()
        except OSError:
            self._close_file()
            self._path.unlink()
            raise

    def write(self, time_ns: int, messages: Iterable[tuple[str, Any]]) -> None:
        """Append (topic, message) pairs of one instant. Times must not decrease."""
        # All of them before any: a message that does not serialise leaves no part of its step behind.
        serialised = [
            (self._topic(topic, message), bytes(TYPES.serialize_cdr(message, message.__msgtype__)))
            for topic, message in messages
        ]
        for topic, data in serialised:
            self._writer.add_message(
                channel_id=self._channels[topic.name],
                log_time=time_ns,
                publish_time=time_ns,
                sequence=topic.messages,
                data=data,
            )
            topic.messages += 1
        self._start_ns = self._start_ns or time_ns
        self._end_ns = time_ns
        try:
            self._end_here()
        except OSError:
            self.abandon()
            raise

    def finish(self) -> None:
        """Write the index and the metadata, and close."""
        document = metadata.document(self._path.name, self._topics.values(), self._start_ns, self._end_ns)
        try:
            # As rosbag2_storage_mcap does, so that the file alone says what the folder says.
            self._writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(document)})
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
        except OSError:
            self.abandon()
            raise
        part = self._folder / ".metadata.yaml.part"
        try:
            part.write_text(_yaml({"rosbag2_bagfile_information": document}))
            part.replace(self._folder / "metadata.yaml")
        finally:
            part.unlink(missing_ok=True)

    def abandon(self) -> None:
        """Close the file as it was after the last successful `write`, as far as the file system permits."""
        self._close_file()
        with suppress(OSError), self._path.open("r+b") as file:
            file.truncate(self._whole_bytes)
            file.seek(self._whole_bytes)
            file.write(_END_WITHOUT_INDEX)

    def _topic(self, name: str, message: Any) -> metadata.Topic:
        if name not in self._topics:
            type_name = message.__msgtype__
            topic = metadata.Topic(name, type_name, TYPES.hash_rihs01(type_name))
            if type_name not in self._schemas:
                definition, _ = TYPES.generate_msgdef(type_name, ros_version=2)
                self._schemas[type_name] = self._writer.register_schema(type_name, "ros2msg", definition.encode())
            self._channels[name] = self._writer.register_channel(
                name,
                "cdr",
                self._schemas[type_name],
                {"offered_qos_profiles": "[]", "topic_type_hash": topic.type_hash},
            )
            self._topics[name] = topic
        return self._topics[name]

    def _end_here(self) -> None:
        """Write out the chunk and end the file there for now: what is written next goes over this end."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        whole_bytes = self._file.tell()
        self._file.write(_END_WITHOUT_INDEX)
        self._file.flush()
        self._file.seek(whole_bytes)
        self._whole_bytes = whole_bytes

    def _close_file(self) -> None:
        with suppress(OSError):  # what could not be written before is tried and refused again
            self._file.close()


def _yaml(document: dict[str, Any]) -> str:
    return yaml.safe_dump(document, sort_keys=False)


def _end_without_index() -> bytes:
    builder = RecordBuilder()
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return bytes(builder.end()) + MCAP0_MAGIC  # type: ignore[no-untyped-call]


_END_WITHOUT_INDEX = _end_without_index()
