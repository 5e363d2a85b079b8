"""Images that are handed in: what counts, by which digest, and what is refused before anything is loaded."""

import base64
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select
from starlette.testclient import TestClient

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import archive
from benchbot.plugins.challenge import client as participants
from benchbot.plugins.challenge import handing_in, intake, people, publication, queue, signing
from benchbot.plugins.challenge.document import Phase
from benchbot.plugins.challenge.handing_in import Admitted
from benchbot.plugins.challenge.tables import submissions
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import Site
from tests.plugins.challenge.conftest import scores_document
from tests.plugins.challenge.test_uploads import SUBMIT, files
from tests.plugins.containers import layouts
from tests.plugins.containers.test_layout import FILES, HOSTILE


@pytest.fixture
def client(site: Site) -> Iterator[TestClient]:
    with TestClient(create_app(site), follow_redirects=False) as opened:
        yield opened


def joined(site: Site, client: TestClient, name: str, key: signing.Key | None = None) -> dict[str, str]:
    """Return the headers of a new team."""
    more = {} if key is None else {"key": key.public}
    asked = {"invitation": people.invite(site.database), "name": name, **more}
    return {"authorization": f"Bearer {client.post('/api/v1/join', json=asked).json()['token']}"}


def packed(path: Path, image: dict[str, bytes]) -> bytes:
    """Return an archive whose form is right, whatever the image in it."""
    about = {"version": 1, "command": [], "mode": "container"}
    members = [archive.Member(f"solution/{name}", content) for name, content in image.items()]
    archive.write(path, [*members, archive.Member(intake.ABOUT, json.dumps(about).encode())])
    return path.read_bytes()


def test_an_image_counts_by_the_digest_of_its_configuration(site: Site, client: TestClient, tmp_path: Path) -> None:
    image = layouts.make(FILES)
    intake.pack(layouts.write(tmp_path / "image", image), None, tmp_path / "image.zip")
    ada = joined(site, client, "Ada")
    made = client.post(SUBMIT, content=(tmp_path / "image.zip").read_bytes(), headers=ada).json()
    digest = layouts.manifest_of(image)["config"]["digest"]
    assert (made["mode"], made["image"], made["state"]) == ("container", digest, "queued")
    assert client.get(f"/api/v1/submissions/{made['id']}", headers=ada).json()["image"] == digest
    solution = intake.unpack(site.challenge.uploads / f"{made['id']}.zip", tmp_path / "work" / "solution")
    assert solution.image == digest
    assert {path.name for path in (tmp_path / "work" / "solution").iterdir()} == {"oci-layout", "index.json", "blobs"}


@pytest.mark.parametrize("what", sorted(HOSTILE.keys() - {"no layout"}))  # which is a folder as any other
def test_an_image_that_is_not_sound_is_no_submission(site: Site, client: TestClient, tmp_path: Path, what: str) -> None:
    site.challenge = replace(site.challenge, unpacked_bytes=2**25)
    made, why = HOSTILE[what]
    ada = joined(site, client, "Ada")
    refused = client.post(SUBMIT, content=packed(tmp_path / "image.zip", made()), headers=ada)
    assert refused.status_code == 400
    assert why in refused.json()["why"]
    assert client.get("/api/v1/submissions", headers=ada).json() == []
    assert files(site.challenge.folder) == []


def test_a_statement_is_about_one_image_of_one_team_once(
    site: Site, client: TestClient, phase: Phase, tmp_path: Path
) -> None:
    image, other = (packed(tmp_path / f"{name}.zip", layouts.make(FILES[:name])) for name in (1, 2))
    digest = intake.examined(tmp_path / "1.zip").image
    keys = {name: signing.make(tmp_path / name) for name in ("Ada", "Bob")}
    teams = {name: joined(site, client, name, key) for name, key in keys.items()}

    def hand_in(sender: str, content: bytes, signer: signing.Key, sha256: str, **about: Any) -> tuple[int, str]:
        predicate = {"challenge": site.challenge.name, "phase": phase.name, "team": sender, "nonce": "1", **about}
        header = base64.b64encode(json.dumps(signer.sign(signing.SUBMISSION, sha256, predicate)).encode()).decode()
        answer = client.post(SUBMIT, content=content, headers={**teams[sender], signing.HEADER: header})
        return answer.status_code, answer.json().get("why", "")

    sha256 = intake.sha256_of(tmp_path / "1.zip")
    about_another = (400, "It names another archive, image, challenge, phase or team.")
    assert hand_in("Ada", image, keys["Ada"], sha256) == about_another  # which image, it does not say
    assert hand_in("Ada", image, keys["Ada"], sha256, image=f"sha256:{'0' * 64}") == about_another
    assert hand_in("Ada", other, keys["Ada"], sha256, image=digest) == about_another
    assert hand_in("Ada", image, keys["Ada"], sha256, image=digest)[0] == 201
    assert "accepted before" in hand_in("Ada", image, keys["Ada"], sha256, image=digest)[1]
    # Another team has got hold of the bytes and of the statement: neither makes them its own.
    assert hand_in("Bob", image, keys["Ada"], sha256, team="Ada", image=digest)[0] == 400
    assert hand_in("Bob", image, keys["Bob"], sha256, team="Ada", image=digest) == about_another

    # Scored, and published: the row names the image, and nobody can put another in its place.
    claim = queue.claim(site.database, "w")
    assert claim is not None
    (made,) = client.get("/api/v1/submissions", headers=teams["Ada"]).json()
    with site.database.reading() as connection:
        statement = connection.scalar(select(submissions.c.statement))
    stated = {**signing.about(site.challenge.name, phase.name, "Ada", digest), "statement": statement, "score": 0.5}
    signed = site.key.sign(signing.SCORE, sha256, {**stated, "submission": made["id"], "commitments": {}})
    assert queue.finish(site.database, claim, 0.5, scores_document({"miniroom:1": 0.5}), signed)
    publication.write(site, tmp_path / "export")
    publication.verify(tmp_path / "export", None)
    path = tmp_path / "export" / "development-rows.json"
    rows = json.loads(path.read_bytes())
    for swapped in (f"sha256:{'0' * 64}", None):
        forged = {**stated, "submission": made["id"], "commitments": {}, "image": swapped}
        rows[0]["score_envelope"] = site.key.sign(signing.SCORE, sha256, forged)
        path.write_text(json.dumps(rows))
        with pytest.raises(BenchbotError, match="is another one"):
            publication.verify(tmp_path / "export", None)


def test_a_client_signs_for_the_image_that_it_hands_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packed(tmp_path / "image.zip", layouts.make(FILES))
    sent: dict[str, Any] = {}

    def ask(_self: Any, method: str, _path: str, **more: Any) -> Any:
        sent.update(more.get("headers", {}))
        return {"team": "Ada"} if method == "GET" else {}

    monkeypatch.setattr(participants.Server, "ask", ask)
    server, key = participants.Server("http://localhost"), signing.make(tmp_path / "key")
    participants.submit(server, {"name": "rooms"}, tmp_path / "image.zip", "development", "", key)
    envelope = json.loads(base64.b64decode(sent[signing.HEADER]))
    assert signing.image_in(envelope) == intake.examined(tmp_path / "image.zip").image


def test_what_is_neither_a_file_nor_an_image_is_told_before_anything_is_saved(tmp_path: Path) -> None:
    for what, command, admitted, why in (
        ("./my_solution", None, Admitted(), "no name of an image"),
        ("my_solution", "python solution.py", Admitted(), "With --command a folder or a file"),
        ("my_image", None, Admitted("Test", ("sandbox",)), "Admitted: sandbox"),
    ):
        with (
            pytest.raises(BenchbotError) as raised,
            handing_in.archive(what, command, None, admitted),
        ):
            pass
        assert why in raised.value.why
