from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.batch import journal

ENTRIES = st.lists(st.dictionaries(st.text(max_size=5), st.integers() | st.text(max_size=20), max_size=3), max_size=6)


@given(before=ENTRIES, torn_after=st.integers(0, 300), after=ENTRIES)
def test_what_was_written_whole_is_read_whatever_was_torn(
    before: list[dict[str, Any]], torn_after: int, after: list[dict[str, Any]]
) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "journal.jsonl"
        ends = [0]
        for entry in before:
            journal.append(path, entry)
            ends.append(path.stat().st_size)
        if path.exists():
            path.write_bytes(path.read_bytes()[:torn_after])
        for entry in after:
            journal.append(path, entry)
        # An entry without its line's end is whole all the same.
        whole = [entry for entry, end in zip(before, ends[1:], strict=True) if end - 1 <= torn_after]
        assert journal.read(path) == [*whole, *after]


def test_a_tail_reads_each_line_once_and_waits_for_its_end(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    tail = journal.Tail(path)
    assert tail.read() == []
    journal.append(path, {"number": 1})
    with path.open("ab") as file:
        file.write(b'{"number": ')
    assert tail.read() == [{"number": 1}]
    with path.open("ab") as file:
        file.write(b"2}\n")
    assert tail.read() == [{"number": 2}]
    assert tail.read() == []


def test_a_journal_that_is_not_there_is_empty(tmp_path: Path) -> None:
    assert journal.read(tmp_path / "none") == []
