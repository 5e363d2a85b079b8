"""The folder of a result is gone afterwards, whatever was in it."""

import os
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from benchbot.submission.exchange import exchange_folder, remove

DEPTH = 1500
NAMES = st.sampled_from(["a", "b", "benchbot-removing-0", "benchbot-removing-1"])
TREES = st.recursive(
    st.sampled_from(["file", "link", "pipe"]), lambda inner: st.dictionaries(NAMES, inner, max_size=3), max_leaves=12
)


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
