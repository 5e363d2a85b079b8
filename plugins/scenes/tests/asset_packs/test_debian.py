"""Debian packages, read as archives."""

import subprocess
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.packs import debian
from plugins.scenes.tests.asset_packs.furniture import ar, deb

FILES = {"usr/share/sweethome3d/furniture/a.sh3f": b"a" * 70_001, "usr/share/doc/copyright": b"CC", "b.sh3f": b"b"}


@pytest.mark.parametrize("compression", ["xz", "gz", "bz2"])
def test_the_wanted_files_are_unpacked_by_their_bare_names(tmp_path: Path, compression: str) -> None:
    package = deb(tmp_path / "p.deb", FILES, compression)
    (tmp_path / "out").mkdir()

    found = debian.unpack(package, tmp_path / "out", (".sh3f",))

    assert {path.name: path.read_bytes() for path in found} == {"a.sh3f": b"a" * 70_001, "b.sh3f": b"b"}
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.sh3f", "b.sh3f"]


@pytest.mark.parametrize("compression", ["xz", "zst"])
def test_a_package_that_dpkg_has_built_is_read(tmp_path: Path, compression: str) -> None:
    (tmp_path / "tree/DEBIAN").mkdir(parents=True)
    control = "Package: toys\nVersion: 1\nArchitecture: all\nMaintainer: a <a@b.c>\nDescription: toys\n"
    (tmp_path / "tree/DEBIAN/control").write_text(control)
    (tmp_path / "tree/x.sh3f").write_bytes(b"x")
    name = {"xz": "-Zxz", "zst": "-Zzstd"}[compression]
    subprocess.run(["dpkg-deb", name, "-b", str(tmp_path / "tree"), str(tmp_path / "t.deb")], check=True)

    (found,) = debian.unpack(tmp_path / "t.deb", tmp_path, (".sh3f",))

    assert found.read_bytes() == b"x"


def test_a_name_that_leads_elsewhere_leads_nowhere(tmp_path: Path) -> None:
    package = deb(tmp_path / "p.deb", {"../../evil.sh3f": b"a"})
    (tmp_path / "out").mkdir()

    (found,) = debian.unpack(package, tmp_path / "out", (".sh3f",))

    assert found == tmp_path / "out" / "evil.sh3f"


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "does not begin as an ar archive"),
        (b"PK\3\4", "does not begin as an ar archive"),
        (ar({"debian-binary": b"2.0\n"}), "no member data.tar"),
        (ar({"data.tar.xz": b"\xfd7zXZ\0 and then nothing"}), ""),
        (ar({"a": b"x"}) + b"torn", "header of a member is damaged"),
    ],
)
def test_what_is_no_package_is_refused(tmp_path: Path, content: bytes, why: str) -> None:
    (tmp_path / "p.deb").write_bytes(content)

    with pytest.raises(BenchbotError, match="not a Debian package that can be read") as caught:
        debian.unpack(tmp_path / "p.deb", tmp_path, (".sh3f",))
    assert why in caught.value.why


def test_a_package_that_was_cut_short_is_refused(tmp_path: Path) -> None:
    package = deb(tmp_path / "p.deb", {"a.sh3f": bytes(range(256)) * 400})
    package.write_bytes(package.read_bytes()[:-100])

    with pytest.raises(BenchbotError, match="not a Debian package that can be read"):
        debian.unpack(package, tmp_path, (".sh3f",))


def test_where_there_is_no_apt_the_way_around_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(BenchbotError, match="cannot be fetched here") as caught:
        debian.download("sweethome3d-furniture", tmp_path)
    assert "--from FILE.deb" in caught.value.fix


def test_what_apt_says_is_passed_on(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="could not be fetched") as caught:
        debian.download("no-such-package-of-debian", tmp_path)
    assert "no-such-package-of-debian" in caught.value.why
