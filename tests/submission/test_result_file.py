"""Results as solutions may leave them: none of them harms, or misleads, who reads them."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission import result_file
from benchbot.submission.modes import RESULT_MAX_BYTES
from benchbot.submission.result_file import MAX_DEPTH

JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
)


def refused(path: Path) -> str:
    with pytest.raises(BenchbotError) as caught:
        result_file.read(path)
    assert caught.value.failure is FailureClass.AGENT
    return f"{caught.value.title} {caught.value.why}"


@given(st.dictionaries(st.text(), JSON, max_size=5))
def test_a_result_is_read_as_it_was_written(tmp_path_factory: pytest.TempPathFactory, document: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp("written") / "result.json"
    path.write_text(json.dumps(document))

    assert result_file.read(path) == document


@given(st.binary(max_size=200))
def test_anything_else_is_refused_in_words(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("bytes") / "result.json"
    path.write_bytes(content)
    try:
        document = json.loads(content.decode())
    except ValueError:
        document = None

    if isinstance(document, dict):
        assert result_file.read(path) == document
    else:
        assert "The solution's result cannot be read." in refused(path)


def test_what_is_no_plain_file_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text('{"results": {}}')
    (tmp_path / "link").symlink_to(tmp_path / "secret")
    (tmp_path / "nowhere").symlink_to(tmp_path / "nothing")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/zero")

    for name in ("link", "nowhere", "device"):
        assert "links are not followed" in refused(tmp_path / name)
    assert "no regular file" in refused(tmp_path / "pipe")
    assert "no regular file" in refused(tmp_path)
    assert "The solution saved no result." in refused(tmp_path / "none")


@pytest.mark.parametrize("depth", [MAX_DEPTH, 5000, 1_000_000])
def test_nesting_is_bounded(depth: int, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text('{"results":' + "[" * depth + "]" * depth + "}")

    assert f"in more than {MAX_DEPTH} others" in refused(path)


def test_the_deepest_that_may_be_is_read(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text('{"results":' + "[" * (MAX_DEPTH - 1) + "]" * (MAX_DEPTH - 1) + "}")

    assert "results" in result_file.read(path)


def test_size_is_bounded_and_so_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    with path.open("wb") as file:
        file.truncate(RESULT_MAX_BYTES + 1)
    assert f"at most {RESULT_MAX_BYTES} are read" in refused(path)

    path.write_text('{"results": ' + "9" * 5000 + "}")
    assert "4300 digits" in refused(path)
