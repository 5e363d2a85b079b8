"""The site and its API as their callers meet them, the hostile ones too."""

import io
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from benchbot.plugins.bundles import archive
from benchbot.plugins.challenge import intake, organiser, people, queue, signing
from benchbot.plugins.challenge.document import Phase
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import MOST_ATTEMPTS, Site
from tests.plugins.challenge.conftest import score_of

HOSTILE = "<script>alert(1)</script>"
SUBMIT = "/api/v1/phases/development/submissions"


@pytest.fixture
def client(site: Site) -> Iterator[TestClient]:
    with TestClient(create_app(site), follow_redirects=False) as opened:
        yield opened


@pytest.fixture
def packed(tmp_path: Path) -> bytes:
    """An archive as participants make it."""
    (tmp_path / "solution").mkdir()
    (tmp_path / "solution" / "solution.py").write_text("print('hello')\n", "utf-8")
    intake.pack(tmp_path / "solution", "python solution.py", tmp_path / "packed.zip")
    return (tmp_path / "packed.zip").read_bytes()


def bearer(token: str) -> dict[str, str]:
    return {"authorization": f"Bearer {token}"}


def joined(site: Site, client: TestClient, name: str, **more: Any) -> dict[str, str]:
    """Return the headers of a new team."""
    asked = {"invitation": people.invite(site.database), "name": name, **more}
    answer = client.post("/api/v1/join", json=asked)
    assert answer.status_code == 201, answer.text
    return bearer(answer.json()["token"])


def form_token(page: str) -> str:
    found = re.search('name="form" value="([0-9a-f]+)"', page)
    assert found is not None
    return found[1]


def test_a_team_joins_hands_in_and_sees_its_own(site: Site, client: TestClient, packed: bytes) -> None:
    ada, bob = joined(site, client, "Ada"), joined(site, client, "Bob")
    made = client.post(f"{SUBMIT}?title=first", content=packed, headers=ada)
    assert made.status_code == 201
    identifier = made.json()["id"]
    assert client.get(f"/api/v1/submissions/{identifier}", headers=ada).json()["state"] == "queued"
    for path in (f"/api/v1/submissions/{identifier}", f"/api/v1/submissions/{identifier}/log"):
        assert client.get(path, headers=bob).status_code == 400
        assert client.get(path).status_code == 401
    assert client.delete(f"/api/v1/submissions/{identifier}", headers=bob).status_code == 400
    assert client.get("/api/v1/submissions", headers=bob).json() == []
    assert client.delete(f"/api/v1/submissions/{identifier}", headers=ada).status_code == 204
    assert (site.challenge.uploads / f"{identifier}.zip").read_bytes() == packed


def test_a_team_that_signs_must_sign_this_very_submission(
    site: Site, client: TestClient, packed: bytes, tmp_path: Path
) -> None:
    key, other = signing.make(tmp_path / "ada.key"), signing.make(tmp_path / "eve.key")
    ada = joined(site, client, "Ada", key=key.public)
    sha256 = intake.sha256_of(tmp_path / "packed.zip")
    about = {"challenge": site.challenge.name, "phase": "development", "team": "Ada", "nonce": "1"}

    def hand_in(signer: signing.Key, digest: str = sha256, **more: str) -> tuple[int, str]:
        import base64
        import json

        envelope = signer.sign(signing.SUBMISSION, digest, {**about, **more})
        header = base64.b64encode(json.dumps(envelope).encode()).decode()
        answer = client.post(SUBMIT, content=packed, headers={**ada, signing.HEADER: header})
        return answer.status_code, answer.text

    assert client.post(SUBMIT, content=packed, headers=ada).status_code == 400  # not signed
    assert hand_in(other)[0] == 400  # signed by somebody else
    assert hand_in(key, "00" * 32)[0] == 400  # of other bytes
    assert hand_in(key, team="Bob")[0] == 400  # for another team
    assert hand_in(key)[0] == 201
    assert "handed in already" in hand_in(key)[1]  # replayed
    assert len(list(site.challenge.uploads.glob("*.zip"))) == 1  # nothing refused stays


@pytest.mark.parametrize("kind", ["bomb", "junk", "outside", "no manifest"])
def test_what_is_no_sound_archive_never_counts(site: Site, client: TestClient, tmp_path: Path, kind: str) -> None:
    import zipfile

    content = io.BytesIO()
    if kind == "junk":
        content.write(b"PK\5\6" * 100)
    elif kind == "no manifest":
        archive.write(tmp_path / "x.zip", [archive.Member("solution/solution.py", b"")])
        content.write((tmp_path / "x.zip").read_bytes())
    else:
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED if kind == "bomb" else zipfile.ZIP_STORED) as made:
            made.writestr("submission.json", '{"command": ["python"], "mode": "sandbox"}')
            made.writestr(
                "solution/zero" if kind == "bomb" else "../../evil", b"\0" * 2**24 if kind == "bomb" else b"x"
            )
    ada = joined(site, client, "Ada")
    refused = client.post(SUBMIT, content=content.getvalue(), headers=ada)
    assert refused.status_code == 400
    assert "not a sound bundle" in refused.json()["title"]
    assert client.get("/api/v1/submissions", headers=ada).json() == []
    assert not [path for path in site.challenge.uploads.rglob("*") if path.is_file()]


def test_an_upload_that_is_too_large_is_refused_on_the_way(site: Site, client: TestClient) -> None:
    site.challenge = replace(site.challenge, largest_bytes=2**20)
    seen = 0

    def chunks() -> Iterator[bytes]:
        nonlocal seen
        for _ in range(64):
            seen += 2**18
            yield b"x" * 2**18

    refused = client.post(SUBMIT, content=chunks(), headers=joined(site, client, "Ada"))
    assert refused.status_code == 413
    assert not [path for path in site.challenge.uploads.rglob("*") if path.is_file()]


def test_wrong_tokens_are_counted(client: TestClient) -> None:
    answers = [
        client.get("/api/v1/submissions", headers=bearer("0" * 64)).status_code for _ in range(MOST_ATTEMPTS + 2)
    ]
    assert answers == [401] * MOST_ATTEMPTS + [429] * 2


def test_an_invitation_is_good_once_and_names_that_look_alike_are_one(site: Site, client: TestClient) -> None:
    invitation = people.invite(site.database)
    assert client.post("/api/v1/join", json={"invitation": invitation, "name": "Ada"}).status_code == 201
    assert client.post("/api/v1/join", json={"invitation": invitation, "name": "Eve"}).status_code == 400
    another = people.invite(site.database)
    taken = client.post("/api/v1/join", json={"invitation": another, "name": " ᴬＤA "})
    assert (taken.status_code, "is taken" in taken.text) == (400, True)
    assert client.post("/api/v1/join", json={"invitation": another, "name": "\u200b\u202e"}).status_code == 400


def test_names_and_titles_are_text_on_every_page(site: Site, client: TestClient, phase: Phase) -> None:
    identifier = score_of(site, phase, HOSTILE, 0.5)
    organiser.disqualify(site.database, score_of(site, phase, "Bob", 0.4), HOSTILE)
    assert identifier
    for path in ("/", "/phases/development", "/phases/<script>", "/enter"):
        page = client.get(path)
        assert "<script" not in page.text
        assert "default-src 'none'" in page.headers["content-security-policy"]
    assert "&lt;script&gt;" in client.get("/phases/development").text


def test_a_form_of_another_site_is_refused(site: Site, client: TestClient, packed: bytes) -> None:
    token = joined(site, client, "Ada")["authorization"].removeprefix("Bearer ")
    page = form_token(client.get("/enter").text)
    entered = client.post("/enter", data={"token": token, "form": page})
    assert entered.status_code == 303
    cookie = entered.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    own = form_token(client.get("/mine").text)
    files, fields = {"archive": ("a.zip", packed)}, {"phase": "development"}
    assert client.post("/mine", data={**fields, "form": page}, files=files).status_code == 403
    elsewhere = {"origin": "http://evil.example"}
    assert client.post("/mine", data={**fields, "form": own}, files=files, headers=elsewhere).status_code == 403
    assert client.post("/mine", data={**fields, "form": own}, files=files).status_code == 303
    assert "queued" in client.get("/mine").text
    assert client.post("/leave", data={"form": own}).status_code == 303
    client.cookies.set("benchbot_session", cookie.split("=")[1].split(";")[0])
    assert client.get("/mine").status_code == 303  # the session has ended on the server, too


def test_the_queue_is_the_organisers_to_see(site: Site, client: TestClient) -> None:
    ada = joined(site, client, "Ada")
    assert client.get("/queue").status_code == 403
    assert client.get("/queue", headers=ada).status_code == 403
    assert "joined" in client.get("/queue", headers=bearer(site.organiser_token)).text


def test_nothing_of_a_hidden_place_is_told(site: Site, client: TestClient, phase: Phase) -> None:
    hidden = replace(phase, hidden=True, batch={**phase.batch, "environments": ["secret_flat:1"]})
    site.challenge = replace(site.challenge, phases={"development": hidden})
    ada = joined(site, client, "Ada2")
    identifier = score_of(site, hidden, "Ada", 0.5)
    (site.challenge.work / identifier).mkdir(parents=True)
    (site.challenge.work / identifier / "batch.log").write_text("secret_flat:1 sofa at 1 2", "utf-8")
    told = [client.get(path, headers=ada).text for path in ("/", "/phases/development", "/mine", "/api/v1/challenge")]
    told.append(client.get("/api/v1/phases/development/leaderboard", headers=ada).text)
    assert not [text for text in told if "secret_flat" in text or "miniroom" in text]
    owner = people.renew_token(site.database, "Ada")
    log = client.get(f"/api/v1/submissions/{identifier}/log", headers=bearer(owner))
    assert (log.status_code, "sofa" in log.text) == (403, False)


def test_no_token_is_in_the_database_or_on_a_page(site: Site, client: TestClient) -> None:
    token = joined(site, client, "Ada")["authorization"].removeprefix("Bearer ")
    database = Path(str(site.database.engine.url.database))
    kept = b"".join(path.read_bytes() for path in database.parent.glob(f"{database.name}*"))
    assert token.encode() not in kept
    assert people.digest(token).encode() in kept
    assert token not in client.get("/queue", headers=bearer(site.organiser_token)).text


def test_a_submission_to_a_phase_that_is_gone_is_still_listed(site: Site, client: TestClient, packed: bytes) -> None:
    token = joined(site, client, "Ada")["authorization"].removeprefix("Bearer ")
    client.post("/enter", data={"token": token, "form": form_token(client.get("/enter").text)})
    fields = {"phase": "development", "title": "first", "form": form_token(client.get("/mine").text)}
    client.post("/mine", data=fields, files={"archive": ("a.zip", packed)})
    claim = queue.claim(site.database, "w")
    assert claim is not None
    site.challenge = replace(site.challenge, phases={})

    page = client.get("/mine")

    assert page.status_code == 200
    assert "first" in page.text
    assert "/log" not in page.text
