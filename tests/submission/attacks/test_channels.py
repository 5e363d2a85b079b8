"""What a solution is told by each channel of a run: the lines of docs/attacks.md that no other test holds."""

import json
import math
import mmap
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchbot.core.request import RunRequest
from benchbot.plugins.sandbox.mode import Sandbox
from benchbot.submission.modes import SolutionSpec, private_socket
from benchbot.supervisor.backend import Backend
from benchbot.wire import encoding
from benchbot.wire.arena import HEADER_BYTES, NAME
from tests.submission.submitting import back_end, submit

DRIVEN = [("move_distance", {"distance": 0.7}), ("move_angle", {"angle": 50.0}), ("move_distance", {"distance": 0.4})]
V2 = ["config/", "robot/is_collided", "robot/is_dirty", "robot/selected_environment", "connections/poses"]


class Asking:
    """A solution that asks over TCP, and keeps the heads of all answers."""

    def __init__(self, backend: Backend) -> None:
        headers = {"Authorization": f"Bearer {backend.state.connection.token}"}
        self._http = httpx.Client(base_url=str(backend.state.connection.url), headers=headers, timeout=60)
        self.heads: list[httpx.Headers] = []

    def __call__(self, path: str, body: Any = None, *, arena: str = "", fetch: encoding.Fetch | None = None) -> Any:
        """Return the answer as plain data; a body is posted, in v1, or sent with GET, in v2."""
        content = {} if body is None else {"json": body}
        headers = {encoding.ARENA_HEADER: arena} if arena else {}
        method = "POST" if body is not None and path.startswith("api/") else "GET"
        answer = self._http.request(method, f"/{path}", headers=headers, **content)
        self.heads.append(answer.headers)
        if answer.headers["content-type"] == "application/msgpack":
            return encoding.decode(bytearray(answer.content), fetch)
        return json.loads(answer.content)

    def event(self) -> Any:
        """Return the data of the first event."""
        with self._http.stream("GET", "/api/v1/events") as answer:
            self.heads.append(answer.headers)
            for line in answer.iter_lines():
                if line.startswith("data: "):
                    return json.loads(line.removeprefix("data: "))
        raise AssertionError("no event")


@contextmanager
def asking(task: str, environment: str = "arena:1", seed: int = 3) -> Iterator[Asking]:
    request = RunRequest(task, "sample_robot", environment, seed=seed)
    with private_socket() as path, Backend.start(request, port=0, unix_socket=path) as backend:
        yield Asking(backend)


def numbers(value: Any) -> Iterator[float]:
    """Yield all numbers in plain data, but not those of pictures and scans."""
    if isinstance(value, Mapping):
        for inner in value.values():
            yield from numbers(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from numbers(inner)
    elif isinstance(value, np.ndarray) and value.size <= 16:
        yield from map(float, value.ravel())
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)


def test_no_number_that_is_told_is_one_of_the_true_way_where_localisation_is_noisy() -> None:
    with asking("sample:noisy") as ask:
        told = [ask("api/v1/reset", {})]
        for action, arguments in DRIVEN:
            told.append(ask("api/v1/step", {"action": action, "arguments": arguments}))
        told += [ask("api/v1/session"), ask.event(), *(ask(path, {}) for path in V2)]
        answer = ask("api/v1/result", {"result": {"results": ask("api/v1/results_functions/create", {})["value"]}})
        told += [answer, ask("api/v1/session")]
        kept = json.loads(Path(answer["path"]).read_text("utf-8"))

    # Those that are round are told by chance.
    (track,) = kept["track"]
    way = [value for row in track["rows"] for value in row[2:] if value != round(value, 3)]
    true = [*way, track["path_length_m"], kept["provenance"]["simulated_time_s"], track["rows"][-1][1]]
    assert len(way) > 20
    for document in told:
        for number in numbers(document):
            assert not any(math.isclose(number, value, abs_tol=2e-6) for value in true), (number, document)
    assert "real_time_factor" not in answer["timings"]


def test_the_same_is_told_of_the_clock_where_true_poses_are() -> None:
    with asking("sample:active") as ask:
        ask("api/v1/reset", {})
        step = ask("api/v1/step", {"action": "move_distance", "arguments": {"distance": 0.5}})
        progress = ask("api/v1/session")["progress"]
    assert step["simulated_time_s"] == progress["simulated_time_s"] == progress["spent"]["simulated_time_s"] > 0


def test_another_attempt_has_the_noise_of_the_one_before() -> None:
    def attempt(ask: Asking) -> list[float]:
        ask("api/v1/reset", {})
        return [
            number
            for action, arguments in DRIVEN
            for number in numbers(
                ask("api/v1/step", {"action": action, "arguments": arguments})["observations"]["poses"]
            )
        ]

    with asking("sample:noisy") as ask:
        assert attempt(ask) == attempt(ask)


def test_a_collision_tells_that_there_was_one_and_not_what_was_hit_or_where() -> None:
    told = []
    for turn_deg, distance_m in ((0.0, 10.0), (90.0, 10.0), (200.0, 10.0)):
        with asking("sample:noisy") as ask:
            ask("api/v1/reset", {})
            ask("api/v1/step", {"action": "move_angle", "arguments": {"angle": turn_deg}})
            step = ask("api/v1/step", {"action": "move_distance", "arguments": {"distance": distance_m}})
            progress = ask("api/v1/session")["progress"]
            assert not any(character.isdigit() for character in str(progress["failure_why"]))
            told.append((step["outcome"], step["result"], progress["failure"], progress["failure_why"]))
    assert told == [("collided", "COLLISION", "collision", "The robot hit something during move_distance.")] * 3


def test_heads_of_answers_tell_the_date_the_type_and_the_length() -> None:
    with asking("sample:noisy") as ask:
        for path in ("api/v1/health", "api/v1/session", "nothing", "api/v1/watch", *V2):
            ask(path, {} if path in V2 else None)
        ask("api/v1/step", {"action": "fly"})
        ask("api/v1/reset", {})
        ask.event()
        names = {name for head in ask.heads for name in head}
    assert names == {"date", "content-type", "content-length", "cache-control", "transfer-encoding"}


def test_shared_memory_holds_what_was_told_and_zeros() -> None:
    """Nothing of other channels, of the platform, or of what was observed before."""
    places: list[tuple[int, int]] = []

    def fetch(dtype: str, shape: list[int], offset: int) -> Any:
        array = np.zeros(shape, dtype)
        places.append((offset, array.nbytes))
        return array

    with asking("sample:noisy") as ask:
        offered = ask("api/v1/reset", {}, arena="none")["arena"]
        step = {"action": "move_angle", "arguments": {"angle": 30.0}}
        ask("api/v1/step", step, arena=offered["nonce"], fetch=fetch)
        path = Path(f"/proc/{offered['pid']}/fd/{offered['descriptor']}")
        assert NAME in str(path.readlink())
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as memory:
            rest = bytearray(memory[:])
    rest[:24] = bytes(24)  # nonce and sequence number
    assert places
    assert min(offset for offset, _ in places) >= HEADER_BYTES
    for offset, size in places:
        rest[offset : offset + size] = bytes(size)
    assert not any(rest)


INHERITS = """
import json, os
files = {}
for name in os.listdir("/proc/self/fd"):
    try:
        files[name] = os.readlink("/proc/self/fd/" + name).partition(":")[0]
    except FileNotFoundError:
        pass  # the folder itself
told = {"files": files, "variables": sorted(os.environ), "parent": open(f"/proc/{os.getppid()}/cmdline").read()}
print(json.dumps(told))
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump({"results": {"class_list": ["background"], "objects": []}}, file)
"""
NEEDED = {"BENCHBOT_RESULT", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "HOME", "LOGNAME", "PATH", "PYTHONUNBUFFERED"}
ITS_OWN = {"TMPDIR", "USER", "LANG", "LANGUAGE", "TZ", "LC_CTYPE", "PYTHONHASHSEED", "PYTHONUTF8", "PWD", "SHLVL", "_"}


def test_a_sandboxed_solution_inherits_three_files_and_variables_that_say_where_it_is() -> None:
    # What a virtual environment imports by itself may set more; and pytest's own folders are closed to other users.
    command = [sys.executable, "-I", "-S", "solution.py"]
    with tempfile.TemporaryDirectory(prefix="benchbot-test-") as name, back_end() as backend:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "solution.py").write_text(INHERITS)
        ended, spectator = submit(SolutionSpec(command, folder, {}, 60, Sandbox()), backend)
        state = backend.state.folder
    assert ended.problem is None, spectator.text
    told = json.loads(spectator.text.splitlines()[-1])
    assert told["files"] == {"0": "/dev/null", "1": "pipe", "2": "pipe"}
    threads = {name for name in told["variables"] if name.endswith("_NUM_THREADS") or name.startswith("LC_")}
    assert NEEDED <= set(told["variables"]) <= NEEDED | ITS_OWN | threads
    assert state not in told["parent"]


def test_pictures_without_noise_are_the_same_in_the_same_place_whatever_the_seed() -> None:
    """Pictures without noise are those of the true pose: two that are equal were taken in the same place."""
    seen = []
    for seed in (1, 2):
        with asking("sample:active", seed=seed) as ask:
            seen.append(ask("api/v1/reset", {})["observations"]["image_rgb"])
    assert np.array_equal(*seen)
