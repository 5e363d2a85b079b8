"""Challenges in databases of both kinds: SQLite in a file, and a PostgreSQL server of the tests' own."""

import base64
import hashlib
import io
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from sqlalchemy import Row

from benchbot.core import plugin_manager
from benchbot.plugins.challenge import people, queue, signing, starting, submissions
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import Challenge, Phase
from benchbot.plugins.challenge.web.site import Site


def _tool(name: str) -> str:
    places = [*sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True), Path("/usr/local/bin")]
    return next(str(place / name) for place in places if (place / name).exists())


class PostgreSQL:
    """A PostgreSQL server on a socket in a folder, without what a crash of the machine would need."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="pg"))
        self._quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": "/"}
        # PostgreSQL refuses to run as root.
        if os.geteuid() == 0:
            entry = pwd.getpwnam("postgres")
            shutil.chown(self.folder, entry.pw_uid, entry.pw_gid)
            self._quiet |= {"user": entry.pw_uid, "group": entry.pw_gid, "extra_groups": []}
        initdb = [_tool("initdb"), "-D", str(self.folder / "data"), "-A", "trust", "-N", "-U", "challenge"]
        subprocess.run(initdb, check=True, **self._quiet)
        self.start()

    def start(self) -> None:
        """Start the server; after a kill, once the processes of the one before are gone."""
        words = [
            _tool("postgres"),
            "-D",
            str(self.folder / "data"),
            "-k",
            str(self.folder),
            "-c",
            "listen_addresses=",
            "-F",
        ]
        ready = [_tool("pg_isready"), "-q", "-h", str(self.folder), "-U", "challenge", "-t", "1"]
        deadline_s = time.monotonic() + 60
        self.process = subprocess.Popen(words, **self._quiet)
        while subprocess.run(ready, check=False).returncode:
            assert time.monotonic() < deadline_s
            if self.process.poll() is not None:
                time.sleep(0.2)
                self.process = subprocess.Popen(words, **self._quiet)

    def kill(self) -> None:
        """Kill the server as a crash would."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)  # SIGTERM would wait for the last client
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def new_database(self) -> str:
        """Return the URL of a new, empty database."""
        import psycopg

        name = f"db{uuid.uuid4().hex}"
        with psycopg.connect(f"host={self.folder} user=challenge dbname=postgres", autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return f"postgresql+psycopg://challenge@/{name}?host={self.folder}"


@pytest.fixture(scope="session")
def postgresql() -> Iterator[PostgreSQL]:
    """A PostgreSQL server that tests share."""
    server = PostgreSQL()
    yield server
    server.stop()


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of an empty database, of each kind."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'challenge.db'}"
    server: PostgreSQL = request.getfixturevalue("postgresql")
    return server.new_database()


SHA = "ab" * 32


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_s = 1_800_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def database(database_url: str, clock: Clock) -> Iterator[Database]:
    opened = Database(database_url, clock)
    yield opened
    opened.engine.dispose()


@pytest.fixture
def challenge(tmp_path: Path) -> Challenge:
    """A challenge as `benchbot challenge init` makes it."""
    return starting.make(tmp_path / "rooms", "Rooms")


@pytest.fixture
def phase(challenge: Challenge) -> Phase:
    return challenge.phases["development"]


def join(database: Database, challenge: Challenge, name: str) -> Row[Any]:
    """Return a new team."""
    team = people.team_of(database, people.join(database, challenge, people.invite(database), name))
    assert team is not None
    return team


def received(**more: Any) -> dict[str, Any]:
    """Return what is known of an upload that has been checked."""
    random, envelope = uuid.uuid4().hex, {"payload": base64.b64encode(b'{"predicate": {}}').decode()}
    known = {"id": random[:16], "title": "", "mode": "sandbox", "sha256": random * 2, "size_bytes": 1}
    known |= {"envelope": envelope}
    return {**known, "statement": random * 2, **more}


@pytest.fixture
def site(tmp_path: Path, challenge: Challenge) -> Iterator[Site]:
    database = Database(f"sqlite:///{tmp_path / 'one.db'}")
    evaluators = {"omq": plugin_manager.load().record("evaluators", "omq")}
    yield Site(challenge, database, signing.load(challenge.folder / "challenge.key"), evaluators, "operator")
    database.engine.dispose()


def score_of(
    site: Site,
    phase: Phase,
    name: str,
    value: float,
    key: signing.Key | None = None,
    pictures: Sequence[dict[str, Any]] = (),
) -> str:
    """Hand in a submission of a new team, score it, and return its identifier."""
    invitation = people.invite(site.database)
    public = None if key is None else key.public
    team = people.team_of(site.database, people.join(site.database, site.challenge, invitation, name, public))
    assert team is not None
    about = {"challenge": site.challenge.name, "phase": phase.name, "team": team.name, "nonce": name}
    envelope = (key or site.key).sign(signing.SUBMISSION, SHA, about)
    made = received(sha256=SHA, envelope=envelope, statement=signing.digest(envelope))
    submissions.accept(site.database, phase, team, made)
    claim = queue.claim(site.database, "w")
    assert claim is not None
    stated = {**about, "submission": made["id"], "statement": made["statement"], "score": value, "commitments": {}}
    stated["pictures"] = [item["file"] for item in pictures]
    signed = site.key.sign(signing.SCORE, SHA, stated)
    document = scores_document({"miniroom:1": value}) | {"pictures": list(pictures)}
    assert queue.finish(site.database, claim, value, document, signed)
    return str(made["id"])


def kept(challenge: Challenge, environment: str = "miniroom:1") -> dict[str, Any]:
    """Keep a picture as a worker does, and return what is known of it."""
    content = io.BytesIO()
    Image.new("RGB", (30, 20), (len(environment), 90, 160)).save(content, "PNG")
    name = f"{hashlib.sha256(content.getvalue()).hexdigest()}.png"
    challenge.pictures.mkdir(exist_ok=True)
    (challenge.pictures / name).write_bytes(content.getvalue())
    return {"file": name, "kind": "map", "environment": environment, "width": 30, "height": 20}


def scores_document(by_environment: dict[str, float]) -> dict[str, Any]:
    rows = [{"environment": name, "seed": 0, "scores": {"OMQ": value}} for name, value in by_environment.items()]
    coverage = {"expected": len(rows), "scored": len(rows), "missing": [], "skipped": []}
    return {"scores": {}, "intervals": {}, "rows": rows, "coverage": coverage}
