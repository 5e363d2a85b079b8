"""The participant's side: joining a challenge, handing in, asking what became of it."""

import base64
import http.client
import json
import os
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from benchbot.core import resources
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.text import one_line
from benchbot.plugins.challenge import intake, signing

TIMEOUT_S = 120.0
UPLOAD_TIMEOUT_S = 1800.0
"""An upload is answered once it has been checked, an image to its last byte."""
TOKEN = "BENCHBOT_CHALLENGE_TOKEN"  # noqa: S105 - the name of a variable
Document = dict[str, Any]


@dataclass(frozen=True)
class Server:
    """A challenge's server by URL, and the token to speak with it."""

    url: str
    token: str | None = None

    def ask(
        self, method: str, path: str, body: Any = None, *, file: Path | None = None, headers: Mapping[str, str] = {}
    ) -> Any:
        """Return the JSON that the server answers; raises BenchbotError for what it refuses, or when it is not there.

        A `file` is streamed; what is no file is sent as JSON.
        """
        parts = urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise BenchbotError(
                f"'{self.url}' is no address of a challenge.", "It is no URL.", "Such as: http://host:8090"
            )
        connect = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        sent = {"accept": "application/json", **headers}
        if self.token:
            sent["authorization"] = f"Bearer {self.token}"
        try:
            timeout_s = TIMEOUT_S if file is None else UPLOAD_TIMEOUT_S
            with closing(connect(parts.hostname, parts.port, timeout=timeout_s)) as connection:
                where = f"{parts.path.rstrip('/')}{path}"
                if file is None:
                    connection.request(method, where, None if body is None else json.dumps(body), sent)
                else:
                    with file.open("rb") as content:
                        sent["content-length"] = str(file.stat().st_size)
                        connection.request(method, where, content, sent)
                response = connection.getresponse()
                answer = response.read()
        except (OSError, http.client.HTTPException) as error:
            raise BenchbotError(
                f"The challenge at {self.url} cannot be reached.",
                f"{type(error).__name__}: {error}",
                "Check the address, and that its server runs.",
                exit_code=ExitCode.INTERNAL,
            ) from error
        if response.status >= 400:
            raise _refused(response.status, answer)
        return json.loads(answer) if answer else None


def known_token(url: str, token_file: Path | None) -> str:
    """Return the token of the user's team: of a file, of the environment, or kept when the team joined."""
    if token_file is not None:
        try:
            return token_file.read_text("utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise BenchbotError(f"There is no token in {token_file}.", str(error), "Name its file.") from error
    if os.environ.get(TOKEN):
        return os.environ[TOKEN]
    kept = _membership(url)
    if kept.is_file():
        return str(json.loads(kept.read_bytes())["token"])
    raise BenchbotError(
        f"It is not known which team hands in to {url}.",
        "Nobody has joined it from here, and no token was given.",
        f"Join: benchbot challenge join {url} INVITATION NAME   Or: --token-file FILE, or {TOKEN}",
    )


def join(url: str, invitation: str, name: str, key: signing.Key | None) -> Path:
    """Join a challenge as a new team, and keep its token for later commands, in the file that is returned."""
    asked = {"invitation": invitation, "name": name, **({"key": key.public} if key is not None else {})}
    answer = Server(url).ask("POST", "/api/v1/join", asked)
    path = _membership(url)
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump({"url": url, "team": answer["team"], "token": answer["token"]}, file)
    return path


def submit(
    server: Server, challenge: Document, archive: Path, phase: str, title: str, key: signing.Key | None
) -> Document:
    """Hand in an archive, signed if there is a key, and return the submission as the server has it."""
    headers = {"content-type": "application/zip"}
    if key is not None:
        sha256, image = intake.sha256_of(archive), intake.examined(archive).image
        team = server.ask("GET", "/api/v1/team")["team"]
        more = {"title": one_line(title)[:120], "nonce": os.urandom(16).hex(), "by": "team"}
        predicate = {**signing.about(challenge["name"], phase, team, image), **more}
        envelope = key.sign(signing.SUBMISSION, sha256, predicate)
        headers[signing.HEADER] = base64.b64encode(json.dumps(envelope).encode()).decode()
    path = f"/api/v1/phases/{quote(phase, safe='')}/submissions?title={quote(title)}"
    answer: Document = server.ask("POST", path, file=archive, headers=headers)
    return answer


def _membership(url: str) -> Path:
    parts = urlsplit(url)
    name = "".join(letter if letter.isalnum() else "-" for letter in f"{parts.netloc}{parts.path.rstrip('/')}")
    return resources.data_dir() / "challenges" / f"{name}.json"


def _refused(status: int, answer: bytes) -> BenchbotError:
    code = ExitCode.INTERNAL if status >= 500 else ExitCode.USAGE
    try:
        said = json.loads(answer)
        return BenchbotError(str(said["title"]), str(said["why"]), str(said["fix"]), exit_code=code)
    except (ValueError, KeyError, TypeError):
        return BenchbotError(
            "The challenge refused it.",
            f"It answered with status {status}.",
            "Try it again in a moment." if status >= 500 else "Check its address; it is no challenge's.",
            exit_code=code,
        )
