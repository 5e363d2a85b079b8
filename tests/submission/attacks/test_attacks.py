"""A cheating solution in each mode: natively it gets all that the user has, in a sandbox or container nothing."""

import base64
import json
import os
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import benchbot
from benchbot.plugins.containers import context
from benchbot.plugins.containers import mode as containers
from benchbot.plugins.sandbox.mode import Sandbox
from benchbot.submission.modes import NATIVE, SolutionSpec
from tests.plugin_factory import DECLARES, PluginFactory
from tests.plugins.containers import solutions
from tests.submission.attacks import table
from tests.submission.ordinary import delegated, ordinarily
from tests.submission.rootless import Rootless, rootless
from tests.submission.submitting import back_end
from tests.submission.submitting import submit as run
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.xdist_group("containers")

ATTACKS = Path(__file__).parent
CHEATER = ATTACKS / "cheater.py"
DOCKERFILE = solutions.DOCKERFILE.replace("COPY solution.py", "COPY tests /solution/tests\nCOPY solution.py")
LIMITS = {"memory_bytes": 256 * 2**20, "processes": 64, "file_size_bytes": 2**20}
OPTIONS = ["--memory", "256MiB", "--processes", "64", "--file-size", "1MiB"]
SELECTION = ["--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1"]
SUBMIT = [sys.executable, "-m", "benchbot", "submit", *SELECTION]
SCENE = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample" / "environments" / "arena_1.yaml"


@dataclass
class Prey:
    """The targets of an attack: ground truth, another run's result, a service on this machine; and its mark."""

    folder: Path
    port: int
    abstract: str
    secret: str = field(default_factory=lambda: f"SECRET-{secrets.token_hex(8)}")
    mark: str = field(default_factory=lambda: f"outliving-{secrets.token_hex(8)}")

    @property
    def truth(self) -> Path:
        return self.folder / "site" / "benchbot_truth" / "ground_truths" / "arena_1.json"

    @property
    def other_result(self) -> Path:
        return self.folder / "other" / "result.json"

    @property
    def state(self) -> Path:
        return self.folder / "state"

    def targets(self, *, harmless: bool) -> str:
        wanted = {
            **LIMITS,
            "harmless": harmless,
            "truth": str(self.truth),
            "tree": str(self.folder / "site"),
            "scene": str(SCENE),
            "state": str(self.state),
            "other_result": str(self.other_result),
            "code": [benchbot.__file__],
            "port": self.port,
            "addresses": ["127.0.0.1", socket.gethostbyname(socket.gethostname())],
            "abstract": self.abstract,
            "mark": self.mark,
        }
        return base64.b64encode(json.dumps(wanted).encode()).decode()


@dataclass(frozen=True)
class Submitted:
    """The end of a submission: each attempt by name, the result, and all output."""

    attempts: dict[str, dict[str, Any]]
    result: dict[str, Any]
    text: str

    @property
    def got(self) -> dict[str, str]:
        return {name: attempt["got"] for name, attempt in self.attempts.items() if attempt["got"] is not None}


@pytest.fixture(scope="module")
def prey() -> Iterator[Prey]:
    abstract = f"benchbot-{secrets.token_hex(8)}"
    # pytest's own folders are closed to ordinary users.
    folder = Path(tempfile.mkdtemp(prefix="benchbot-test-"))
    folder.chmod(0o755)
    with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket(socket.AF_UNIX) as other:
        other.bind(f"\0{abstract}")
        other.listen()
        prey = Prey(folder, listener.getsockname()[1], abstract)
        (folder / "site").mkdir()
        prey.other_result.parent.mkdir()
        prey.other_result.write_text("{}")
        prey.other_result.chmod(0o600)
        truth = {"environment": {"name": "arena", "variant": 1}, "ground_truth": {"objects": prey.secret}}
        files = {"ground_truths/arena_1.json": json.dumps(truth)}
        PluginFactory(folder / "site").make("benchbot-truth", DECLARES.format(kind="ground_truths"), files)
        yield prey
    shutil.rmtree(folder)


def submit(
    prey: Prey,
    how: Sequence[str],
    *,
    harmless: bool,
    ordinary: bool = False,
    variables: Mapping[str, str] | None = None,
    podman: Rootless | None = None,
) -> Submitted:
    """Have the cheater submitted, from a folder of its own; natively by root, or else by who may make control groups.

    With a `podman` it is that one's user who submits it.
    """
    work = prey.folder / secrets.token_hex(4)
    copy_modules(work)
    shutil.copy(CHEATER, work)
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith("BENCHBOT_")},
        "BENCHBOT_STATE_DIR": str(prey.state),
        "BENCHBOT_CACHE_DIR": str(prey.folder / "cache"),
        "BENCHBOT_DATA_DIR": str(prey.folder / "data"),
        "BENCHBOT_PLUGINS": "benchbot-sample,benchbot-truth",
        "PYTHONPATH": os.pathsep.join([str(prey.folder / "site"), os.environ["PYTHONPATH"]]),
        "HOME": str(prey.folder / "home"),
        "TMPDIR": str(prey.folder),
        **(variables or {}),
    }
    (prey.folder / "home").mkdir(exist_ok=True)
    command = [*SUBMIT, *how, "--args", prey.targets(harmless=harmless), "--timeout", "120", "--json"]
    with ExitStack() as stack:
        if podman is not None:
            command, environment = podman.running(command, prey.folder), {**environment, **podman.variables}
        elif ordinary:
            command = [*stack.enter_context(delegated()), *ordinarily(command, prey.folder)]
        run = subprocess.run
        done = run(command, capture_output=True, text=True, check=False, cwd=work, env=environment, timeout=600)
    text = done.stdout + done.stderr
    assert done.returncode == 0, text
    attempts = {}
    for shown in done.stderr.splitlines():
        line = shown.removeprefix("solution | ")
        if line.startswith('{"attack"'):
            attempt = json.loads(line)
            attempts[attempt["attack"]] = attempt
    result = json.loads(Path(json.loads(done.stdout)["result_path"]).read_text("utf-8"))
    return Submitted(attempts, result, text)


def copy_modules(folder: Path) -> None:
    """Copy what the cheater imports, as it imports it."""
    package = folder / "tests" / "submission" / "attacks"
    package.mkdir(parents=True)
    for name in ("attempts.py", "overreach.py"):
        shutil.copy(ATTACKS / name, package)


def host_is_unharmed(prey: Prey, submitted: Submitted) -> None:
    """Look at this machine: no process is left, nothing was overwritten, nothing is told, nothing is forged."""
    assert eventually(lambda: not processes_with(prey.mark)), "a process outlives the run"
    assert prey.other_result.read_text() == "{}"
    assert not list(prey.folder.rglob("left-by-a-cheater"))
    assert prey.secret not in json.dumps(submitted.result)
    provenance = submitted.result["provenance"]
    assert submitted.result["task_details"]["name"] == "sample:passive"
    assert [scene["name"] for scene in submitted.result["environment_details"]] == ["arena"]
    assert (provenance["steps"], provenance["selection"]["seed"], provenance["failure"]) == (0, 0, None)
    assert "forged" not in json.dumps(submitted.result)


def processes_with(mark: str) -> list[str]:
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            if mark.encode() in path.read_bytes():
                found.append(str(path))
    return found


def test_a_native_solution_has_what_its_user_has(prey: Prey) -> None:
    submitted = submit(prey, ["--native", f"{sys.executable} cheater.py"], harmless=True)
    host_is_unharmed(prey, submitted)
    table.check("native", submitted.attempts)
    assert "kill the supervisor" in submitted.got
    assert "read the ground truth where it is" in submitted.got
    # What a solution is not to know is not told by asking, whatever it may look up by itself.
    for name in ("ask every route of the supervisor for ground truth", "confirm what the operator is asked to do"):
        assert name not in submitted.got


@pytest.mark.parametrize("ordinary", [False, True], ids=["root", "ordinary"])
def test_a_sandboxed_solution_gets_nothing(prey: Prey, ordinary: bool) -> None:
    how = ["--sandbox", f"{sys.executable} cheater.py", *OPTIONS]
    submitted = submit(prey, how, harmless=False, ordinary=ordinary)
    host_is_unharmed(prey, submitted)
    table.check("sandbox, by an ordinary user" if ordinary else "sandbox", submitted.attempts)
    assert submitted.got == {}
    assert submitted.result["provenance"]["solution"]["mode"] == "sandbox"


def test_a_containerised_solution_gets_nothing(prey: Prey, podman: dict[str, str], tmp_path: Path) -> None:
    folder = solutions.write(tmp_path / "cheater", CHEATER.read_text(), DOCKERFILE)
    copy_modules(folder)
    submitted = submit(prey, ["--containerised", str(folder), *OPTIONS], harmless=False, variables=podman)
    host_is_unharmed(prey, submitted)
    table.check("container", submitted.attempts)
    assert submitted.got == {}
    assert submitted.result["provenance"]["solution"]["mode"] == "container"


WEAKLY_HELD = (
    "use more memory than allowed, in eight processes",
    "use more memory than allowed, in files that nobody has mapped",
)


@pytest.mark.slow
def test_an_ordinary_users_container_gets_nothing_and_is_refused_what_would_not_be_limited(prey: Prey) -> None:
    folder = solutions.write(prey.folder / "contained", CHEATER.read_text(), DOCKERFILE)
    copy_modules(folder)
    how = ["--containerised", str(folder), *OPTIONS]
    with rootless(prey.folder / "podman") as podman:
        command = podman.running([*SUBMIT, *how], prey.folder)
        environment = {**os.environ, **podman.variables, "HOME": str(prey.folder), "TMPDIR": str(prey.folder)}
        refused = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=300)
        submitted = submit(prey, [*how, "--weak-limits"], harmless=False, podman=podman)
    assert refused.returncode == 2
    assert "The solution's limits would not hold: memory, processes." in refused.stderr
    host_is_unharmed(prey, submitted)
    # What it leaves is in the folder of its result, which goes with the run: host_is_unharmed has looked.
    assert set(submitted.got) <= {*WEAKLY_HELD, "leave files on this machine's disk"}
    table.check("container, by an ordinary user", submitted.attempts, WEAKLY_HELD)
    assert submitted.result["provenance"]["solution"]["weak_limits"] == ["memory", "processes", "disk"]


STAYS = """
import os, signal, sys, time
for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
for _ in range(3):
    if os.fork() == 0:
        os.setsid()
wanted = [os.getppid()] if NATIVE else [int(name) for name in os.listdir("/proc") if name.isdigit()]
for process in wanted:
    try:
        if process != os.getpid():
            os.kill(process, signal.SIGSTOP)
    except OSError:
        pass
time.sleep(600)
"""
"""Ignores what is polite, has children in sessions of their own, and stops its leader and whatever else it may."""
LONGEST_S = 15.0
"""A deadline, not a measurement: a busy machine is slower than the 5 seconds after a time-out that are promised."""


@pytest.mark.slow
def test_a_solution_that_stops_what_is_to_end_it_ends_all_the_same(
    engine_variables: dict[str, str], tmp_path: Path
) -> None:
    telling = solutions.write(tmp_path / "telling")
    (telling / "stays.py").write_text(f"NATIVE = False\n{STAYS}")
    (telling / "stays_natively.py").write_text(f"NATIVE = True\n{STAYS}")
    with back_end() as backend, containers.container_mode(context.find(telling), print) as container:
        for mode, command, variables in (
            (NATIVE, [sys.executable, "stays_natively.py"], {}),
            (Sandbox(), [sys.executable, "stays.py"], {}),
            (container, [container.image], {"args": f"NATIVE = False\n{STAYS}"}),
        ):
            began_s = time.monotonic()
            ended, spectator = run(SolutionSpec(command, telling, variables, 2, mode), backend)
            assert time.monotonic() - began_s < LONGEST_S, mode.name
            assert ended.document["provenance"]["failure"]["class"] == "timeout", spectator.text
            assert not Path(f"/proc/{spectator.process}").exists()
            assert not processes_with("stays")


NAMES = """
import os
RESULT, TRUTH, MARK = os.environ["BENCHBOT_RESULT"], {truth!r}, {mark!r}
"""
HANDED_IN = {
    "hand in a failure of the platform, and fail": """
import http.client, json, os, socket
connection = http.client.HTTPConnection("localhost")
connection.sock = socket.socket(socket.AF_UNIX)
connection.sock.connect(os.environ["BENCHBOT_SOCKET"])
body = json.dumps({"failure": {"class": "platform", "why": "not my fault"}})
token = {"Authorization": "Bearer " + os.environ["BENCHBOT_TOKEN"], "Content-Type": "application/json"}
connection.request("POST", "/api/v1/result", body, token)
print(connection.getresponse().read())
raise SystemExit(1)
""",
    "hand in a link to the ground truth as its result": """
import os
os.path.exists(RESULT) and os.unlink(RESULT)
os.symlink(TRUTH, RESULT)
""",
    "hand in a pipe that nobody writes to": """
import os
os.path.exists(RESULT) and os.unlink(RESULT)
os.mkfifo(RESULT)
""",
    "hand in a pickle that runs a command": """
import os, pickle
class Command:
    def __reduce__(self):
        return os.system, ("touch " + MARK,)
pickle.dump(Command(), open(RESULT, "wb"))
""",
    "hand in brackets nested a million deep": "open(RESULT, 'w').write('[' * 10**6)",
    "hand in more than a result may have": """
with open(RESULT, "wb") as file:
    file.write(b'{"results": "')
    file.truncate(65 * 2**20)
""",
}
"""Things that a solution may leave in the place of its result."""


def test_a_result_that_is_none_is_told_and_harms_nobody(
    prey: Prey, engine_variables: dict[str, str], tmp_path: Path
) -> None:
    telling = solutions.write(tmp_path / "telling")
    with back_end() as backend, containers.container_mode(context.find(telling), print) as container:
        for name, code in HANDED_IN.items():
            mark = tmp_path / f"mark-{len(name)}"
            names = (
                f"import os\nRESULT = os.environ['BENCHBOT_RESULT']\nTRUTH = {str(prey.truth)!r}\nMARK = {str(mark)!r}"
            )
            program = f"{names}\n{code}"
            (telling / "handed_in.py").write_text(program)
            native = [sys.executable, "handed_in.py"]
            for mode, command, variables in (
                (NATIVE, native, {}),
                (Sandbox(), native, {}),
                (container, [container.image], {"args": program}),
            ):
                ended, spectator = run(SolutionSpec(command, telling, variables, 60, mode), backend)
                assert ended.problem is not None, (name, mode.name)
                assert ended.document["provenance"]["failure"]["class"] == "agent", spectator.text
                assert prey.secret not in json.dumps(ended.document) + str(ended.problem)
                assert not mark.exists()
