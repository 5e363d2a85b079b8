import sys
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer import environment
from benchbot.plugins.installer.installers import choose
from benchbot.plugins.installer.subprocesses import Runner


def test_the_system_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", sys.base_prefix)
    with pytest.raises(BenchbotError, match="does not run in a virtual environment") as caught:
        environment.current()
    assert "python3 -m venv" in caught.value.fix


def test_an_installer_that_there_is_not_is_told(tmp_path: Path) -> None:
    somewhere = environment.Environment(tmp_path, Path(sys.executable), (tmp_path,))
    with pytest.raises(BenchbotError, match="'conda' is no installer"):
        choose("conda", somewhere, Runner())
    assert choose("pip", somewhere, Runner()).name == "pip"
