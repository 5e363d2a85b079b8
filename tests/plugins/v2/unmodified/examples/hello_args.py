"""Restates v2's example of that name: it prints its arguments, connects, and ends."""

import sys

from benchbot_api import BenchBot

if __name__ == "__main__":
    print(f"the arguments: {sys.argv}")
    BenchBot()
