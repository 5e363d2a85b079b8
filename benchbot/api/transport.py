"""HTTP/1.1 to a supervisor on loopback or a unix socket, over one connection that is kept open."""

import http.client
import socket
from urllib.parse import urlsplit

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

CONNECT_TIMEOUT_S = 10.0


class Transport:
    """One connection, opened at the first request. A request is never sent twice: an action must not happen twice."""

    def __init__(self, url: str | None, socket_path: str | None, answer_timeout_s: float | None = None) -> None:
        self._where = socket_path or url or ""
        self._answer_timeout_s = answer_timeout_s
        if socket_path is not None:
            self._connection: http.client.HTTPConnection = _UnixConnection(socket_path)
        else:
            self._connection = _tcp_connection(self._where)

    def request(self, method: str, path: str, body: bytes, headers: dict[str, str]) -> tuple[int, str, bytearray]:
        """Return status, content type and body of the answer; raises BenchbotError when the supervisor is gone."""
        try:
            self._connect()
            self._connection.request(method, path, body or None, headers)
            response = self._connection.getresponse()
            content = _content(response)
        except (OSError, http.client.HTTPException) as error:
            self.close()
            raise self._gone(error) from error
        except BaseException:
            # Interrupted between question and answer: the next answer on this connection would be the wrong one.
            self.close()
            raise
        return response.status, response.headers.get_content_type(), content

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        self._connection.close()

    def _connect(self) -> None:
        connection = self._connection
        if connection.sock is None:
            connection.timeout = CONNECT_TIMEOUT_S
            connection.connect()
        if connection.sock is not None:
            # Usually none: an action may take as long as it takes, and the supervisor itself ends what hangs.
            connection.sock.settimeout(self._answer_timeout_s)

    def _gone(self, error: Exception) -> BenchbotError:
        return BenchbotError(
            "The BenchBot supervisor is gone.",
            f"The connection to {self._where} failed: {error or type(error).__name__}.",
            "Look at the terminal of 'benchbot run' for what happened, start it again, and run the solution again.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )


class _UnixConnection(http.client.HTTPConnection):
    """HTTP over a unix socket."""

    def __init__(self, path: str) -> None:
        super().__init__("localhost")
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self._path)


def _tcp_connection(url: str) -> http.client.HTTPConnection:
    parts = urlsplit(url if "//" in url else f"//{url}")
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None or parts.scheme not in ("", "http"):
        raise BenchbotError(
            f"'{url}' is not the address of a supervisor.",
            "An address is written like this: http://127.0.0.1:10000",
            "Mend BENCHBOT_URL or the argument supervisor_address.",
        )
    return http.client.HTTPConnection(host, port or 10000)


def _content(response: http.client.HTTPResponse) -> bytearray:
    """Return the body, read straight into the memory that the arrays will be views of."""
    if response.length is None:
        return bytearray(response.read())
    content = bytearray(response.length)
    view = memoryview(content)
    while view:
        count = response.readinto(view)
        if count == 0:
            raise http.client.IncompleteRead(b"", len(view))
        view = view[count:]
    response.read()
    return content
