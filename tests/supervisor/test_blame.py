"""Who has failed: a solution cannot lay its failure on the simulator, or on the machine, to be let try again."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from benchbot.api.client import Client
from benchbot.core.errors import FailureClass
from benchbot.core.request import RunRequest
from benchbot.submission.modes import private_socket
from benchbot.supervisor.backend import Backend
from tests.supervisor.harness import OPERATOR_TOKEN, eventually, sample_selection
from tests.supervisor.http.test_app import Serve, post, read


@pytest.mark.parametrize("claimed", ["platform", "infrastructure"])
def test_a_solution_cannot_blame_what_it_runs_on(claimed: str, serve: Serve) -> None:
    served = serve()
    body = {"failure": {"class": claimed, "why": "It was not me."}}
    with served.http() as http:
        http.post("/api/v1/reset")
        refused = http.post("/api/v1/result", json=body)
        own = http.post("/api/v1/result", json={"failure": {"class": "agent", "why": "It was me."}})

    assert refused.status_code == 403
    assert refused.json()["fix"] == "Say that the solution failed, with class 'agent'."
    assert own.status_code == 200
    assert served.run.progress.failure is FailureClass.AGENT


@pytest.mark.parametrize("started", [False, True])
def test_a_solution_that_stops_its_run_has_failed(started: bool, serve: Serve) -> None:
    served = serve()
    with served.http() as http:
        if started:
            post(http, "reset")
        assert post(http, "stop") == (200, {"stopping": True})
        assert served.run.stop_asked.wait(60)
        progress = read(http.get("/api/v1/session"))[1]["progress"]

    assert (progress["failure"], served.run.stopped_in_use) == ("agent", True)
    assert "The solution stopped its run" in progress["failure_why"]


def test_the_one_who_runs_it_may_stop_it_and_nobody_has_failed(serve: Serve) -> None:
    served = serve()
    with served.http(OPERATOR_TOKEN) as http:
        assert http.post("/api/v1/stop").status_code == 200
        assert served.run.stop_asked.wait(60)

    assert (served.run.progress.failure, served.run.stopped_in_use) == (None, False)


def test_the_result_says_who_has_stopped_a_run_in_the_middle_of_an_action(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"))
    turn = {"action": "move_angle", "arguments": {"angle": 36000}}
    with served.http() as http, served.http(OPERATOR_TOKEN) as operator, ThreadPoolExecutor() as executor:
        post(http, "reset")
        turning = executor.submit(post, http, "step", turn)
        assert eventually(lambda: served.run.last_action is not None)
        assert post(operator, "stop", {"by": 81 * "x"})[0] == 400
        assert post(operator, "stop", {"by": "the red key"}) == (200, {"stopping": True})
        assert turning.result()[0] == 500

    assert served.run.progress.failure is FailureClass.PLATFORM
    assert served.run.progress.failure_why == "The run was stopped by its user (the red key)."


LONG_TURN = """\
import os, sys
from benchbot.api.client import Client
from benchbot.wire.run_state import Connection
if os.fork():
    os._exit(0)
print(os.getpid(), flush=True)
client = Client(Connection(None, *sys.argv[1:]))
client.reset()
client.step("move_angle", {"angle": 36000})
"""
"""A client that is nobody's child any more."""


def test_a_frozen_client_of_a_unix_socket_stops_a_real_robot_and_has_failed() -> None:
    wanted = RunRequest("sample:active", "sample_real_robot", "faulty:halts")
    with private_socket() as path, Backend.start(wanted, port=None, unix_socket=path) as backend:
        where = backend.state.connection
        with subprocess.Popen(
            [sys.executable, "-c", LONG_TURN, str(where.socket), where.token], stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            client = int(process.stdout.readline())
            watching = Client(replace(where, token=backend.state.operator_token))
            assert eventually(lambda: watching.session()["progress"]["last_action"] == "move_angle")

            os.kill(client, signal.SIGSTOP)
            try:
                assert eventually(lambda: watching.session()["progress"]["ends_run"])
                progress = watching.session()["progress"]
            finally:
                os.kill(client, signal.SIGKILL)

    assert progress["failure"] == "agent"
    assert progress["failure_why"].startswith(f"The solution (process {client}) was frozen")


def test_a_stranger_stops_nothing(serve: Serve) -> None:
    served = serve()
    with served.http("another-token") as http:
        assert http.post("/api/v1/stop").status_code == 401

    assert not served.run.stop_asked.is_set()
