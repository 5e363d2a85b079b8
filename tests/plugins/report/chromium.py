"""Headless Chromium, driven over its debugging pipe: the DevTools protocol needs no driver and no port.

https://chromedevtools.github.io/devtools-protocol/ (flag --remote-debugging-pipe: file descriptors 3 and 4, messages
of JSON that end in a zero byte).
"""

import base64
import fcntl
import itertools
import json
import os
import select
import shutil
import signal
import tempfile
from contextlib import suppress
from typing import Any

NAMES = ("chromium", "chromium-browser", "chromium-headless-shell", "google-chrome", "google-chrome-stable", "chrome")
PATIENCE_S = 120


class Browser:
    """A browser with one page. `events` holds what it has said since the page was opened."""

    def __init__(self) -> None:
        executable = _executable()
        self._home = tempfile.mkdtemp(prefix="chromium-")
        commands_out, self._commands = os.pipe()
        self._answers, answers_in = os.pipe()
        flags = [
            "--headless",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            # Whatever it would like to look up, it finds nothing.
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--remote-debugging-pipe",
            f"--user-data-dir={self._home}",
            # A container's superuser cannot use the sandbox, and the pages are ours.
            *(["--no-sandbox", "--disable-dev-shm-usage"] if os.geteuid() == 0 else []),
        ]
        # A pipe's own number may be one of those that it is to get in the browser.
        sources = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (commands_out, answers_in)]
        self._process = os.posix_spawn(
            executable,
            ["chromium", *flags, "about:blank"],
            {**os.environ, "HOME": self._home},
            file_actions=[
                *((os.POSIX_SPAWN_OPEN, stream, os.devnull, os.O_WRONLY, 0) for stream in (1, 2)),
                *((os.POSIX_SPAWN_DUP2, source, number) for number, source in enumerate(sources, 3)),
            ],
            setpgroup=0,
        )
        for end in sources:
            os.close(end)
        os.close(commands_out)
        os.close(answers_in)
        self._buffer = b""
        self._numbers = itertools.count(1)
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Network", "Log", "Runtime"):
            self(f"{domain}.enable")

    def __call__(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol; return its result."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._commands, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result
            self.events.append(answer)

    def open(self, url: str) -> None:
        """Show a page as a screen of the usual size does; return when it is loaded."""
        self("Emulation.setEmulatedMedia", media="", features=[])
        self("Emulation.clearDeviceMetricsOverride")
        self.events.clear()
        self("Page.navigate", url=url)
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self._read())

    def look(self, width: int, scheme: str) -> None:
        """Make the window so wide, in pixels, and prefer a colour scheme: `light` or `dark`."""
        self("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 500)

    def evaluate(self, expression: str) -> Any:
        """Return what a JavaScript expression is, its promise kept."""
        answer = self("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def screenshot(self) -> bytes:
        """Return the whole page as PNG."""
        return base64.b64decode(self("Page.captureScreenshot", captureBeyondViewport=True)["data"])

    def pdf(self) -> bytes:
        """Return the page as it is printed."""
        return base64.b64decode(self("Page.printToPDF", paperWidth=8.27, paperHeight=11.69)["data"])

    def said(self, method: str) -> list[dict[str, Any]]:
        """Return the parameters of events of one kind since the page was opened."""
        return [event["params"] for event in self.events if event.get("method") == method]

    def close(self) -> None:
        """End the browser and everything that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)
        os.close(self._commands)
        os.close(self._answers)
        shutil.rmtree(self._home, ignore_errors=True)

    def _read(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._answers], [], [], PATIENCE_S)
            assert ready, f"The browser has said nothing for {PATIENCE_S} s."
            received = os.read(self._answers, 1 << 20)
            assert received, "The browser has died."
            self._buffer += received
        message, _, self._buffer = self._buffer.partition(b"\0")
        answer: dict[str, Any] = json.loads(message)
        return answer


def _executable() -> str:
    for name in NAMES:
        found = shutil.which(name)
        if found is not None:
            return found
    raise AssertionError(f"This test needs a browser, one of {', '.join(NAMES)}: apt-get install chromium")
