from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _packs_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_DATA_DIR", str(tmp_path / "data"))
