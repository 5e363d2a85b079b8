"""Whatever is done to an environment while its journal is open, undoing it gives back what was."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import Distribution, found_in
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.journal import Journal

NAMES = ("one.py", "two.yaml", "sub/three.py", "sub/deep/four.txt", "~odd/five.py")
Files = dict[str, bytes]
files = st.dictionaries(st.sampled_from(NAMES), st.binary(max_size=5), min_size=1)


def write(site: Path, version: str, contents: Files) -> Distribution:
    """Write a distribution as an installer would: never into a file that is there, which may be linked elsewhere."""
    info = f"acme-{version}.dist-info"
    everything = {**{f"acme/{name}": content for name, content in contents.items()}, "../../../bin/acme": b"#!"}
    for path, content in everything.items():
        place(site / path, content)
    place(site / info / "METADATA", f"Name: acme\nVersion: {version}\n".encode())
    place(site / info / "RECORD", "".join(f"{path},,\n" for path in [*everything, f"{info}/METADATA"]).encode())
    return found_in([site])["acme"]


def place(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.write_bytes(content)


def listing(folder: Path) -> dict[str, tuple[int, bytes]]:
    paths = (path for path in folder.rglob("*") if path.is_file() and ".benchbot" not in path.parts)
    return {str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.read_bytes()) for path in paths}


@contextmanager
def environment() -> Iterator[Environment]:
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder) / "lib" / "python3.12" / "site-packages"
        site.mkdir(parents=True)
        (Path(folder) / "bin").mkdir()
        place(site / "acme" / "users_own.txt", b"not in any RECORD")
        place(site / "other" / "__init__.py", b"")
        yield Environment(Path(folder), Path(folder) / "bin" / "python", (site,))


@given(old=files, new=files, done=st.sets(st.integers(0, 4)), linked=st.booleans())
def test_an_upgrade_that_was_broken_off_anywhere_is_undone(
    old: Files, new: Files, done: set[int], linked: bool
) -> None:
    with environment() as held, tempfile.TemporaryDirectory() as apart:
        going = write(held.site, "1.0", old)
        if linked:  # as uv does from its cache
            (Path(apart) / "cache").hardlink_to(held.site / "acme" / next(iter(old)))
        before = listing(held.prefix)
        coming = write(Path(apart) / "lib" / "python3.12" / "site-packages", "2.0", new)
        journal = Journal(held)
        journal.open("upgrade acme", [going], [coming])

        def put_aside() -> None:  # as pip does
            if "one.py" in old:
                shutil.move(held.site / "acme" / "one.py", held.site / "~cme-one.py")

        def come() -> None:
            for name, content in new.items():
                place(held.site / "acme" / name, content)

        def go() -> None:
            shutil.rmtree(going.info)

        def describe() -> None:
            shutil.copytree(coming.info, held.site / coming.info.name, dirs_exist_ok=True)

        def sign() -> None:
            place(held.site / coming.info.name / "INSTALLER", b"me")

        steps = [put_aside, come, go, describe, sign]
        for number, step in enumerate(steps):
            if number in done:
                step()
        assert journal.unfinished() == "upgrade acme"
        journal.undo()

        assert listing(held.prefix) == before
        assert journal.unfinished() is None
        journal.undo()  # nothing is open any more
        assert listing(held.prefix) == before


def test_undoing_that_was_broken_off_is_done_again(monkeypatch: pytest.MonkeyPatch) -> None:
    with environment() as held, tempfile.TemporaryDirectory() as apart:
        going = write(held.site, "1.0", {"one.py": b"1", "two.yaml": b"2"})
        before = listing(held.prefix)
        journal = Journal(held)
        journal.open("upgrade acme", [going], [write(Path(apart), "2.0", {"sub/three.py": b"3"})])
        shutil.rmtree(held.site / "acme")
        place(held.site / "acme", b"a file where a folder was")

        with pytest.raises(BenchbotError, match="could not be put back"):
            journal.undo()
        (held.site / "acme").unlink()
        (held.site / "acme").mkdir()
        place(held.site / "acme" / "users_own.txt", b"not in any RECORD")
        journal.undo()

        assert {path: content for path, (_, content) in listing(held.prefix).items()} == {
            path: content for path, (_, content) in before.items()
        }


def test_what_came_to_stay_stays_and_nothing_is_left_of_the_journal() -> None:
    with environment() as held, tempfile.TemporaryDirectory() as apart:
        journal = Journal(held)
        journal.open("install acme", [], [write(Path(apart), "2.0", {"one.py": b"1"})])
        write(held.site, "2.0", {"one.py": b"1"})
        journal.close()
        journal.undo()
        assert (held.site / "acme" / "one.py").read_bytes() == b"1"
        assert list(held.own.iterdir()) == []


def test_what_somebody_else_has_installed_meanwhile_stays() -> None:
    with environment() as held, tempfile.TemporaryDirectory() as apart:
        journal = Journal(held)
        journal.open("install acme", [], [write(Path(apart), "2.0", {"one.py": b"1"})])
        write(held.site, "2.0", {"one.py": b"1"})
        place(held.site / "others" / "new.py", b"")
        journal.undo()
        assert (held.site / "others" / "new.py").exists()
        assert not (held.site / "acme" / "one.py").exists()
        assert not (held.prefix / "bin" / "acme").exists()


def test_a_journal_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    journal = Journal(Environment(tmp_path, tmp_path, (tmp_path,)))
    journal.folder.mkdir(parents=True)
    (journal.folder / "journal.json").write_text("{")
    with pytest.raises(BenchbotError, match="cannot be read"):
        journal.undo()
