"""The way of v2's published client to a run, and the file that it saves its result to."""

import fcntl
import json
import os
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot.cli.kit.preflight import Intent, Submission
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.plugin_manager import load
from benchbot.plugins.v2 import bridge, client_check, client_mode
from benchbot.submission.modes import SolutionSpec
from benchbot.wire.run_state import Connection
from tests.supervisor.harness import TOKEN, Served, eventually

Serve = Callable[..., Served]
SUPERVISOR = "http://benchbot_supervisor:10000"


def ask(url: str, proxy: str) -> tuple[int, bytes]:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({"http": proxy}))
    request = urllib.request.Request(url, b"{}", {"Content-Type": "application/json"}, method="GET")
    try:
        with opener.open(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def test_a_proxy_leads_to_a_run_that_is_open_to_nobody(serve: Serve) -> None:
    told: list[bytes] = []
    with bridge.listening(Connection(serve().url, None, TOKEN), told.append) as variables:
        assert ask(f"{SUPERVISOR}/robot/is_running", variables["http_proxy"]) == (200, b'{"is_running":true}\n')
        assert ask(f"{SUPERVISOR}//results_functions//", variables["http_proxy"])[0] == 200
    assert told == []


def test_it_lets_in_nobody_else_and_leads_nowhere_else(serve: Serve) -> None:
    told: list[bytes] = []
    with bridge.listening(Connection(serve().url, None, TOKEN), told.append) as variables:
        proxy = variables["http_proxy"]
        address = proxy.rpartition("@")[2]
        assert ask(f"{SUPERVISOR}/robot/is_running", f"http://{address}")[0] == 407
        assert ask(f"{SUPERVISOR}/robot/is_running", f"http://benchbot:guess@{address}")[0] == 407
        status, content = ask("http://example.org/robot/is_running", proxy)
        assert (status, "not to 'example.org': set no_proxy" in json.loads(content)["why"]) == (403, True)
        with pytest.raises(urllib.error.HTTPError, match="407"):
            urllib.request.urlopen(f"http://{address}/robot/is_running", timeout=60)
    assert len(told) == 4


def test_what_v2s_client_does_not_say_is_told(serve: Serve) -> None:
    told: list[bytes] = []
    with bridge.listening(Connection(serve().url, None, TOKEN), told.append) as variables:
        assert ask(f"{SUPERVISOR}/connections/fly", variables["http_proxy"])[0] == 404
    assert told[0].startswith(b"/connections/fly: There is no connection 'fly'. ")


def test_a_run_that_is_gone_is_told() -> None:
    told: list[bytes] = []
    with bridge.listening(Connection("http://127.0.0.1:9", None, TOKEN), told.append) as variables:
        assert ask(f"{SUPERVISOR}/", variables["http_proxy"])[0] == 502
    assert b"The BenchBot supervisor is gone." in told[0]


def test_a_run_with_no_token_may_be_a_proxy_itself(serve: Serve) -> None:
    url = serve(open_to_v2=True).url
    assert ask(f"{SUPERVISOR}//robot/is_running", url) == (200, b'{"is_running":true}\n')
    assert ask("http://example.org/robot/is_running", url)[0] == 403


def test_a_result_is_moved_and_no_link_is_followed(tmp_path: Path) -> None:
    source, target, other = tmp_path / "benchbot_result", tmp_path / "result.json", tmp_path / "other"
    assert client_mode.take_result(source, target) is None
    other.write_text("{}")
    source.symlink_to(other)
    assert "links are not followed" in (client_mode.take_result(source, target) or "")
    source.unlink()
    source.mkdir()
    assert "no regular file" in (client_mode.take_result(source, target) or "")
    source.rmdir()
    assert not target.exists()
    source.write_text('{"results": 1}')
    assert client_mode.take_result(source, target) is None
    assert (target.read_text(), source.exists()) == ('{"results": 1}', False)


def test_one_solution_at_a_time_may_write_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_mode, "LOCK", tmp_path / "lock")
    monkeypatch.setattr(client_mode, "_held", [])
    told: list[str] = []
    ran = threading.Event()

    def run() -> None:
        with client_mode._alone(told.append), client_mode._alone(told.append):
            ran.set()

    holder = os.open(tmp_path / "lock", os.O_RDONLY | os.O_CREAT, 0o644)
    fcntl.flock(holder, fcntl.LOCK_EX)
    thread = threading.Thread(target=run)
    thread.start()
    assert eventually(lambda: bool(told))
    assert "both would save their result" in told[0]
    assert not ran.is_set()
    os.close(holder)
    thread.join(60)
    assert ran.is_set()
    with client_mode._alone(told.append):
        assert len(told) == 1


def findings(folder: Path, *command: str) -> list[Finding]:
    submission = Submission(SolutionSpec(list(command), folder), "native")
    return list(client_check.check(Catalog(load()), Intent(submissions=[submission])))


def test_a_solution_that_would_find_the_published_client_is_told_how_it_runs(tmp_path: Path) -> None:
    (tmp_path / "solution.py").write_text("import benchbot_api\nopen('ran', 'w')")
    (tmp_path / "other.py").write_text("import benchbot.api")
    assert findings(tmp_path, sys.executable, "solution.py") == []
    assert findings(tmp_path, "true") == []
    (tmp_path / "benchbot_api").mkdir()
    (tmp_path / "benchbot_api" / "__init__.py").write_text("")
    (found,) = findings(tmp_path, sys.executable, "solution.py")
    assert (found.level, "--v2-client" in found.fix) == (Level.WARNING, True)
    assert str(tmp_path / "benchbot_api") in found.detail
    assert findings(tmp_path, sys.executable, "other.py") == []
    assert not (tmp_path / "ran").exists()


def test_so_is_one_whose_interpreter_has_it(tmp_path: Path) -> None:
    """As where v2's client is installed in an environment of its own."""
    (tmp_path / "theirs" / "benchbot_api").mkdir(parents=True)
    (tmp_path / "theirs" / "benchbot_api" / "__init__.py").write_text("")
    python = tmp_path / "python3"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path}/theirs exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    (tmp_path / "solution.py").write_text("from benchbot_api import BenchBot")
    (found,) = findings(tmp_path, str(python), "solution.py")
    assert str(tmp_path / "theirs") in found.detail
