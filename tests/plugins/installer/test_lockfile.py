"""The plug-ins of a project, locked on one machine and the same on another."""

import tomllib
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer import lockfile
from benchbot.plugins.installer.lockfile import LockedDistribution
from tests.plugins.installer import wheels
from tests.plugins.installer.environments import Entry, Environment
from tests.plugins.installer.wheels import Index

pytestmark = pytest.mark.xdist_group("installing")


@pytest.fixture(scope="module")
def offered(index: Index, tmp_path_factory: pytest.TempPathFactory) -> tuple[Index, Path]:
    """A plug-in that needs a library, in two versions; the folder holds all wheels, for those without network."""
    folder = tmp_path_factory.mktemp("wheels")
    for version in ("1.0", "2.0"):
        index.publish(wheels.make(folder, "lock-task", version, requires=["lock-library"]))
    index.publish(wheels.make(folder, "lock-library", code="VALUE = 1\n", files={}, entry=False))
    index.publish(wheels.make(folder, "lock-other"))
    return index, folder


def packages(listing: dict[str, Entry]) -> dict[str, Entry]:
    """Return what is in the packages: metadata says how they came here, which differs."""
    return {path: entry for path, entry in listing.items() if "/lock_" in path and ".dist-info" not in path}


@pytest.mark.slow
@pytest.mark.parametrize("installer", ["uv", "pip"])
def test_a_lock_makes_the_same_plugins_again_also_without_network(
    installer: str, offered: tuple[Index, Path], shared: Environment, tmp_path: Path
) -> None:
    index, folder = offered
    online, offline = ("--index-url", index.url), ("--no-index", "--find-links", str(folder))
    by = ("--installer", installer)
    installed = shared.run("install", "lock-task==1.0", *online, "--trust")
    assert "+ lock-library 1.0  (dependency; code)" in installed.stdout, installed.stderr

    locked = shared.run("plugins", "lock", *online, *by, cwd=tmp_path)
    assert (locked.returncode, locked.stdout) == (0, "benchbot.lock\n"), locked.stderr
    rows = tomllib.loads((tmp_path / "benchbot.lock").read_text())["distribution"]
    assert [(row["name"], row["version"], row["plugin"], row["from"]) for row in rows] == [
        ("lock-library", "1.0", False, "index"),
        ("lock-task", "1.0", True, "index"),
    ]
    assert all(len(row["hashes"]) == 1 and row["hashes"][0].startswith("sha256:") for row in rows)
    before = shared.listing()
    assert shared.run("plugins", "sync", *online, cwd=tmp_path).stdout == ""

    # Somebody else's environment: another version, another plug-in, no network.
    changed = shared.run("install", "lock-task==2.0", "lock-other", *online)
    assert changed.returncode == 0, changed.stderr
    synced = shared.run("plugins", "sync", *offline, *by, cwd=tmp_path)
    assert synced.returncode == 0, synced.stderr
    assert synced.stdout == "~ lock-task 2.0 -> 1.0  (plug-in; declarations only)\n- lock-other 1.0  (plug-in)\n"
    assert packages(shared.listing()) == packages(before)

    # What the lock does not know byte for byte is not installed.
    shared.run("uninstall", "lock-task")
    gone = shared.listing()
    text = (tmp_path / "benchbot.lock").read_text()
    (tmp_path / "benchbot.lock").write_text(text.replace(rows[1]["hashes"][0], f"sha256:{'0' * 64}"))
    wrong = shared.run("plugins", "sync", *offline, *by, cwd=tmp_path)
    assert (wrong.returncode, "its hash is wrong" in wrong.stderr) == (2, True), wrong.stderr
    assert shared.listing() == gone
    shared.remove("lock-library")


@pytest.mark.slow
def test_what_a_plugin_needs_is_code_that_must_be_allowed_too(
    offered: tuple[Index, Path], shared: Environment, tmp_path: Path
) -> None:
    state = {"BENCHBOT_STATE_DIR": str(tmp_path / "state")}
    refused = shared.run("install", "lock-task==1.0", "--index-url", offered[0].url, changes=state)
    assert refused.returncode == 2
    assert "It would run with all your rights: lock-library." in refused.stderr


def test_a_lock_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "benchbot.lock"
    locked = [
        LockedDistribution("acme", "1.0", True, "index", ("sha256:1", "sha256:2")),
        LockedDistribution("acme-lab", "2", False, 'git+https://example.org/"x"@1'),
    ]
    lockfile.write(path, locked)
    assert lockfile.read(path) == locked
    assert [one.source for one in locked] == [
        "acme==1.0 --hash=sha256:1 --hash=sha256:2",
        'git+https://example.org/"x"@1',
    ]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("version = 2\n", "this BenchBot reads version 1"),
        ("version = ", "Invalid value"),
        ("version = 1\n[[distribution]]\nname = 'a'\n", "lacks 'version'"),
        ("version = 1\n[[distribution]]\nname='a'\nversion='1'\nplugin=true\nfrom='index'\nhashes=[]\n", "no hashes"),
    ],
)
def test_what_is_no_lock_is_told(text: str, why: str, tmp_path: Path) -> None:
    path = tmp_path / "benchbot.lock"
    path.write_text(text)
    with pytest.raises(BenchbotError, match="is no lock that can be used") as caught:
        lockfile.read(path)
    assert why in caught.value.why
    with pytest.raises(BenchbotError, match="cannot be read"):
        lockfile.read(tmp_path / "none.lock")
