"""Uploads that end half way, and what nobody learns from the time that something takes."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from sqlalchemy import event
from starlette.testclient import TestClient

from benchbot.plugins.challenge import intake, people, queue, submissions
from benchbot.plugins.challenge.document import QUEUED, SCORED, Phase
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import Site
from tests.command_line import CommandLine
from tests.plugins.challenge.conftest import received, score_of, scores_document
from tests.plugins.challenge.test_command import declare, served

SUBMIT = "/api/v1/phases/development/submissions"


@pytest.fixture
def client(site: Site) -> Iterator[TestClient]:
    with TestClient(create_app(site), follow_redirects=False) as opened:
        yield opened


def files(folder: Path) -> list[Path]:
    return [path for path in (folder / "uploads").rglob("*") if path.is_file()]


def until(reached: Any) -> None:
    deadline_s = time.monotonic() + 60
    while not reached():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)


@contextmanager
def half_sent(url: str, token: str, content: bytes) -> Iterator[socket.socket]:
    """An upload of which the first half has been sent."""
    where = urlsplit(url)
    with socket.create_connection((str(where.hostname), where.port or 80)) as connection:
        head = [
            f"POST {SUBMIT} HTTP/1.1",
            "Host: x",
            f"Authorization: Bearer {token}",
            f"Content-Length: {len(content)}",
        ]
        connection.sendall("\r\n".join([*head, "", ""]).encode() + content[: len(content) // 2])
        yield connection


def test_what_is_left_of_an_upload_that_ended_half_way_is_swept(cli: CommandLine, tmp_path: Path) -> None:
    declare(cli)
    (tmp_path / "solution").mkdir()
    (tmp_path / "solution" / "solution.py").write_text("print('hello')\n" * 10_000, "utf-8")
    intake.pack(tmp_path / "solution", "python solution.py", tmp_path / "packed.zip")
    content, folder = (tmp_path / "packed.zip").read_bytes(), cli.folder / "demo"
    first, url = served(cli, "--workers", "0")
    (invitation,) = cli("challenge", "invite", "demo").stdout.split()
    asked = {"invitation": invitation, "name": "Ada"}
    token = httpx.post(f"{url}/api/v1/join", json=asked).json()["token"]

    # The client goes: nothing stays, and it may begin anew.
    with half_sent(url, token, content):
        until(lambda: files(folder))
    until(lambda: not files(folder))

    # A server is killed: the next one to start removes what it left, and not what another is receiving.
    with half_sent(url, token, content):
        until(lambda: files(folder))
        first.kill()
        first.wait()
    (left,) = files(folder)
    second, url = served(cli, "--workers", "0")
    assert not left.exists()
    with half_sent(url, token, content) as connection:
        until(lambda: files(folder))
        served(cli, "--workers", "0")
        connection.sendall(content[len(content) // 2 :])
        assert connection.recv(100).startswith(b"HTTP/1.1 201")
    (kept,) = files(folder)
    assert kept.read_bytes() == content
    assert second.poll() is None


@contextmanager
def statements(site: Site) -> Iterator[list[tuple[str, Any]]]:
    """The statements that the database is given meanwhile, with their values."""
    seen: list[tuple[str, Any]] = []

    def note(_connection: Any, _cursor: Any, statement: str, values: Any, *_: Any) -> None:
        seen.append((statement, values))

    event.listen(site.database.engine, "before_cursor_execute", note)
    yield seen
    event.remove(site.database.engine, "before_cursor_execute", note)


def test_a_token_is_compared_by_its_digest_alone(site: Site, client: TestClient) -> None:
    """How long a comparison takes then tells of a digest, from which nobody gets nearer to the token."""
    invitation = people.invite(site.database)
    token = client.post("/api/v1/join", json={"invitation": invitation, "name": "Ada"}).json()["token"]
    asked = []
    for guess in (token, f"{token[:-1]}{'0' if token[-1] != '0' else '1'}", "0" * 64):
        with statements(site) as seen:
            answer = client.get("/api/v1/team", headers={"authorization": f"Bearer {guess}"})
        assert answer.status_code == (200 if guess == token else 401)
        assert guess not in str(seen)
        asked.append([statement for statement, _ in seen])
    assert asked[1] == asked[2]  # one that is nearly right is refused as any other


def test_a_submission_of_another_team_is_refused_like_one_that_is_not_there(
    site: Site, client: TestClient, phase: Phase
) -> None:
    identifier = score_of(site, phase, "Ada", 0.5)
    bob = {"authorization": f"Bearer {people.renew_token(site.database, _joined(site, 'Bob'))}"}
    answers = []
    for name in (identifier, "0" * 16):
        with statements(site) as seen:
            gets = [client.get(f"/api/v1/submissions/{name}{part}", headers=bob) for part in ("", "/log")]
            gets.append(client.delete(f"/api/v1/submissions/{name}", headers=bob))
        told = [(answer.status_code, answer.text.replace(name, "ID")) for answer in gets]
        answers.append((told, [statement for statement, _ in seen]))
    assert answers[0] == answers[1]


def _joined(site: Site, name: str) -> str:
    people.join(site.database, site.challenge, people.invite(site.database), name)
    return name


def test_when_a_run_in_a_hidden_place_began_and_ended_is_not_told(
    site: Site, client: TestClient, phase: Phase, monkeypatch: pytest.MonkeyPatch
) -> None:
    hidden = replace(phase, hidden=True, told_every_s=600)
    site.challenge = replace(site.challenge, phases={"development": hidden})
    now = [600.0 * 3_000_000 + 1]
    site.database.clock = lambda: now[0]
    token = people.renew_token(site.database, _joined(site, "Ada"))
    team = people.team_of(site.database, token)
    assert team is not None
    ada = {"authorization": f"Bearer {token}"}
    made = submissions.accept(site.database, hidden, team, received())

    def told() -> tuple[Any, ...]:
        one = client.get(f"/api/v1/submissions/{made['id']}", headers=ada).json()
        board = client.get("/api/v1/phases/development/leaderboard").json()["standings"]
        refused = client.delete(f"/api/v1/submissions/{made['id']}", headers=ada).json()["why"] if begun else ""
        return one["state"], one["score"], one["ended_at"], len(board), refused

    begun = False
    waits = told()
    assert waits[:4] == (QUEUED, None, None, 0)
    claim = queue.claim(site.database, "w")
    assert claim is not None
    begun = True
    runs = told()
    now[0] += 100
    assert queue.finish(site.database, claim, 0.5, scores_document({"place1:1": 0.5}), {})
    now[0] += 400
    assert told() == runs
    assert runs[:4] == waits[:4]
    now[0] += 100  # past a full multiple
    assert told()[:4] == (SCORED, 0.5, 600.0 * 3_000_001, 1)
