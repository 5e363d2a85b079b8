"""Restates v2's example of that name: a person drives, and ends it by Ctrl-C, upon which it exits with 0."""

import os
import signal
import sys

from benchbot_api import ActionResult, Agent, BenchBot

TYPED = ["d 0.1", "a 5", "^C"]


class Interactive(Agent):
    def __init__(self):
        signal.signal(signal.SIGINT, lambda number, frame: sys.exit(0))

    def is_done(self, action_result):
        return action_result != ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        typed = TYPED.pop(0)
        if typed == "^C":
            os.kill(os.getpid(), signal.SIGINT)
        name, _, number = typed.partition(" ")
        return (
            ("move_angle", {"angle": float(number)}) if name == "a" else ("move_distance", {"distance": float(number)})
        )

    def save_result(self, filename, empty_results, results_format_fns):
        return


if __name__ == "__main__":
    BenchBot(agent=Interactive()).run()
