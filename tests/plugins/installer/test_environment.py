import sys
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer import environment
from benchbot.plugins.installer.distributions import Distribution
from benchbot.plugins.installer.installers import Pin, choose
from benchbot.plugins.installer.running import Runner
from benchbot.plugins.installer.staging import Staged


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


def test_a_wheel_that_brings_more_or_less_than_it_says_is_damaged(tmp_path: Path) -> None:
    info = tmp_path / "acme-1.0.dist-info"
    info.mkdir()
    (info / "RECORD").write_text("acme/__init__.py,,\nacme-1.0.dist-info/RECORD,,\n")
    (tmp_path / "acme").mkdir()
    (tmp_path / "acme" / "__init__.py").write_text("")
    staged = Staged([Pin("acme", "1.0", "acme==1.0")], tmp_path)
    assert staged.distributions == {"acme": Distribution("acme", "1.0", info)}

    (tmp_path / "acme" / "hidden.py").write_text("")
    with pytest.raises(BenchbotError, match="A wheel is damaged") as caught:
        _ = staged.distributions
    assert caught.value.why == "It holds files that its RECORD does not name: acme/hidden.py."
    with pytest.raises(BenchbotError, match="A wheel is damaged"):
        _ = Staged([Pin("other", "1.0", "other==1.0")], tmp_path).distributions
