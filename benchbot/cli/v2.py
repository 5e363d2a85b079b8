"""The commands of BenchBot v2, `benchbot_run`, `_submit`, `_batch` and `_eval`, with their own spellings."""

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


def batch() -> NoReturn:
    """Be `benchbot_batch`: it leaves `batch_0.json` and so on in the working folder, or with another `--prefix`."""
    words = sys.argv[1:]
    if not any(
        word in ("-p", "--prefix", "-h", "--help", "-v", "--version") or word.startswith("--prefix=") for word in words
    ):
        sys.argv[1:] = [*words, "--prefix", "batch"]
    _be("batch")


def _be(command: str) -> NoReturn:
    if {"-v", "--version"} & set(sys.argv[1:2]):
        main(["--version"])
    main([command, *sys.argv[1:]])
