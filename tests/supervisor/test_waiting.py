"""A supervisor that waits for its next run hears signals, whenever they come."""

import subprocess
import sys

# Thousands of signals, many of them as a timeout ends.
SCRIPT = """
import signal, threading
from types import SimpleNamespace
from benchbot.supervisor import serve
from benchbot.supervisor.__main__ import Parent

serve.SIGNAL_PERIOD_S = 0.0004
signal.signal(signal.SIGALRM, lambda *_: None)
signal.setitimer(signal.ITIMER_REAL, 0.0003, 0.0003)
run = SimpleNamespace(stop_asked=threading.Event())
threading.Timer(3.0, run.stop_asked.set).start()
assert serve._wait(run, SimpleNamespace(check=lambda: None), [], Parent(None).plans, None, 1.0) is None
signal.setitimer(signal.ITIMER_REAL, 0)
print("ended")
"""


def test_a_signal_as_a_timeout_ends_does_not_stop_the_waiting() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.returncode) == ("ended\n", 0), done.stderr
