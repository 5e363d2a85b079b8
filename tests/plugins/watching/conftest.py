from pathlib import Path

import pytest

from tests.supervisor.conftest import serve

__all__ = ["serve"]


@pytest.fixture(autouse=True)
def _folders_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    for name in ("BENCHBOT_URL", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "BENCHBOT_RESULT", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
