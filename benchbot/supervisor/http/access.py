"""Access to routes: for the solution with its token, the run's host with another one, or this whole machine."""

import hmac
import ipaddress
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.requests import Request
from starlette.responses import Response

from benchbot.supervisor import RefusedError

Endpoint = Callable[[Request], Awaitable[Response]]

NOT_THE_OPERATOR = (
    "Only the operator can say that this is done.",
    "The token is the solution's: a program does not know what a person beside the robot has done.",
    "Have the person type: benchbot ready",
)
NOT_THE_HOST = (
    "Only the host of the run may look on.",
    "The token is the solution's, and what is shown here is not for solutions.",
    "Take the operator's token from the run's state file, or type: benchbot tui",
)


@dataclass(frozen=True)
class Access:
    """The access rules of one run, as decorators of endpoints; they raise RefusedError (401 or 403).

    With `without_token`, routes for clients that know no token are open to every program of this machine.
    """

    token: str
    operator_token: str
    without_token: bool = False

    def solution(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the solution's token."""
        return _checked(endpoint, self.check_solution)

    def tokenless(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in as `solution`, or where the run allows it all that are addressed to this machine."""
        return _checked(endpoint, check_local_name if self.without_token else self.check_solution)

    def host(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the operator's token, which the run's host reads from the state file."""
        return _checked(endpoint, lambda request: self._check_operator(request, NOT_THE_HOST))

    def operator(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the operator's token, to confirm what a person was asked to do."""
        return _checked(endpoint, lambda request: self._check_operator(request, NOT_THE_OPERATOR))

    def is_operator(self, request: Request) -> bool:
        """Say whether a request has the operator's token."""
        return _has_token(request, self.operator_token)

    def check_solution(self, request: Request) -> None:
        """Raise RefusedError (401) for a request without the solution's token."""
        if not _has_token(request, self.token):
            raise RefusedError(
                401,
                "The supervisor does not know you.",
                "The request has no bearer token, or not the one of this run.",
                "Send the run's token: Authorization: Bearer $BENCHBOT_TOKEN",
            )

    def _check_operator(self, request: Request, refused: tuple[str, str, str]) -> None:
        if not self.is_operator(request):
            self.check_solution(request)
            raise RefusedError(403, *refused)


def check_local_name(request: Request) -> None:
    """Raise RefusedError (403) for a request that a web page may have sent through the user's browser.

    Without a token, a page could make its own domain name mean this machine (DNS rebinding) and then read and command
    the robot. Such a name has a dot in it, unlike `localhost` and v2's `benchbot_supervisor`.
    """
    try:
        name = urlsplit(f"//{request.headers.get('host', '')}").hostname or ""
    except ValueError:
        name = "?."
    if "." in name or ":" in name:
        try:
            local = ipaddress.ip_address(name).is_loopback
        except ValueError:
            local = False
        if not local:
            raise RefusedError(
                403,
                "The supervisor does not answer to that name.",
                "This run takes requests without a token, and so only those that are addressed to this machine.",
                "Use http://127.0.0.1 or http://localhost, with the run's port.",
            )


def _checked(endpoint: Endpoint, check: Callable[[Request], None]) -> Endpoint:
    async def checked(request: Request) -> Response:
        check(request)
        return await endpoint(request)

    return checked


def _has_token(request: Request, token: str) -> bool:
    given = request.headers.get("authorization", "")
    # Compared as bytes: compare_digest takes no text beyond ASCII.
    return hmac.compare_digest(given.encode("utf-8", "replace"), f"Bearer {token}".encode())
