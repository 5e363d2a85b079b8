"""The app as the child of a web server: it ends when its server does, however that ended."""

import os
import threading
import time
from contextlib import suppress

SERVER = "BENCHBOT_TUI_SERVER"
"""The process number of the server, in the environment of its children."""
PERIOD_S = 0.5


def die_with_server() -> None:
    """End this process soon after its server has ended; do nothing where there is none."""
    # What the app starts is nobody's child: it must not end with the server.
    server = os.environ.pop(SERVER, "")
    if server:
        threading.Thread(target=_watch, args=(int(server),), daemon=True, name="benchbot-server").start()


def _watch(server: int) -> None:
    with suppress(KeyboardInterrupt):
        while os.getppid() == server:
            time.sleep(PERIOD_S)
    # Nobody is there any more to draw for, and what was drawn last is of no use: nothing needs tidying up.
    os._exit(0)
