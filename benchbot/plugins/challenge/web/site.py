"""What all requests share: the challenge, its database and key, its leaderboards, and how often whom may ask."""

import hashlib
import hmac
import secrets
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlalchemy import Row
from starlette.requests import Request

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.plugins.challenge import history, leaderboard, people
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import Challenge, Phase
from benchbot.plugins.challenge.history import Step
from benchbot.plugins.challenge.leaderboard import Board, Memory
from benchbot.plugins.challenge.signing import Key

COOKIE = "benchbot_session"
MOST_ATTEMPTS, ATTEMPTS_S = 10, 60.0
"""So many wrong tokens and invitations may come from one address in so many seconds."""
_MOST_ADDRESSES = 10_000


class HttpError(Exception):
    """A request that is refused, with its status; the error is told to whoever sent it."""

    def __init__(self, status: int, error: BenchbotError) -> None:
        super().__init__(error.title)
        self.status = status
        self.error = error


@dataclass(frozen=True)
class Caller:
    """Who asks: a team, the organiser, or the public; and the token of the session in a browser, if it is one."""

    team: Row[Any] | None = None
    is_organiser: bool = False
    session: str | None = None

    @property
    def form_token(self) -> str:
        """What a form of this session has to send back: no other site can know it."""
        return hmac.new((self.session or "").encode(), b"form", hashlib.sha256).hexdigest()


@dataclass
class Site:
    """A challenge as it is served."""

    challenge: Challenge
    database: Database
    key: Key
    evaluators: Mapping[str, Evaluator]
    organiser_token: str = field(repr=False)
    secure: bool = False
    """Whether people reach it by https, so that cookies may be sent by that alone."""

    def __post_init__(self) -> None:
        self._made: dict[tuple[str, str], tuple[object, Any]] = {}
        self._memories = {name: Memory() for name in self.challenge.phases}
        self._locks = {name: threading.Lock() for name in self.challenge.phases}
        self._attempts: OrderedDict[str, list[float]] = OrderedDict()
        self._uploads: dict[int, int] = {}
        self._guard = threading.Lock()

    def board(self, phase: str) -> Board:
        """Return the leaderboard of a phase; while another thread works a newer one out, the one of before."""
        chosen = self.challenge.phases[phase]

        def work_out() -> Board:
            evaluator, memory = self.evaluators[chosen.method], self._memories[phase]
            return leaderboard.of(self.database, self.challenge, chosen, evaluator, memory)

        board: Board = self._newest(phase, "board", self._version(chosen), work_out)
        return board

    def history(self, phase: str) -> tuple[Step, ...]:
        """Return how the leaderboard of a phase came about."""
        chosen = self.challenge.phases[phase]
        evaluator = self.evaluators[chosen.method]
        made: tuple[Step, ...] = self._newest(
            phase, "history", self._version(chosen), lambda: history.steps(self.database, chosen, evaluator)
        )
        return made

    def _version(self, phase: Phase) -> tuple[int, float]:
        return self.database.changes(), phase.told_until(self.database.clock()) if phase.told_every_s else 0.0

    def picture(self, phase: str, name: str) -> Path:
        """Return a picture of a phase's leaderboard; raises HttpError (404) for any that is not on it now."""
        path = self.challenge.pictures / name
        if name in {item["file"] for row in self.board(phase).standings for item in row.pictures} and path.is_file():
            return path
        raise HttpError(
            404, BenchbotError("There is no such picture.", "The leaderboard has none of it.", "Load the page again.")
        )

    def rendered(self, board: Board, form: str, render: Callable[[Board], bytes]) -> bytes:
        """Return a leaderboard in a form, which is made once; while another thread makes it, the one of before."""
        content: bytes = self._newest(board.phase, form, id(board), lambda: (board, render(board)))[1]
        return content

    def _newest(self, phase: str, what: str, version: object, make: Callable[[], Any]) -> Any:
        known = self._made.get((phase, what))
        if known is not None and known[0] == version:
            return known[1]
        lock = self._locks[phase]
        if not lock.acquire(blocking=known is None):
            return known[1]  # type: ignore[index]  # a lock that is waited for is had
        try:
            known = self._made.get((phase, what))
            if known is None or known[0] != version:
                known = self._made[phase, what] = (version, make())
            return known[1]
        finally:
            lock.release()

    def caller(self, request: Request) -> Caller:
        """Return who asks, by bearer token or session; raises HttpError (401, 429) for a token that nobody has."""
        scheme, _, token = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            found = self.known(token.strip())
            if found is None:
                self.count_attempt(request)
                raise HttpError(401, _UNKNOWN)
            return found
        session = request.cookies.get(COOKIE, "")
        row = people.session(self.database, session) if session else None
        if row is None:
            return Caller()
        team = None if row.team is None else people.team(self.database, row.team)
        return Caller(team, row.team is None, session)

    def known(self, token: str) -> Caller | None:
        """Return whose token this is, None for nobody's."""
        if hmac.compare_digest(people.digest(token), people.digest(self.organiser_token)):
            return Caller(is_organiser=True)
        team = people.team_of(self.database, token)
        return None if team is None else Caller(team)

    def count_attempt(self, request: Request) -> None:
        """Count a wrong token or invitation; raises HttpError (429) for too many of one address."""
        address = request.client.host if request.client else ""
        now = time.monotonic()
        with self._guard:
            times = [moment for moment in self._attempts.pop(address, []) if now - moment < ATTEMPTS_S]
            self._attempts[address] = [*times, now]
            while len(self._attempts) > _MOST_ADDRESSES:
                self._attempts.popitem(last=False)
        if len(times) >= MOST_ATTEMPTS:
            raise HttpError(
                429,
                BenchbotError(
                    "There were too many wrong tokens.",
                    f"{MOST_ATTEMPTS} came from {address} within a minute.",
                    "Wait a minute.",
                ),
            )

    def begin_upload(self, team: int) -> None:
        """Count an upload of a team that begins; raises HttpError (429) while as many are under way as may be."""
        with self._guard:
            if self._uploads.get(team, 0) >= self.challenge.uploads_at_once:
                raise HttpError(
                    429,
                    BenchbotError(
                        "There are too many uploads at once.",
                        f"{self.challenge.uploads_at_once} of your team are under way.",
                        "Wait until one is done.",
                    ),
                )
            self._uploads[team] = self._uploads.get(team, 0) + 1

    def end_upload(self, team: int) -> None:
        """Count an upload of a team that has ended."""
        with self._guard:
            self._uploads[team] -= 1


def require_team(caller: Caller) -> Row[Any]:
    """Return the team that asks; raises HttpError (401) when none does."""
    if caller.team is None:
        raise HttpError(401, _UNKNOWN)
    return caller.team


def require_form(caller: Caller, request: Request, token: object) -> None:
    """Raise HttpError (403) for a form that another site has sent (CSRF)."""
    origin = request.headers.get("origin")
    own = origin is None or origin.split("://", 1)[-1] == request.headers.get("host")
    if not own or not isinstance(token, str) or not hmac.compare_digest(token, caller.form_token):
        raise HttpError(
            403, BenchbotError("This form is not of this site.", "Its token is another one.", "Load the page again.")
        )


def new_identifier() -> str:
    """Return the identifier of a new submission: it tells nothing, and cannot be guessed."""
    return secrets.token_hex(8)


_UNKNOWN = BenchbotError(
    "The challenge does not know you.",
    "The token is missing, or nobody's.",
    "Use your team's token; ask for a new one.",
)
