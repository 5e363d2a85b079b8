"""Access to routes: for the solution with its token, the run's host with another one, or this whole machine."""

import hmac
import ipaddress
import socket
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from urllib.parse import urlsplit

from starlette.requests import Request
from starlette.responses import Response

from benchbot.supervisor import RefusedError
from benchbot.wire.joining import Lease, lease_of, taken

Endpoint = Callable[[Request], Awaitable[Response]]

MOST_REQUESTS = 128
"""The number of requests that may be under way at once, event streams included; the operator's are not counted."""
OPERATOR = "operator"
"""What a request with the operator's token has in its state: the server does not close its connection for others."""
SOLUTION = "solution"
"""What a request that may act has in its state: the token of its solution."""
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

    With `without_token`, routes for clients that know no token are open to every program of this machine. In a run that
    solutions may join, `folder` is where one of them may have leased the robot: then only that one acts.
    """

    token: str
    operator_token: str
    without_token: bool = False
    folder: Path | None = None

    def solution(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the solution's token."""
        return _checked(endpoint, self.check_solution)

    def acting(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in as `solution`, but while a solution has leased the robot (409) those of that one only."""
        return _checked(endpoint, self.check_acting)

    def watched(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in as `solution`, and the operator's, who has submitted one."""
        return self._or_operators(endpoint, self.check_solution)

    def ending(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in as `acting`, and the operator's, who hands in what a solution has left."""
        return self._or_operators(endpoint, self.check_acting)

    def tokenless(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in as `solution`, or where the run allows it all that are addressed to this machine."""
        return _checked(endpoint, check_local_name if self.without_token else self.check_acting)

    def host(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the operator's token, which the run's host reads from the state file."""
        return _checked(endpoint, lambda request: self._check_operator(request, NOT_THE_HOST))

    def operator(self, endpoint: Endpoint) -> Endpoint:
        """Let requests in that have the operator's token, to confirm what a person was asked to do."""
        return _checked(endpoint, lambda request: self._check_operator(request, NOT_THE_OPERATOR))

    def is_operator(self, request: Request) -> bool:
        """Say whether a request has the operator's token."""
        return _has_token(request, self.operator_token)

    def leased_to(self) -> str | None:
        """Return the token of the solution that has leased the robot, if one has, and has said so to the end."""
        lease = self._lease()
        return lease.token if lease is not None and lease.pid else None

    def check_solution(self, request: Request) -> Lease | None:
        """Return the lease of the robot, if a solution has it.

        Raises RefusedError (401) for a request without the token of the run or of that solution.
        """
        lease = self._lease()
        if not _has_token(request, self.token) and (lease is None or not _has_token(request, lease.token)):
            raise RefusedError(
                401,
                "The supervisor does not know you.",
                "The request has no bearer token, or not the one of this run.",
                "Send the run's token: Authorization: Bearer $BENCHBOT_TOKEN",
            )
        return lease

    def check_acting(self, request: Request) -> None:
        """Raise RefusedError as `check_solution`, or 409 while another solution has leased the robot."""
        lease = self.check_solution(request)
        if lease is not None and not _has_token(request, lease.token):
            error = taken(lease)
            raise RefusedError(409, error.title, error.why, error.fix)
        # Of the token itself: the header may have it in many forms.
        setattr(request.state, SOLUTION, self.token if lease is None else lease.token)

    def _lease(self) -> Lease | None:
        return None if self.folder is None else lease_of(self.folder)

    def _or_operators(self, endpoint: Endpoint, check: Callable[[Request], object]) -> Endpoint:
        return _checked(endpoint, lambda request: None if self.is_operator(request) else check(request))

    def _check_operator(self, request: Request, refused: tuple[str, str, str]) -> None:
        if not self.is_operator(request):
            self.check_solution(request)
            raise RefusedError(403, *refused)


def check_local_name(request: Request) -> None:
    """Raise RefusedError (403) for a request that is not addressed to this machine by a name that only it has."""
    name = _host_name(request.headers.get("host", ""))
    address = _address(name)
    if ("." in name or ":" in name) and not (address and address.is_loopback):
        raise RefusedError(
            403,
            "The supervisor does not answer to that name.",
            "This run takes requests without a token, and so only those that are addressed to this machine.",
            "Use http://127.0.0.1 or http://localhost, with the run's port.",
        )


def check_head(headers: Mapping[str, str]) -> None:
    """Raise RefusedError (400, 403) for a request that something between the client and here may read in another way.

    Its length must be clear (RFC 9112, 6.1), and it must be addressed to this machine: a web page could make its own
    domain name mean it (DNS rebinding), and then talk to it through the user's browser. Such a name has a dot in it,
    unlike `localhost` and v2's `benchbot_supervisor`, and is neither an address nor this machine's own name.
    """
    if "content-length" in headers and "transfer-encoding" in headers:
        raise RefusedError(
            400,
            "It is not clear where the request ends.",
            "It has both Content-Length and Transfer-Encoding.",
            "Send one of them.",
        )
    name = _host_name(headers.get("host", ""))
    if "." in name and _address(name) is None and name not in _own_names():
        raise RefusedError(
            403,
            "The supervisor does not answer to that name.",
            f"'{name}' is no address, and not what this machine calls itself.",
            "Use the machine's IP address, with the run's port.",
        )


def check_share(under_way: int) -> None:
    """Raise RefusedError (429) for a request that comes while as many are under way as may be."""
    if under_way >= MOST_REQUESTS:
        raise RefusedError(
            429,
            "There are too many requests at once.",
            f"{MOST_REQUESTS} are under way, event streams included.",
            "Wait for their answers, and close streams of events that you do not read.",
        )


def _host_name(host: str) -> str:
    """Return the name in a Host header, in lower case and without a port; "?." when there is none to read."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return "?."


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


@cache
def _own_names() -> frozenset[str]:
    name = socket.gethostname().lower()
    return frozenset({name, f"{name}.local", socket.getfqdn().lower()})


def _checked(endpoint: Endpoint, check: Callable[[Request], object]) -> Endpoint:
    async def checked(request: Request) -> Response:
        check(request)
        return await endpoint(request)

    return checked


def _has_token(request: Request, token: str) -> bool:
    scheme, _, given = request.headers.get("authorization", "").partition(" ")
    # Compared as bytes: compare_digest takes no text beyond ASCII.
    return scheme.lower() == "bearer" and hmac.compare_digest(given.strip().encode("utf-8", "replace"), token.encode())
