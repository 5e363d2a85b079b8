"""The commands of BenchBot v2: `benchbot_run`, `benchbot_submit` and `benchbot_eval`, with their own spellings."""

import sys
from typing import NoReturn

from benchbot.cli.app import main


def run() -> NoReturn:
    """Be `benchbot_run`: `--kill-controller` ends a running back end."""
    if {"-k", "--kill-controller"} & set(sys.argv[1:]):
        main(["stop"])
    _be("run")


def submit() -> NoReturn:
    """Be `benchbot_submit`."""
    _be("submit")


def evaluate() -> NoReturn:
    """Be `benchbot_eval`."""
    _be("eval")


def _be(command: str) -> NoReturn:
    if {"-v", "--version"} & set(sys.argv[1:2]):
        main(["--version"])
    main([command, *sys.argv[1:]])
