"""Results and folders as solutions may leave them: no result misleads the reader, and no folder stays."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission.modes import RESULT_MAX_BYTES
from benchbot.submission.output import MAX_DEPTH, exchange_folder, read_result, remove

JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
)
DEPTH = 1500
NAMES = st.sampled_from(["a", "b", "benchbot-removing-0", "benchbot-removing-1"])
TREES = st.recursive(
    st.sampled_from(["file", "link", "pipe"]), lambda inner: st.dictionaries(NAMES, inner, max_size=3), max_leaves=12
)


def refused(path: Path) -> str:
    with pytest.raises(BenchbotError) as caught:
        read_result(path)
    assert caught.value.failure is FailureClass.AGENT
    return f"{caught.value.title} {caught.value.why}"


@given(st.dictionaries(st.text(), JSON, max_size=5))
def test_a_result_is_read_as_it_was_written(tmp_path_factory: pytest.TempPathFactory, document: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp("written") / "result.json"
    path.write_text(json.dumps(document))

    assert read_result(path) == document


@given(st.binary(max_size=200))
def test_anything_else_is_refused_in_words(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("bytes") / "result.json"
    path.write_bytes(content)
    try:
        document = json.loads(content.decode())
    except ValueError:
        document = None

    if isinstance(document, dict):
        assert read_result(path) == document
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

    assert "results" in read_result(path)


def test_size_is_bounded_and_so_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    with path.open("wb") as file:
        file.truncate(RESULT_MAX_BYTES + 1)
    assert f"at most {RESULT_MAX_BYTES} are read" in refused(path)

    path.write_text('{"results": ' + "9" * 5000 + "}")
    assert "4300 digits" in refused(path)


def plant(path: Path, tree: object, mode: int) -> None:
    if isinstance(tree, dict):
        path.mkdir()
        for name, inner in tree.items():
            plant(path / name, inner, mode)
        path.chmod(mode)
    elif tree == "link":
        path.symlink_to("/")
    elif tree == "pipe":
        os.mkfifo(path)
    else:
        path.touch(0o000)


@given(st.dictionaries(NAMES, TREES, max_size=4), st.sampled_from([0o000, 0o500, 0o700]))
def test_any_tree_goes_and_nothing_that_it_links_to(tree: dict[str, object], mode: int) -> None:
    with exchange_folder() as folder:
        for name, inner in tree.items():
            plant(folder / name, inner, mode)

    assert not folder.exists()
    assert Path("/usr").is_dir()


def test_it_may_be_deeper_than_paths_are_long(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    # As a solution would: each level made within the one before, never by its whole path.
    handle = os.open(folder, os.O_RDONLY)
    for _ in range(DEPTH):
        os.mkdir("a" * 100, dir_fd=handle)
        inner = os.open("a" * 100, os.O_RDONLY, dir_fd=handle)
        os.close(handle)
        handle = inner
    os.close(handle)

    remove(folder)

    assert not folder.exists()


def test_it_is_this_users_alone() -> None:
    with exchange_folder() as folder:
        assert folder.stat().st_mode & 0o777 == 0o700
        assert list(folder.iterdir()) == []
