from pathlib import Path

import pytest

from benchbot.core import resources
from benchbot.core.errors import BenchbotError


def test_folders_are_made_where_the_user_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "deep" / "state"))
    assert resources.cache_dir() == tmp_path / "cache"
    assert resources.state_dir() == tmp_path / "deep" / "state"
    assert resources.state_dir().stat().st_mode & 0o777 == 0o700


def test_a_folder_that_cannot_be_made_is_named_with_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", "/dev/null/state")
    with pytest.raises(BenchbotError, match="The folder /dev/null/state cannot be used") as caught:
        resources.state_dir()
    assert "BENCHBOT_STATE_DIR" in caught.value.fix


def test_declaration_files_are_sorted_and_folders_opened_once(tmp_path: Path) -> None:
    for name in ("b.yaml", "a.yml", "note.txt", "deeper/c.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = resources.declaration_files([tmp_path, tmp_path / "deeper" / "c.yaml"])
    assert [path.name for path in found] == ["a.yml", "b.yaml", "c.yaml"]
