from pathlib import Path

import pytest

from benchbot.plugins.installer.indexes import Indexes, without_credentials


def test_secrets_are_left_out_of_what_is_printed_and_of_the_options_of_processes() -> None:
    assert without_credentials("see https://me:secret@example.org/simple/ and http://token@x/") == (
        "see https://example.org/simple/ and http://x/"
    )
    indexes = Indexes("https://me:secret@example.org/simple", ("https://t@two/",), offline=True, links=(Path("w"),))
    assert indexes.options() == ["--no-index", "--find-links", str(Path("w").absolute())]
    assert indexes.variables("A", "B") == {"A": indexes.url, "B": "https://t@two/"}


def test_an_index_meant_for_uv_or_pip_serves_the_search_and_the_other_one(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"):
        monkeypatch.delenv(name, raising=False)
    assert Indexes().variables("UV_DEFAULT_INDEX", "UV_INDEX") == {}

    monkeypatch.setenv("PIP_INDEX_URL", "https://pip/simple")
    assert Indexes().addresses == ["https://pip/simple"]
    assert Indexes().variables("UV_DEFAULT_INDEX", "UV_INDEX") == {"UV_DEFAULT_INDEX": "https://pip/simple"}
    assert Indexes("https://own/").variables("UV_DEFAULT_INDEX", "UV_INDEX") == {"UV_DEFAULT_INDEX": "https://own/"}

    monkeypatch.setenv("UV_DEFAULT_INDEX", "https://uv/simple")
    assert Indexes().variables("UV_DEFAULT_INDEX", "UV_INDEX") == {}
    assert Indexes().variables("PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL") == {}
