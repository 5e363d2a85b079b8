"""Boxes, of which an MP4 is made: read from what OpenCV writes, and put together anew in fragments.

Format: ISO/IEC 14496-12, https://www.w3.org/TR/mse-byte-stream-format-isobmff/. A box is its size (4 bytes), its kind
(4) and what is in it; a full box begins with a version (1) and flags (3).
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

CONTAINERS = {b"moov", b"trak", b"mdia", b"minf", b"stbl"}
_SYNC, _NOT_SYNC = 0x02000000, 0x01010000


@dataclass(frozen=True)
class Sample:
    """One encoded frame; a key frame can be shown without those before it."""

    data: bytes
    key: bool


@dataclass(frozen=True)
class Segment:
    """The frames of one short MP4, and their description for players: `header` is its `moov` box.

    A frame lasts `duration` units of the film's time scale.
    """

    header: bytes
    samples: tuple[Sample, ...]
    duration: int


def read_segment(data: bytes) -> Segment:
    """Return what is in an MP4 with one track of frames that all last as long; raises ValueError for anything else."""
    try:
        header = next(content for kind, content in _boxes(data) if kind == b"moov")
        tables = dict(_leaves(header))
        sizes = _sizes(tables[b"stsz"])
        keys = set(_numbers(tables[b"stss"], "I")) if b"stss" in tables else set(range(1, len(sizes) + 1))
        (duration,) = struct.unpack_from(">I", tables[b"stts"], 12)
        samples = tuple(
            Sample(data[start : start + size], number in keys)
            for number, (start, size) in enumerate(zip(_starts(tables, sizes), sizes, strict=True), 1)
        )
    except (StopIteration, KeyError, IndexError, struct.error) as error:
        raise ValueError(f"not a whole film: {error!r}") from error
    if any(len(sample.data) != size for sample, size in zip(samples, sizes, strict=True)):
        raise ValueError("frames are cut off")
    return Segment(header, samples, duration)


def file_start(segment: Segment) -> bytes:
    """Return the start of a fragmented MP4: the description for players, without frames."""
    kind = box(b"ftyp", b"iso5" + struct.pack(">I", 512) + b"iso5iso6mp41")
    extends = full_box(b"trex", 0, 0, struct.pack(">5I", 1, 1, 0, 0, 0))
    return kind + box(b"moov", _without_samples(segment.header) + box(b"mvex", extends))


def fragment(segment: Segment, number: int, time: int) -> bytes:
    """Return the frames of a segment as the fragment with a number, from 1, that begins at a time."""
    rows = b"".join(
        struct.pack(">3I", segment.duration, len(sample.data), _SYNC if sample.key else _NOT_SYNC)
        for sample in segment.samples
    )

    def moof(data_offset: int) -> bytes:
        run = struct.pack(">Ii", len(segment.samples), data_offset) + rows
        track = (
            full_box(b"tfhd", 0, 0x020000, struct.pack(">I", 1))
            + full_box(b"tfdt", 1, 0, struct.pack(">Q", time))
            + full_box(b"trun", 0, 0x000701, run)
        )
        return box(b"moof", full_box(b"mfhd", 0, 0, struct.pack(">I", number)) + box(b"traf", track))

    head = moof(len(moof(0)) + 8)
    return head + box(b"mdat", b"".join(sample.data for sample in segment.samples))


def box(kind: bytes, content: bytes) -> bytes:
    """Return a box."""
    return struct.pack(">I", 8 + len(content)) + kind + content


def full_box(kind: bytes, version: int, flags: int, content: bytes) -> bytes:
    """Return a box with version and flags."""
    return box(kind, struct.pack(">I", version << 24 | flags) + content)


def _boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = 0
    while place + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        start = place + 8
        if size == 1:
            (size,) = struct.unpack_from(">Q", data, start)
            start += 8
        if size < start - place:
            raise ValueError(f"a box of {size} bytes")
        yield kind, data[start : place + size]
        place += size


def _leaves(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    for kind, content in _boxes(data):
        if kind in CONTAINERS:
            yield from _leaves(content)
        else:
            yield kind, content


def _without_samples(data: bytes) -> bytes:
    """Return the boxes of a header whose tables of samples are empty, and whose lengths are left open."""
    made = b""
    for kind, content in _boxes(data):
        if kind == b"stbl":
            empty = b"".join(full_box(name, 0, 0, bytes(4)) for name in (b"stts", b"stsc", b"stco"))
            described = next(box(name, inner) for name, inner in _boxes(content) if name == b"stsd")
            made += box(kind, described + empty + full_box(b"stsz", 0, 0, bytes(8)))
        elif kind in CONTAINERS:
            made += box(kind, _without_samples(content))
        elif kind in (b"mvhd", b"mdhd", b"tkhd"):
            # Version, flags, two dates, then the time scale (in tkhd: the track's number and 4 bytes), the duration.
            at = 20 if kind == b"tkhd" else 16
            made += box(kind, content[:at] + bytes(4) + content[at + 4 :])
        elif kind not in (b"edts", b"udta"):
            made += box(kind, content)
    return made


def _sizes(table: bytes) -> list[int]:
    size, count = struct.unpack_from(">2I", table, 4)
    return [size] * count if size else list(struct.unpack_from(f">{count}I", table, 12))


def _numbers(table: bytes, code: str) -> Sequence[int]:
    (count,) = struct.unpack_from(">I", table, 4)
    return struct.unpack_from(f">{count}{code}", table, 8)


def _starts(tables: dict[bytes, bytes], sizes: Sequence[int]) -> Iterator[int]:
    """Yield where each sample begins in the file: chunks follow one another, each holds so many samples."""
    chunks = _numbers(tables[b"co64"], "Q") if b"co64" in tables else _numbers(tables[b"stco"], "I")
    (runs,) = struct.unpack_from(">I", tables[b"stsc"], 4)
    held = [struct.unpack_from(">2I", tables[b"stsc"], 8 + 12 * run) for run in range(runs)]
    left = iter(sizes)
    count = 0
    for number, start in enumerate(chunks, 1):
        passed = 0
        count = next((samples for first, samples in held if first == number), count)
        for _ in range(count):
            yield start + passed
            passed += next(left)
