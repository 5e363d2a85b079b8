"""Of long output a log keeps the beginning and the end, and says how much it left out."""

import re
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from benchbot.submission.output import CappedLog

NOTE = re.compile(r"\n\[(\d+) bytes are left out here: --log-limit is [^\]]+\]\n")
NOTE_BYTES = 100


def written(path: Path, chunks: list[bytes], limit: int) -> bytes:
    path.unlink(missing_ok=True)
    with CappedLog(path, limit) as log:
        for chunk in chunks:
            log.write(chunk)
    return path.read_bytes()


@given(text=st.text(alphabet="aé→🤖\n", max_size=4000), limit=st.integers(1, 2000), step=st.integers(1, 700))
@example(text="🤖" * 3000, limit=1001, step=3)
def test_what_is_kept_is_the_beginning_and_the_end_and_the_rest_is_counted(
    tmp_path_factory: pytest.TempPathFactory, text: str, limit: int, step: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "log"
    output = text.encode()
    chunks = [output[at : at + step] for at in range(0, len(output), step)]

    content = written(path, chunks, limit)

    assert len(content) <= limit + step + NOTE_BYTES
    whole = content.decode("utf-8")
    if len(output) <= limit:
        assert whole == text
        return
    head, left_out, tail = NOTE.split(whole)
    assert text.startswith(head)
    assert text.endswith(tail)
    assert len(head.encode()) + int(left_out) + len(tail.encode()) == len(output)


def test_cuts_are_made_between_lines(tmp_path: Path) -> None:
    lines = [f"line {number}\n".encode() for number in range(5000)]

    head, _, tail = NOTE.split(written(tmp_path / "log", lines, 20_000).decode())

    assert head.startswith("line 0\n")
    assert re.fullmatch(r"(line \d+\n)+", head)
    assert re.fullmatch(r"(line \d+\n)+", tail)
    assert tail.endswith("line 4999\n")
    assert len(tail) >= 5000 - 20


def test_a_log_goes_on_behind_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"of another submission\n")

    with CappedLog(path, 1000) as log:
        for number in range(500):
            log.write(f"{number}\n".encode())

    content = path.read_text()
    assert content.startswith("of another submission\n0\n1\n")
    assert content.endswith("498\n499\n")
    assert len(content) < 1200


def test_memory_does_not_grow_with_output(tmp_path: Path) -> None:
    chunk = b"x" * 65536
    with CappedLog(tmp_path / "log", 2**20) as log:
        tracemalloc.start()
        for _ in range(1000):
            log.write(chunk)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()

    assert peak < 2**20
    assert (tmp_path / "log").stat().st_size < 2**20 + 65536 + NOTE_BYTES


def test_what_cannot_be_kept_is_lost_and_harms_nobody() -> None:
    with CappedLog(Path("/dev/full"), 10) as log:
        log.write(b"x" * 100)
    with CappedLog(Path("/dev/null"), 10) as log:
        log.write(b"x" * 100)
        log.write(b"x" * 100)
    log.write(b"after the end")
