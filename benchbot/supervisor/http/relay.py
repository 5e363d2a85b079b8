"""An application that stands for one run after another, on one address."""

from starlette.types import Receive, Scope, Send

from benchbot.supervisor.http.express import Express
from benchbot.supervisor.http.server import Served


class Relay:
    """Hands every request to the application of the run that there is just then."""

    def __init__(self, app: Served) -> None:
        self.app = app

    def express(self, data: bytes) -> Express | None:
        """Return the request that the bytes of a connection are, or None when it is for the application."""
        return self.app.express(data)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, as ASGI has it."""
        await self.app(scope, receive, send)
