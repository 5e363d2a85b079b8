"""Solutions that the tests submit, as source code."""

PASSIVE = """\
import json, sys, time
from benchbot.api import ActionResult, Agent, BenchBot

class Passive(Agent):
    def is_done(self, action_result):
        return action_result is not ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        time.sleep(float(sys.argv[1]) if len(sys.argv) > 1 else 0)
        return "move_next", {}

    def save_result(self, filename, empty_results, results_format_fns):
        with open(filename, "w") as file:
            json.dump(empty_results, file)

BenchBot(Passive()).run()
"""
"""Follows the trajectory; thinks for as many seconds as its argument says before every action."""

CRASHING = """\
from benchbot.api import BenchBot
BenchBot().step("move_next")
raise RuntimeError("no idea what a chair is")
"""

RECKLESS = """\
import json
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.step("move_distance", distance=20)
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""

HANGING = """\
import subprocess, sys, signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print("hanging", flush=True)
time.sleep(600)
"""
"""Ignores every polite signal and has a child that hangs, too."""

WORDS = """\
import json, os, sys
print("words:", json.dumps(sys.argv[1:]), flush=True)
open(os.environ["BENCHBOT_RESULT"], "w").write(json.dumps({"results": {"objects": [], "class_list": ["background"]}}))
"""

WRITES = """\
import os
open(os.environ["BENCHBOT_RESULT"], "w").write({text!r})
"""

WRITES_LATE = """\
import json, os, time
print("thinking", flush=True)
time.sleep(2)
open(os.environ["BENCHBOT_RESULT"], "w").write(json.dumps({"results": {"objects": [], "class_list": ["background"]}}))
"""

RESETTING = """\
import json, sys
from benchbot.api import BenchBot
benchbot = BenchBot()
def attempt(ask):
    try:
        ask()
    except Exception as error:
        print("refused:", error, flush=True)
for number in range(6):
    for _ in range(4):
        attempt(lambda: benchbot.step("move_distance", distance=float(sys.argv[1])))
    if "hand-in" in sys.argv:
        attempt(lambda: benchbot._running().result({"results": {"objects": [], "class_list": ["background"]}}))
    attempt(benchbot.reset)
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
"""Takes four steps six times, each time from the start; with `hand-in`, it hands in a result before each reset."""
