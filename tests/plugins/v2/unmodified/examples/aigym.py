"""Restates v2's examples `aigym_…`: a loop of its own, without an agent, that fails on an action it may not take."""

from benchbot_api import BenchBot

if __name__ == "__main__":
    benchbot = BenchBot()
    benchbot.reset()
    benchbot.step("fly")
