"""Signed statements and published leaderboards: what is forged, replayed or signed anew is told."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge import organiser, publication, signing
from benchbot.plugins.challenge.document import Phase
from benchbot.plugins.challenge.web.site import Site
from tests.plugins.challenge.conftest import score_of

SHA = "ab" * 32


@pytest.fixture
def export(site: Site, phase: Phase, tmp_path: Path) -> Path:
    score_of(site, phase, "Ada", 0.9, signing.make(tmp_path / "ada.key"))
    score_of(site, phase, "Bob", 0.4)
    out = score_of(site, phase, "Eve", 1.0)
    organiser.disqualify(site.database, out, "it holds the ground truth")
    publication.write(site, tmp_path / "export")
    return tmp_path / "export"


def test_an_export_proves_itself(site: Site, export: Path) -> None:
    key = site.key.public["keyid"]
    assert publication.verify(export, key)["phases"] == {"development": 3}
    board = (export / "development.html").read_text("utf-8")
    assert board.index("Ada") < board.index("Bob")
    assert "it holds the ground truth" in board
    assert 'href="/' not in board  # it is opened from a disk
    past = (export / "development-history.html").read_text("utf-8")
    assert 'href="/' not in past
    assert [step["team"] for step in json.loads((export / "development-history.json").read_text("utf-8"))] == [
        "Ada",
        "Bob",
    ]
    assert not [path for path in export.rglob("*") if path.suffix in (".secret", ".key", ".token")]


def _edit(name: str, change: Callable[[Any], Any]) -> Callable[[Path], None]:
    def edit(export: Path) -> None:
        document = json.loads((export / name).read_text("utf-8"))
        (export / name).write_text(json.dumps(change(document)), "utf-8")

    return edit


def _row(number: int, **more: Any) -> Callable[[Path], None]:
    return _edit(
        "development-rows.json", lambda rows: [{**r, **more} if i == number else r for i, r in enumerate(rows)]
    )


def _replay(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [*rows, {**rows[0], "number": 9, "id": "another"}]


def _swap(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give Bob the score that was signed for Ada."""
    return [rows[0], {**rows[1], "score": rows[0]["score"], "score_envelope": rows[0]["score_envelope"]}, rows[2]]


@pytest.mark.parametrize(
    ("forge", "told"),
    [
        (_row(1, score=0.99), "is another one"),
        (_row(1, team="Ada"), "not signed by its team"),
        (_row(0, envelope_by="organiser"), "not signed by its team"),
        (_row(1, sha256="cd" * 32), "about something else"),
        (_edit("development-rows.json", _replay), "counts twice"),
        (_edit("development-rows.json", _swap), "is another one"),
        (_edit("development-rows.json", lambda rows: rows[1:]), "not that of the signed scores"),
        (_edit("development-rows.json", lambda rows: [{}, *rows]), "not the form"),
        (_edit("development.json", lambda board: {**board, "standings": board["standings"][::-1]}), "not that of the"),
        (_edit("keys.json", lambda keys: {}), "not signed by its team"),
    ],
)
def test_a_forged_export_is_told(export: Path, forge: Callable[[Path], None], told: str) -> None:
    forge(export)
    with pytest.raises(BenchbotError, match=told):
        publication.verify(export, None)


def test_an_export_that_somebody_has_signed_anew_has_another_key(site: Site, export: Path, tmp_path: Path) -> None:
    other = signing.make(tmp_path / "other.key")
    rows = json.loads((export / "development-rows.json").read_text("utf-8"))
    (export / "challenge.json").write_text(
        json.dumps({**json.loads((export / "challenge.json").read_text("utf-8")), "key": other.public}), "utf-8"
    )
    with pytest.raises(BenchbotError, match="another key than the one that was published"):
        publication.verify(export, site.key.public["keyid"])
    with pytest.raises(BenchbotError):  # and the old signatures are not the new key's
        publication.verify(export, None)
    assert rows


def test_secrets_are_revealed_only_once_a_hidden_phase_is_over(site: Site, tmp_path: Path, phase: Phase) -> None:
    from dataclasses import replace

    site.challenge = replace(site.challenge, phases={"test": replace(phase, name="test", hidden=True)})
    with pytest.raises(BenchbotError, match="cannot be revealed yet"):
        publication.write(site, tmp_path / "revealed", reveal=True)


@pytest.mark.parametrize("change", [{"keyid": "00"}, {"keytype": "rsa"}, {"keyval": {"public": "zz"}}, {"keyval": {}}])
def test_what_is_no_public_key_is_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    with pytest.raises(BenchbotError, match="no public key"):
        signing.public_key({**signing.make(tmp_path / "one.key").public, **change})


def test_a_private_key_is_its_owners_alone_and_is_not_replaced(tmp_path: Path) -> None:
    made = signing.make(tmp_path / "one.key")
    assert (tmp_path / "one.key").stat().st_mode & 0o077 == 0
    assert signing.load(tmp_path / "one.key").public == made.public
    with pytest.raises(BenchbotError, match="There is a key"):
        signing.make(tmp_path / "one.key")
