"""Who has failed: a solution cannot lay its failure on the simulator, or on the machine, to be let try again."""

import pytest

from benchbot.core.errors import FailureClass
from tests.supervisor.harness import OPERATOR_TOKEN
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


def test_a_stranger_stops_nothing(serve: Serve) -> None:
    served = serve()
    with served.http("another-token") as http:
        assert http.post("/api/v1/stop").status_code == 401

    assert not served.run.stop_asked.is_set()
