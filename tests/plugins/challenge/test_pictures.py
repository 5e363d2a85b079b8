"""Pictures beside the leaderboard: made of visible places alone, and shown as long as their row is."""

import hashlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from starlette.testclient import TestClient

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge import organiser, pictures, publication
from benchbot.plugins.challenge.document import Challenge, Phase
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import Site
from tests.plugins.challenge.conftest import kept, score_of

FLAT = "secret_flat:1"


def batch_of(folder: Path, scores: dict[str, float]) -> tuple[Path, dict[str, Any]]:
    """Write results that are none to draw, with a frame beside each, and return the batch and its scores document."""
    rows = []
    for number, (environment, score) in enumerate(scores.items()):
        episode = folder / "batch" / "episodes" / str(number)
        (episode / "frames").mkdir(parents=True)
        (episode / "result.json").write_text("{}", "utf-8")
        Image.new("RGB", (720, 400), (number * 40, 0, 0)).save(episode / "frames" / "00000.jpg")
        rows.append({"environment": environment, "source": str(episode / "result.json"), "scores": {"OMQ": score}})
    return folder / "batch", {"method": {"headline": "OMQ"}, "rows": rows}


def hiding(challenge: Challenge, environment: str) -> Challenge:
    """Return a challenge with a second phase, whose place is hidden."""
    shown = challenge.phases["development"]
    test = replace(shown, name="test", hidden=True, batch={**shown.batch, "environments": [environment]})
    return replace(challenge, phases={"development": shown, "test": test})


@pytest.mark.parametrize(
    ("scores", "of"),
    [
        ({"miniroom:1": 0.4, "house:1": 0.7}, "house:1"),
        ({"miniroom:1": 0.4, FLAT: 0.9}, "miniroom:1"),  # the best is of a place that is hidden elsewhere
        ({"miniroom:1": 0.4, "secret_flat:2": 0.9}, "miniroom:1"),  # another variant has the same rooms
        ({FLAT: 0.9}, None),
    ],
)
def test_the_best_episode_in_a_visible_place_is_shown(
    challenge: Challenge, tmp_path: Path, scores: dict[str, float], of: str | None
) -> None:
    both = hiding(challenge, FLAT)
    made = pictures.make(both, both.phases["development"], *batch_of(tmp_path, scores))
    assert [(item["kind"], item["environment"]) for item in made] == ([] if of is None else [("frame", of)])
    for item in made:
        content = (both.pictures / item["file"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == item["file"].partition(".")[0]
        assert Image.open(io.BytesIO(content)).size == (item["width"], item["height"]) == (360, 200)


def test_of_a_hidden_phase_nothing_is_drawn(challenge: Challenge, tmp_path: Path) -> None:
    both = hiding(challenge, FLAT)
    assert pictures.make(both, both.phases["test"], *batch_of(tmp_path, {FLAT: 0.9, "miniroom:1": 0.4})) == []
    assert not both.pictures.exists()


def test_pictures_of_one_submission_are_no_more_bytes_than_may_be(
    challenge: Challenge, phase: Phase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch, document = batch_of(tmp_path, {"miniroom:1": 0.4})
    monkeypatch.setattr(pictures, "MOST_BYTES", 100)
    assert pictures.make(challenge, phase, batch, document) == []
    (batch / "episodes" / "0" / "frames" / "00000.jpg").write_bytes(b"no picture")
    monkeypatch.undo()
    assert pictures.make(challenge, phase, batch, document) == []


def test_they_are_served_while_their_row_stands_and_their_place_is_visible(site: Site, phase: Phase) -> None:
    known = kept(site.challenge)
    identifier = score_of(site, phase, "<b>Ada</b>", 0.5, pictures=[known])
    address = f"/phases/development/pictures/{known['file']}"
    with TestClient(create_app(site)) as client:
        page, answer = client.get("/phases/development"), client.get(address)
        assert f'src="{address}"' in page.text
        assert "what &lt;b&gt;Ada&lt;/b&gt; found" in page.text
        assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png")
        assert answer.headers["cache-control"] == "public, max-age=600"
        assert answer.headers["x-content-type-options"] == "nosniff"
        again = client.get(address, headers={"if-none-match": answer.headers["etag"]})
        assert again.headers["etag"] == answer.headers["etag"]
        for other in ("0" * 64 + ".png", "..%2Forganiser.token", "..%2F..%2Fchallenge.key"):
            refused = client.get(f"/phases/development/pictures/{other}")
            assert (refused.status_code, refused.headers["cache-control"]) == (404, "no-store")
        organiser.disqualify(site.database, identifier, "it cheats")
        assert client.get(address).status_code == 404
        assert known["file"] not in client.get("/phases/development").text


@pytest.mark.parametrize("environment", ["miniroom:1", "miniroom:3"])
def test_a_place_that_becomes_hidden_is_shown_no_more(site: Site, phase: Phase, environment: str) -> None:
    known = kept(site.challenge)
    score_of(site, phase, "Ada", 0.5, pictures=[known])
    again = Site(hiding(site.challenge, environment), site.database, site.key, site.evaluators, "operator")
    with TestClient(create_app(again)) as client:
        told = [client.get(path).text for path in ("/phases/development", "/api/v1/phases/development/leaderboard")]
        assert client.get(f"/phases/development/pictures/{known['file']}").status_code == 404
        assert client.get(f"/phases/test/pictures/{known['file']}").status_code == 404
    assert not any(known["file"] in text for text in told)


def test_an_export_has_them_and_they_are_as_signed(site: Site, phase: Phase, tmp_path: Path) -> None:
    known = kept(site.challenge)
    score_of(site, phase, "Ada", 0.5, pictures=[known])
    kept(site.challenge, "house:1")  # of a submission that does not count
    export = tmp_path / "export"
    publication.write(site, export)
    assert f'src="pictures/{known["file"]}"' in (export / "development.html").read_text("utf-8")
    assert [path.name for path in (export / "pictures").iterdir()] == [known["file"]]
    assert publication.verify(export, None)["phases"] == {"development": 1}
    (export / "pictures" / known["file"]).write_bytes(b"another")
    with pytest.raises(BenchbotError, match="not the one that was signed"):
        publication.verify(export, None)
    board = json.loads((export / "development.json").read_text("utf-8"))
    board["standings"][0]["pictures"][0]["file"] = f"{hashlib.sha256(b'evil').hexdigest()}.png"
    (export / "development.json").write_text(json.dumps(board), "utf-8")
    with pytest.raises(BenchbotError, match="not the one that was signed"):
        publication.verify(export, None)
