"""The screens in a browser: real requests to a real server, and its end."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import aiohttp
import pytest

PATIENCE_S = 120.0
COMMAND = [sys.executable, "-P", "-m", "benchbot", "tui", "--web"]


def children_of(process: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True, check=False)
    return [int(word) for word in found.stdout.split()]


def is_alive(process: int) -> bool:
    with suppress(OSError):
        return b"State:\tZ" not in Path(f"/proc/{process}/status").read_bytes()
    return False


async def refused(base: str) -> None:
    """Try the door without the token, or with a wrong one."""
    async with aiohttp.ClientSession() as stranger:
        for path in ("/", "/?token=guessed", "/static/js/textual.js", "/ws"):
            async with stranger.get(base + path) as answer:
                assert answer.status == 403, path


async def children_while_looked_at(url: str, server: int, number: signal.Signals) -> list[int]:
    """Open the page, end the server while its first screen is shown, and return the children that it had."""
    base = url.partition("/?")[0]
    await refused(base)
    async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as browser:
        async with browser.get(url) as answer:
            page = await answer.text()
            assert answer.status == 200
            assert "token" not in str(answer.url)
            assert "googleapis" not in page
        async with browser.ws_connect(f"{base}/ws?width=100&height=30") as socket:
            drawn = b""
            while b"No run and no batch" not in drawn:
                message = await socket.receive(PATIENCE_S)
                assert message.type in (aiohttp.WSMsgType.BINARY, aiohttp.WSMsgType.TEXT), message
                drawn += message.data if isinstance(message.data, bytes) else message.data.encode()
            children = children_of(server)
            assert len(children) == 1
            os.kill(server, number)
            return children


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_page_needs_the_token_and_nothing_outlives_the_server(number: signal.Signals, home: Path) -> None:
    with subprocess.Popen(COMMAND, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        try:
            assert server.stdout is not None
            url = server.stdout.readline().strip()
            assert url.startswith("http://127.0.0.1:")
            children = asyncio.run(children_while_looked_at(url, server.pid, number))
            assert server.wait(PATIENCE_S) == (130 if number == signal.SIGTERM else -number)
        finally:
            server.kill()
    deadline_s = time.monotonic() + PATIENCE_S
    while any(is_alive(child) for child in children):
        assert time.monotonic() < deadline_s, "A child has outlived the server."
        time.sleep(0.05)
