"""Container engines that speak HTTP over real unix sockets, and this machine's sandbox."""

import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from pathlib import Path

import pytest

from benchbot.core.findings import Finding, Level
from benchbot.plugins.doctor import isolation

PODMAN = '{"Version": "5.4.2", "Components": [{"Name": "Podman Engine"}]}'
DOCKER = '{"Version": "28.2.2", "Components": [{"Name": "Engine"}]}'


@contextmanager
def engine(path: Path, answer: str) -> Iterator[None]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answer.encode())

        def address_string(self) -> str:
            return "somebody"

        def log_message(self, *_: object) -> None:
            pass

    with socketserver.UnixStreamServer(str(path), Handler) as server:
        serving = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        serving.start()
        try:
            yield
        finally:
            server.shutdown()
            serving.join()


def looked_at(folder: Path, monkeypatch: pytest.MonkeyPatch, clients: tuple[str, ...] = ("docker",)) -> Finding:
    commands = folder / "bin"
    commands.mkdir()
    for client in clients:
        (commands / client).write_text("#!/bin/sh\necho podman version 5.4.2\n")
        (commands / client).chmod(0o755)
    monkeypatch.setenv("PATH", str(commands))
    monkeypatch.setenv("DOCKER_HOST", f"unix://{folder}/engine.sock")
    return isolation.containers()


@pytest.mark.parametrize(("answer", "said"), [(PODMAN, "podman 5.4.2 at "), (DOCKER, "docker 28.2.2 at ")])
def test_an_engine_that_answers_is_named(
    answer: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with engine(tmp_path / "engine.sock", answer):
        finding = looked_at(tmp_path, monkeypatch)

    assert (finding.level, finding.detail) == (Level.OK, f"{said}{tmp_path}/engine.sock")


@pytest.mark.parametrize("answer", ["[]", "{}", "<html>"])
def test_something_else_behind_the_socket_is_no_engine(
    answer: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with engine(tmp_path / "engine.sock", answer):
        finding = looked_at(tmp_path, monkeypatch)

    assert finding.level is Level.WARNING
    assert "does not answer" in finding.detail


def test_an_engine_that_is_gone_is_a_warning_unless_podman_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with engine(tmp_path / "engine.sock", DOCKER):
        pass  # it leaves its socket behind, as a killed one does

    finding = looked_at(tmp_path, monkeypatch)
    podman = (tmp_path / "bin" / "docker").rename(tmp_path / "bin" / "podman")

    assert (finding.level, finding.fix) == (Level.WARNING, "Start the engine: sudo systemctl restart docker")
    assert isolation.containers().detail == "podman version 5.4.2, started when it is needed"
    podman.write_text("#!/bin/sh\necho no such storage >&2; exit 125\n")
    assert isolation.containers().detail == "podman does not run: no such storage"


def test_the_sandbox_is_told_with_all_that_holds_it() -> None:
    told = {finding.subject: finding for finding in isolation.sandbox()}

    assert told["sandbox"].detail
    assert (told["sandbox"].level is Level.OK) == (told["sandbox"].fix == "")
