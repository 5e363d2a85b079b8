"""Solutions that look around in their sandbox, or do what they may not; as source code."""

LOOKS_AROUND = """\
import ctypes, json, os, pwd, signal, socket, sys

def tried(call, *arguments):
    try:
        return repr(call(*arguments))
    except (OSError, ValueError) as error:
        return type(error).__name__

def kernel(number, *arguments):
    libc = ctypes.CDLL(None, use_errno=True)
    return [libc.syscall(number, *arguments), ctypes.get_errno()]

connection = socket.socket(socket.AF_UNIX)
connection.connect(os.environ["BENCHBOT_SOCKET"])
import benchbot.api, numpy
listening = socket.socketpair()
seen = {
    "user": os.getuid(),
    "variables": dict(os.environ),
    "processes": tried(lambda: sorted(int(name) for name in os.listdir("/proc") if name.isdigit())),
    "shadow": tried(open, "/etc/shadow"),
    "ground_truth": tried(os.listdir, TRUTH),
    "readable": tried(open, READABLE),
    "sockets": [tried(socket.socket, family) for family in (socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK)],
    "written": {
        path: tried(open, path, "w")
        for path in ("solution.py", "/usr/x", "/etc/x", "/dev/x", "/x", "/run/x", benchbot.__file__)
    },
    "temporary": tried(open, os.environ["TMPDIR"] + "/x", "w"),
    "outer": tried(os.kill, OUTER, 0),
    "namespace": kernel(272, 0x10000000),
    "parent": tried(open, f"/proc/{os.getppid()}/mem", "rb"),
    "capabilities": tried(lambda: [line.split()[1] for line in open("/proc/self/status") if line.startswith("Cap")]),
    "command_lines": tried(lambda: [open(f"/proc/{number}/cmdline").read() for number in (1, 2, 3)]),
    "raised": tried(__import__("resource").setrlimit, __import__("resource").RLIMIT_CORE, (1, 1)),
}
os.system("(setsid sleep 1000 &)")
with open(os.environ["BENCHBOT_RESULT"], "w") as file:
    json.dump(seen, file)
"""
"""Says what it sees and may; leaves a process behind. TRUTH, READABLE and OUTER are put in."""

EATS_MEMORY = "x = [bytearray(b'x' * 2**20) for _ in range(2000)]"
EATS_MEMORY_TOGETHER = """\
import subprocess, sys
eater = "x = bytearray(b'x' * 100 * 2**20); input()"
children = [subprocess.Popen([sys.executable, "-c", eater], stdin=subprocess.PIPE) for _ in range(8)]
for child in children:
    child.communicate(b"\\n")
raise SystemExit(any(child.returncode for child in children))
"""
"""Eight processes with 100 MiB each, all at the same time."""
FORKS = """\
import os, time
children = []
try:
    for _ in range(1000):
        child = os.fork()
        if child == 0:
            time.sleep(1000)
        children.append(child)
except OSError as error:
    raise SystemExit(f"{len(children)} children: {error}")
"""
BURNS = "while True: pass"
BURNS_TOGETHER = """\
import subprocess, sys
burner = "while True: pass"
children = [subprocess.Popen([sys.executable, "-c", burner]) for _ in range(4)]
for child in children:
    child.wait()
"""
WRITES_MUCH = "open('/tmp/x', 'wb').write(bytes(3 * 2**20))"
LINKS = "import os; os.symlink('/etc/hostname', os.environ['BENCHBOT_RESULT'])"
PIPES = "import os; os.mkfifo(os.environ['BENCHBOT_RESULT'])"
TOO_MUCH = "import os; open(os.environ['BENCHBOT_RESULT'], 'wb').truncate(2**26 + 1)"
KILLS_ALL = "import os; os.kill(-1, 9)"
ENDS_ITS_INIT_PROCESS = "import os, time; os.kill(os.getppid(), 9); time.sleep(1000)"
STOPS_ITS_LEADER = """\
import contextlib, os, signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
for _ in range(3):
    if os.fork() == 0:
        os.setsid()
for name in os.listdir("/proc"):
    if name.isdigit() and int(name) != os.getpid():
        with contextlib.suppress(PermissionError):
            os.kill(int(name), signal.SIGSTOP)
print("stopped", flush=True)
time.sleep(1000)
"""
