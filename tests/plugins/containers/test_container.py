"""Solutions in real containers of podman: what they get, what they are kept from, and what is left of them."""

import json
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import docker
import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.plugins.containers import container, context, mode
from benchbot.plugins.containers.mode import Containerised
from benchbot.submission.modes import ProcessLimits, SolutionSpec
from benchbot.supervisor.backend import Backend
from tests.plugins.containers import solutions
from tests.submission.submitting import back_end, submit

pytestmark = pytest.mark.xdist_group("containers")

LIMITS = ProcessLimits(memory_bytes=128 * 2**20, processes=40, cpu_time_s=2, file_size_bytes=2**20)

PASSIVE = """
import json
from benchbot.api import BenchBot
benchbot = BenchBot()
while benchbot.actions:
    benchbot.step(benchbot.actions[0])
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
LOOKS_AROUND = """
import errno, json, os, socket
with open("/benchbot/outbox/program", "w") as file:
    os.fchmod(file.fileno(), 0o755)
status = dict(line.rstrip().split(":", 1) for line in open("/proc/self/status"))
def denied(call):
    try:
        call()
    except OSError as error:
        return errno.errorcode[error.errno]
seen = {
    "user": [os.getuid(), os.getgid(), os.getgroups()],
    "capabilities": [int(status[name], 16) for name in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb")],
    "no_new_privileges": int(status["NoNewPrivs"]),
    "seccomp": int(status["Seccomp"]),
    "interfaces": os.listdir("/sys/class/net"),
    "sockets": [denied(lambda: socket.socket(family)) for family in (2, 16, 40)],
    "root": denied(lambda: open("/x", "w")),
    "code": denied(lambda: open("/solution/solution.py", "w")),
    "socket": denied(lambda: os.unlink(os.environ["BENCHBOT_SOCKET"])),
    "run": denied(lambda: os.execv("/benchbot/outbox/program", ["x"])),
    "variables": sorted(os.environ),
    "processes": [name for name in os.listdir("/proc") if name.isdigit()],
}
open("/tmp/x", "w").write("room")
print(json.dumps(seen))
"""
WRITES_MUCH = """
import signal
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
with open("/tmp/large", "wb") as file:
    file.write(bytes(2**21))
"""
BURNS_TOGETHER = """
import os, time
for _ in range(8):
    if os.fork() == 0:
        while time.process_time() < 1.5:
            pass
        os._exit(0)
for _ in range(8):
    os.wait()
"""
"""Eight processes, none of which uses as much as all of them may together."""
FORKS = """
import os, time
children = 0
try:
    while children < 1000:
        if os.fork() == 0:
            time.sleep(1000)
        children += 1
except OSError:
    pass
print("children:", children)
"""


@pytest.fixture
def told(engine_variables: dict[str, str], tmp_path: Path) -> Iterator[Containerised]:
    """The mode, with an image that executes its arguments."""
    with mode.container_mode(context.find(solutions.write(tmp_path / "told")), print) as prepared:
        yield prepared


USES_VOLUMES = """
import json
with open("/data/room", "w") as file:
    file.write("room")
kinds = {line.split()[1]: line.split()[2] for line in open("/proc/mounts")}
print(json.dumps([kinds["/data"], kinds["/solution/cache"], open("/solution/cache/kept").read()]))
"""


def spec(code: str, told: Containerised, timeout_s: float | None = None) -> SolutionSpec:
    return SolutionSpec([told.image], Path("/"), {"args": code}, timeout_s, told, LIMITS)


def containers_left(told: Containerised) -> list[str]:
    with closing(docker.APIClient(base_url=told.engine.url)) as client:
        return [container["Id"] for container in client.containers(all=True)]


def test_a_solution_in_a_container_from_its_first_step_to_its_limits(
    told: Containerised, monkeypatch: pytest.MonkeyPatch
) -> None:
    with back_end() as backend:
        reaches_its_goal(told, backend)
        sees_nothing_but_itself(told, backend)
        is_bounded(told, backend)
        ends_with_all_that_it_has_started(told, backend)
        is_refused_where_its_cpu_time_cannot_be_seen(told, backend, monkeypatch)
        socket = Path(backend.state.connection.socket or "")
        assert socket.stat().st_uid == 0, "what was lent has been given back"


def reaches_its_goal(told: Containerised, backend: Backend) -> None:
    ended, spectator = submit(spec(PASSIVE, told), backend)
    assert ended.problem is None, spectator.text
    assert ended.document["provenance"]["steps"] == 3
    assert ended.document["provenance"]["solution"]["mode"] == "container"
    assert ended.document["provenance"]["solution"]["command"] == [told.image]
    assert containers_left(told) == []


def sees_nothing_but_itself(told: Containerised, backend: Backend) -> None:
    _, spectator = submit(spec(LOOKS_AROUND, told), backend)
    seen = json.loads(spectator.text.splitlines()[-1])
    assert seen.pop("processes") in (["1", str(pid)] for pid in range(2, 30))
    assert set(seen.pop("variables")) <= {
        *("BENCHBOT_RESULT", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "args"),
        *("HOME", "HOSTNAME", "PATH", "PYTHONUNBUFFERED", "TERM", "container"),
    }
    assert seen == {
        "user": [65534, 65534, [65534]],
        "capabilities": [0, 0, 0, 0, 0],
        "no_new_privileges": 1,
        "seccomp": 2,
        "interfaces": ["lo"],
        "sockets": ["EACCES"] * 3,
        "root": "EROFS",
        "code": "EROFS",
        "socket": "EROFS",
        "run": "EACCES",
    }


def is_bounded(told: Containerised, backend: Backend) -> None:
    for code, why, failure in (
        ("x = bytearray(2**29)", "more memory than it may: 128 MiB", FailureClass.AGENT),
        ("while True: pass", "It had 2 seconds", FailureClass.TIMEOUT),
        (BURNS_TOGETHER, "It had 2 seconds", FailureClass.TIMEOUT),
        (WRITES_MUCH, "a file larger than it may: 1 MiB", FailureClass.AGENT),
        ("import sys; print('no idea'); sys.exit(7)", "exit status 7.\nno idea", FailureClass.AGENT),
    ):
        ended, _ = submit(spec(code, told), backend)
        assert ended.problem is not None
        assert why in ended.problem.why
        assert ended.problem.failure == failure
    _, spectator = submit(spec(FORKS, told), backend)
    children = int(spectator.text.split()[-1])
    assert 10 < children < 40
    ended, spectator = submit(spec("print('x' * 10**6); print('end')", told), backend)
    assert len(spectator.output) == 10**6 + 5
    assert ended.problem is not None
    assert ended.problem.title == "The solution saved no result."


def ends_with_all_that_it_has_started(told: Containerised, backend: Backend) -> None:
    stubborn = "import signal, time; signal.signal(15, signal.SIG_IGN); print('here'); time.sleep(1000)"
    double_fork = f"import os\nif os.fork() == 0:\n os.setsid()\n if os.fork() == 0:\n  {stubborn}\nelse:\n {stubborn}"
    ended, spectator = submit(spec(double_fork, told, timeout_s=0.5), backend)
    assert ended.problem is not None
    assert ended.problem.failure == FailureClass.TIMEOUT
    assert not Path(f"/proc/{spectator.process}").exists()
    assert containers_left(told) == []


def is_refused_where_its_cpu_time_cannot_be_seen(
    told: Containerised, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But not where it is only over too soon to be seen."""
    monkeypatch.setattr(container, "of_process", lambda _process: None)
    ended, _ = submit(spec("print('end')", told), backend)
    assert ended.problem is not None
    assert ended.problem.title == "The solution saved no result."
    with pytest.raises(BenchbotError, match=r"limits would not hold: CPU time"):
        submit(spec("import time; time.sleep(1000)", told), backend)
    assert containers_left(told) == []


def test_a_volume_of_an_image_is_no_way_to_the_disk(engine_variables: dict[str, str], tmp_path: Path) -> None:
    volumes = 'COPY kept /solution/cache/\nVOLUME ["/data", "/solution/cache", "/benchbot/outbox"]\n'
    folder = solutions.write(tmp_path / "volumes", dockerfile=f"{solutions.DOCKERFILE}{volumes}")
    (folder / "kept").write_text("weights")
    with mode.container_mode(context.find(folder), print) as held, back_end() as backend:
        _, spectator = submit(spec(USES_VOLUMES, held), backend)
        assert json.loads(spectator.text) == ["tmpfs", "tmpfs", "weights"]
        with closing(docker.APIClient(base_url=held.engine.url)) as client:
            assert not client.volumes()["Volumes"]
