"""Restates v2's `hello_benchbot` where it drives into a wall: v2's client then cannot proceed, and exits with 1."""

from hello_benchbot import Line

from benchbot_api import BenchBot

if __name__ == "__main__":
    agent = Line()
    agent.left = [("move_distance", {"distance": 100.0})]
    BenchBot(agent=agent).run()
