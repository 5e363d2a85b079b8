import importlib.metadata
import sys
from pathlib import Path

import pytest

from benchbot.core import entry_points
from benchbot.core.entry_points import EntryPoint


@pytest.mark.parametrize("group", ["console_scripts", "benchbot", "pytest11", "no_such_group"])
def test_what_is_installed_is_found_as_the_standard_library_finds_it(group: str) -> None:
    expected = {
        EntryPoint(point.name, point.value.partition("[")[0].strip(), distribution.name, distribution.version)
        for distribution in importlib.metadata.distributions()
        for point in distribution.entry_points
        if point.group == group
    }
    assert set(entry_points.find(group)) == expected


def test_odd_but_legal_metadata_is_understood(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "acme.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: Acme.Bot\nVersion: 1.2.post3\n\nName: body\n")
    (info / "entry_points.txt").write_text(
        "# a comment = none\n[other]\nx = y\n\n[ benchbot ]\n; no = no\n a=acme.plugin \nb = acme:plugin [extra]\n"
        "[benchbot]\nc = acme.more\n"
    )
    (tmp_path / "empty.dist-info").mkdir()
    monkeypatch.setattr(sys, "path", [str(tmp_path), str(tmp_path / "missing"), str(info / "METADATA")])
    assert list(entry_points.find("benchbot")) == [
        EntryPoint("a", "acme.plugin", "Acme.Bot", "1.2.post3"),
        EntryPoint("b", "acme:plugin", "Acme.Bot", "1.2.post3"),
        EntryPoint("c", "acme.more", "Acme.Bot", "1.2.post3"),
    ]
