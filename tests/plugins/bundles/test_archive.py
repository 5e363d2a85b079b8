"""The file of a bundle: what is put in comes out, and nothing else than what was written is ever read."""

import struct
import zipfile
from copy import copy
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import archive
from benchbot.plugins.bundles.archive import Member

FEW = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
NAMES = st.text(st.characters(exclude_categories=["C"], exclude_characters='/\\:*?"<>|'), min_size=1, max_size=12)
PATHS = st.lists(NAMES.filter(lambda name: name not in (".", "..")), min_size=1, max_size=3).map("/".join)
CONTENTS = st.dictionaries(PATHS, st.tuples(st.binary(max_size=40), st.booleans()), max_size=6)


def packed(path: Path, files: dict[str, tuple[bytes, bool]]) -> Path:
    archive.write(path, [Member(name, content, executable) for name, (content, executable) in files.items()])
    return path


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    return packed(tmp_path / "bundle.zip", {"a/b.txt": (b"ab" * 40, False), "run.sh": (b"#!", True), "ä": (b"", False)})


def refuses(path: Path, content: bytes) -> bool:
    path.write_bytes(content)
    with pytest.raises(BenchbotError) as caught, archive.opened(path):
        pass
    return "is not a sound bundle" in caught.value.title


@FEW
@given(CONTENTS.filter(lambda files: archive.flaw(files) is None))
def test_what_is_put_in_comes_out_and_the_same_gives_the_same_bytes(
    tmp_path: Path, files: dict[str, tuple[bytes, bool]]
) -> None:
    first = packed(tmp_path / "first.zip", files).read_bytes()
    second = packed(tmp_path / "second.zip", dict(reversed(files.items()))).read_bytes()

    assert first == second
    with archive.opened(tmp_path / "first.zip") as opened:
        assert {path: member.read() for path, member in opened.members.items()} == {
            path: held for path, (held, _) in files.items()
        }


@FEW
@given(st.data())
def test_a_single_bit_is_enough_to_be_refused(tmp_path: Path, bundle: Path, data: st.DataObject) -> None:
    content = bytearray(bundle.read_bytes())
    bit = data.draw(st.integers(0, len(content) * 8 - 1))
    content[bit // 8] ^= 1 << bit % 8
    assert refuses(tmp_path / "flipped.zip", bytes(content))


@FEW
@given(st.data())
def test_what_is_cut_off_or_grown_is_refused(tmp_path: Path, bundle: Path, data: st.DataObject) -> None:
    content = bundle.read_bytes()
    start = data.draw(st.integers(0, len(content)))
    stop = data.draw(st.integers(start, len(content)))
    before, after = data.draw(st.binary(max_size=30)), data.draw(st.binary(max_size=30))
    other = before + content[start:stop] + after
    if other != content:
        assert refuses(tmp_path / "other.zip", other)


@FEW
@given(st.binary(max_size=200))
def test_any_other_bytes_are_refused(tmp_path: Path, content: bytes) -> None:
    assert refuses(tmp_path / "noise.zip", content)
    assert refuses(tmp_path / "noise.zip", content + b"PK\5\6" + struct.pack("<4H2LH", 0, 0, 3, 3, len(content), 0, 0))


def member(name: str, attributes: int = 0o100644 << 16) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr = 3, attributes
    return info


DEFLATED = member("a")
DEFLATED.compress_type = zipfile.ZIP_DEFLATED
HOSTILE: dict[str, list[tuple[zipfile.ZipInfo, bytes]]] = {
    "leads out": [(member("../../etc/passwd"), b"x")],
    "absolute": [(member("/etc/passwd"), b"x")],
    "another drive": [(member("C:/x"), b"x")],
    "backslashes": [(member("..\\x"), b"x")],
    "a line end": [(member("a\nb"), b"x")],
    "written backwards": [(member("a\u202egnp.py"), b"x")],
    "a link": [(member("a", 0o120777 << 16), b"/etc/passwd")],
    "a folder": [(member("a/", 0o40755 << 16), b"")],
    "a device": [(member("a", 0o20666 << 16), b"")],
    "rights of the owner": [(member("a", 0o104755 << 16), b"")],
    "twice": [(member("a"), b"1"), (member("a"), b"2")],
    "twice on some machines": [(member("A"), b"1"), (member("a"), b"1")],
    "a file and a folder": [(member("a"), b"1"), (member("a/b"), b"1")],
    "a bomb": [(DEFLATED, bytes(2**20))],
    "a deep path": [(member("a/" * 40 + "b"), b"x")],
    "another order": [(member("b"), b"1"), (member("a"), b"1")],
    "another time": [(zipfile.ZipInfo("a", (2020, 1, 1, 0, 0, 0)), b"1")],
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_archives_are_refused(tmp_path: Path, what: str) -> None:
    path = tmp_path / "hostile.zip"
    with zipfile.ZipFile(path, "w") as file:
        for info, content in HOSTILE[what]:
            file.writestr(copy(info), content)
    assert refuses(path, path.read_bytes())


def test_what_is_hidden_in_a_comment_is_refused(tmp_path: Path, bundle: Path) -> None:
    with zipfile.ZipFile(bundle, "a") as file:
        file.comment = b"hidden"
    assert refuses(tmp_path / "commented.zip", bundle.read_bytes())


def test_too_many_members_are_refused_before_they_are_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "many.zip"
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 65535, 65535, 46, 0, 0)
    path.write_bytes(bytes(46) + end)
    with pytest.raises(BenchbotError, match="not a sound bundle") as caught, archive.opened(path):
        pass
    assert "65535 members" in caught.value.why


def test_what_cannot_be_in_a_bundle_is_named_and_nothing_is_written(tmp_path: Path) -> None:
    target = tmp_path / "bundle.zip"
    for path in ("../out", "a\\b", "con:1", "a//b"):
        with pytest.raises(BenchbotError, match="cannot be made"):
            archive.write(target, [Member(path, b"")])
    with pytest.raises(BenchbotError, match="cannot be made") as caught:
        archive.write(target, [Member(f"{number}", b"") for number in range(archive.MAX_MEMBERS + 1)])
    assert str(archive.MAX_MEMBERS) in caught.value.why
    with pytest.raises(BenchbotError, match="Cannot write"):
        archive.write(Path("/dev/null/bundle.zip"), [])
    assert list(tmp_path.iterdir()) == []


def test_what_is_unpacked_may_be_run_where_it_could_be_run_before(tmp_path: Path, bundle: Path) -> None:
    folder = tmp_path / "unpacked"
    archive.write(
        bundle, [Member("in/run.sh", b"#!", executable=True), Member("in/deep/a.txt", b"a"), Member("b", b"")]
    )
    with archive.opened(bundle) as opened:
        opened.extract("in", folder)
    assert sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()) == [
        "deep/a.txt",
        "run.sh",
    ]
    assert (folder / "run.sh").stat().st_mode & 0o111
    assert not (folder / "deep/a.txt").stat().st_mode & 0o111


def test_what_is_no_file_is_no_bundle(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nothing.zip"):
        with pytest.raises(BenchbotError, match="Cannot read"), archive.opened(path):
            pass
    with pytest.raises(BenchbotError, match="not a sound bundle"), archive.opened(Path("/dev/zero")):
        pass
