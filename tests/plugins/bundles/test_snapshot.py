"""Snapshots: stored whole, run as they were stored, and never mistaken for what somebody made of them."""

import os
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import snapshot as snapshots
from benchbot.plugins.bundles.snapshot import ChangedError, Content, Snapshot
from benchbot.plugins.bundles.snapshot_store import store
from tests.supervisor.harness import eventually

STUCK = """
import os, sys
from pathlib import Path
from benchbot.plugins.bundles.snapshot import Content
from benchbot.plugins.bundles.snapshot_store import store

origin = Path(sys.argv[1])
os.mkfifo(origin / "endless")
store(origin.parent / "solutions", Content(".", {"endless": ""}, ()), origin, ran_in=origin, details={})
"""
"""Stores a solution whose only file never ends."""
FILES = {"s.py": b"import lib.helper", "lib/helper.py": b"", "w/big.bin": b"\1" * 5000, "go": b"#!/bin/sh\n"}


@pytest.fixture
def origin(tmp_path: Path) -> Path:
    for name, content in FILES.items():
        (tmp_path / "origin" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "origin" / name).write_bytes(content)
    return tmp_path / "origin"


def content_of(files: dict[str, bytes]) -> Content:
    return Content(".", {name: sha256(data).hexdigest() for name, data in sorted(files.items())}, ("go",))


def stored(origin: Path, left_out: tuple[str, ...] = ()) -> Path:
    return store(
        origin.parent / "solutions",
        content_of(FILES),
        origin,
        ran_in=origin,
        details={"command": ["x"]},
        left_out=left_out,
    )


def unlocked(path: Path) -> Path:
    path.chmod(0o644)
    return path


def test_it_is_found_by_the_hash_of_its_content_and_opened_as_it_was(origin: Path) -> None:
    path = stored(origin)
    shutil.rmtree(origin)
    snapshot = Snapshot.opened(path)
    assert path.name == snapshot.content.hash == content_of(FILES).hash
    assert {name: (snapshot.files / name).read_bytes() for name in FILES} == FILES
    assert {name: (snapshot.files / name).stat().st_mode & 0o777 for name in ("s.py", "go")} == {
        "s.py": 0o444,
        "go": 0o555,
    }
    assert snapshot.details == {"command": ["x"]}


def test_nothing_is_stored_twice_and_nothing_half(origin: Path) -> None:
    path = stored(origin)
    before = (path / "files" / "s.py").stat().st_ino
    assert stored(origin) == path
    assert (path / "files" / "s.py").stat().st_ino == before
    assert list(path.parent.iterdir()) == [path]


def test_a_file_that_is_edited_before_it_is_copied_is_not_stored_under_another_ones_hash(origin: Path) -> None:
    (origin / "lib" / "helper.py").write_text("edited")
    with pytest.raises(BenchbotError, match=r"lib/helper.py was changed just now"):
        stored(origin)
    assert list((origin.parent / "solutions").iterdir()) == []


def test_too_little_room_is_said_before_anything_is_copied(origin: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = shutil.disk_usage(origin)._replace(free=100)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(BenchbotError, match="no room") as caught:
        stored(origin)
    assert "w/big.bin" in caught.value.fix


@pytest.mark.parametrize("harm", ["edited", "added", "removed", "replaced by a folder", "manifest", "renamed"])
def test_whatever_is_done_to_it_is_found_out_and_it_can_be_made_anew(harm: str, origin: Path) -> None:
    path = stored(origin)
    helper = path / "files" / "lib" / "helper.py"
    if harm == "edited":
        unlocked(helper).write_text("edited")
    elif harm == "added":
        (helper.parent / "numpy.py").touch()
    elif harm == "removed":
        helper.unlink()
    elif harm == "replaced by a folder":
        helper.unlink()
        helper.mkdir()
    elif harm == "manifest":
        (path / "snapshot.json").write_text("{")
    else:
        path = path.rename(path.with_name("0" * 64))
    with pytest.raises(ChangedError, match="not what it was"):
        Snapshot.opened(path)
    Snapshot.opened(stored(origin))
    assert len(list((origin.parent / "solutions").iterdir())) == 2, "the damaged one is kept"


def test_what_is_written_while_a_solution_runs_is_found_out_though_it_was_put_back(origin: Path) -> None:
    snapshot = Snapshot.opened(stored(origin))
    snapshot.check()
    helper = unlocked(snapshot.files / "lib" / "helper.py")
    before = helper.stat()
    helper.write_text("edited")
    helper.write_text("")
    os.utime(helper, ns=(before.st_atime_ns, before.st_mtime_ns))
    with pytest.raises(ChangedError, match="not what it was") as caught:
        snapshot.check()
    assert "lib/helper.py" in caught.value.why


def test_a_copy_is_worked_in_and_only_what_was_written_is_left(origin: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(snapshots, "COPIED_BYTES", 1000)
    snapshot = Snapshot.opened(stored(origin))
    work = origin.parent / "work"
    with snapshot.copied(work):
        assert {name: (work / name).read_bytes() for name in FILES} == FILES
        assert [name for name in FILES if (work / name).is_symlink()] == ["w/big.bin"]
        (work / "lib" / "__pycache__").mkdir()
        (work / "lib" / "__pycache__" / "helper.pyc").touch()
        (work / "s.py").write_text("rewritten")
        (work / "maps").mkdir()
        (work / "maps" / "seen.json").write_text("{}")
    left = sorted(path.relative_to(work).as_posix() for path in work.rglob("*") if path.is_file())
    assert left == ["maps/seen.json", "s.py"]
    snapshot.check()
    with snapshot.copied(origin.parent / "other"):
        pass
    assert not (origin.parent / "other").exists()


def test_words_of_a_command_name_the_files_where_they_are_run(origin: Path) -> None:
    (origin / "ignored.bin").touch()
    snapshot = Snapshot.opened(stored(origin))
    root = Path("/there")
    moved = {
        "python": "python",
        "s.py": "s.py",
        "./go": "./go",
        str(origin / "s.py"): "/there/s.py",
        f"--weights={origin}/w": "--weights=/there/w",
        "--weights=w/big.bin": "--weights=w/big.bin",
        "ignored.bin": f"{origin}/ignored.bin",
        "/usr/bin/env": "/usr/bin/env",
        "--mode=fast": "--mode=fast",
        "": "",
    }
    assert {word: snapshot.moved(word, root) for word in moved} == moved


def test_a_solution_that_misses_a_file_is_told_how_it_gets_it(origin: Path) -> None:
    snapshot = Snapshot.opened(stored(origin, left_out=("cfg/best one.yaml", "tools.py")))
    assert snapshot.missed("FileNotFoundError: [Errno 2] No such file or directory: 'cfg/best one.yaml'") == (
        "cfg/best one.yaml lies beside the solution and is none of its files. If it is needed: "
        "--source 'cfg/best one.yaml'"
    )
    assert "--source tools.py" in str(snapshot.missed("ModuleNotFoundError: No module named 'tools'"))
    assert snapshot.missed("ZeroDivisionError: division by zero") is None
    assert snapshot.missed("all well with 'tools'") is None


@settings(max_examples=50)
@given(st.dictionaries(st.sampled_from(["a", "b/c", "d.py"]), st.binary(max_size=5)), st.sampled_from([".", "b"]))
def test_two_contents_have_one_hash_only_if_they_are_equal(files: dict[str, bytes], folder: str) -> None:
    one = Content(folder, {name: sha256(data).hexdigest() for name, data in files.items()})
    assert one.hash == Content(folder, dict(reversed(one.files.items()))).hash  # type: ignore[call-overload]
    assert one.hash != Content(f"{folder}/x", one.files).hash
    assert one.hash != Content(folder, {**one.files, "e": "0" * 64}).hash
    assert one.hash != Content(folder, one.files, executable=("a",)).hash


def test_what_a_process_that_was_killed_has_begun_is_removed_by_the_next_but_not_what_one_is_making(
    origin: Path,
) -> None:
    solutions = origin.parent / "solutions"
    with subprocess.Popen([sys.executable, "-c", STUCK, str(origin)]) as making:
        try:
            assert eventually(lambda: any(solutions.glob(".making-*/files")))
            stored(origin)
            meanwhile = list(solutions.glob(".making-*"))
        finally:
            making.kill()
    shutil.rmtree(solutions / content_of(FILES).hash)
    stored(origin)

    assert len(meanwhile) == 1
    assert [path.name for path in solutions.iterdir()] == [content_of(FILES).hash]
