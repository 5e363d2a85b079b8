"""The server: who may ask, for what, and how names of strangers come out."""

from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest

from benchbot_view.rows import id_of
from plugins.view.tests.conftest import HOSTILE


@pytest.fixture
def client(address: str) -> httpx.Client:
    client = httpx.Client(base_url=address.partition("/?")[0], follow_redirects=True, timeout=60)
    client.get("/", params={"token": address.partition("token=")[2]})
    return client


def test_nobody_comes_in_without_the_token(address: str) -> None:
    base = address.partition("/?")[0]
    for path in ("/", "/data/rows", "/static/overview.js", "/?token=guessed"):
        assert httpx.get(base + path).status_code == 403
    answer = httpx.get(address)
    assert answer.status_code == 303
    assert "HttpOnly" in answer.headers["set-cookie"]
    assert "samesite=strict" in answer.headers["set-cookie"].lower()


def test_another_name_for_this_machine_gets_nothing(client: httpx.Client) -> None:
    """A page of another site may have its own name lead here (DNS rebinding)."""
    assert client.get("/data/rows").status_code == 200
    assert client.get("/data/rows", headers={"host": "evil.example:80"}).status_code == 400
    assert client.get("/data/rows", headers={"sec-fetch-site": "cross-site"}).status_code == 403
    assert client.post("/data/rows").status_code == 405


def test_no_address_leads_out_of_the_recordings(client: httpx.Client, results: Path) -> None:
    id_ = id_of(results / "good" / "result.json")
    client.get("/data/rows")
    assert client.get(f"/picture/{id_}/frame/00000.jpg").headers["content-type"] == "image/jpeg"
    port = urlsplit(str(client.base_url)).port
    for path in (
        f"/picture/{id_}/frame/..%2f..%2fresult.json",
        f"/picture/{id_}/frame/99999.jpg",
        f"/picture/{id_}/..%2f/00000.jpg",
        "/static/..%2fserver.py",
        "/static/%2e%2e/server.py",
        "/episode/..%2f..%2fetc.html",
        "/episode/000000000000.html",
    ):
        assert client.get(f"http://127.0.0.1:{port}{path}").status_code == 404, path


def test_names_of_strangers_are_text(client: httpx.Client, results: Path) -> None:
    client.get("/data/rows")
    page = client.get(f"/episode/{id_of(results / 'failed' / 'result.json')}.html")

    assert page.status_code == 200
    assert "<img" not in page.text
    assert HOSTILE[-1] not in page.text
    policy = page.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'self'" in policy


def test_rows_come_by_pages_and_then_as_they_change(client: httpx.Client) -> None:
    first = client.get("/data/rows").json()
    assert first["total"] == 3
    # A row's score may come at any time; its place is for good.
    page = client.get("/data/rows", params={"start": 2}).json()
    assert [row[0] for row in page["rows"]] == [row[0] for row in first["rows"][2:]]
    now = client.get("/data/rows", params={"since": first["revision"]}).json()
    assert all(row[-1] > first["revision"] for row in now["rows"])
    assert client.get("/data/rows", params={"since": "x" * 30}).status_code == 200
