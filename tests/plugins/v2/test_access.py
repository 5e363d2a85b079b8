"""Access to v2's routes."""

from collections.abc import Callable

import httpx
import pytest

from benchbot.core.errors import BenchbotError
from benchbot.supervisor.serve import serve as serve_run
from tests.plugins.v2.v2_client import COLLISION, get, run_agent, v2
from tests.supervisor.harness import TOKEN, Served, sample_selection

Serve = Callable[..., Served]

JSON = "application/json"

pytestmark = pytest.mark.filterwarnings("ignore:keys will default:DeprecationWarning")


@pytest.mark.parametrize("path", ["/connections/move_next", "/connections/laser", "/robot/reset", "/robot/stop"])
def test_what_uses_the_robot_asks_for_json_which_no_web_page_can_send(serve: Serve, path: str) -> None:
    served = serve(open_to_v2=True)
    assert httpx.get(served.url + path).status_code == 415
    assert httpx.request("GET", served.url + path, data={"a": "b"}).status_code == 415
    assert httpx.request("GET", served.url + path, content=b"{", headers={"Content-Type": JSON}).status_code == 400
    assert not served.hosts


def test_a_name_that_a_web_page_could_have_bent_to_this_machine_is_refused(serve: Serve) -> None:
    served = serve(open_to_v2=True)
    port = served.url.rpartition(":")[2]
    for host, status in (
        ("example.org", 403),
        ("192.0.2.1", 403),
        ("[2001:db8::1]", 403),
        ("[", 403),
        ("127.0.0.1", 200),
        ("[::1]", 200),
        ("localhost", 200),
        ("benchbot_supervisor", 200),
    ):
        response = httpx.get(served.url + "/robot/is_dirty", headers={"Host": f"{host}:{port}"})
        assert response.status_code == status, host


PRIVATE = ["/config/", "/connections/laser", "/results_functions/", "/robot/", "/robot/is_dirty", "/robot/reset"]


@pytest.mark.parametrize("path", PRIVATE)
def test_without_no_token_these_routes_need_the_token_too(serve: Serve, path: str) -> None:
    served = serve()
    assert get(served, path)[0] == 401
    with served.http() as http:
        assert http.request("GET", path, json={}).status_code == 200
        assert http.request("GET", f"{served.url}/{path}", json={}).status_code == 200


def test_the_runs_terminal_says_once_why_v2s_client_was_refused(
    serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    served = serve()
    for _ in range(3):
        assert get(served, "/robot/is_running")[0] == 401
    assert capsys.readouterr().err.count("A client of BenchBot v2 was refused: it knows no token.") == 1


def test_with_a_token_v2s_protocol_is_the_same(serve: Serve) -> None:
    with v2(serve(), TOKEN) as bench:
        bench.start()
        assert run_agent(bench)["results"]["objects"] == []


def test_who_has_a_token_is_that_solution_also_where_none_is_needed(serve: Serve) -> None:
    """Else its episode would end as soon as the command that has submitted it looks at the run."""
    served = serve(sample_selection("sample:active"), open_to_v2=True)
    with v2(served, TOKEN) as bench:
        bench.start()
        assert bench.step("move_distance", distance=100.0)[1] == COLLISION
        served.run.admit(TOKEN)
        assert bench.query("/robot/is_collided") == {"is_collided": True}


def test_no_token_opens_nothing_else(serve: Serve) -> None:
    served = serve(open_to_v2=True)
    for path in ("session", "events"):
        assert httpx.get(f"{served.url}/api/v1/{path}").status_code == 401
    for path in ("reset", "step", "next_scene", "result", "stop", "operator"):
        assert httpx.post(f"{served.url}//api/v1//{path}").status_code == 401
    assert not served.hosts


def test_a_run_open_to_v2_is_never_open_to_other_machines() -> None:
    with pytest.raises(BenchbotError, match="without a token"):
        serve_run(sample_selection(), host="0.0.0.0", allow_remote=True, open_to_v2=True)
