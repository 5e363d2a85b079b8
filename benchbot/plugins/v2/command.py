"""The commands of BenchBot v2: `benchbot_install`, `_run`, `_submit`, `_batch`, `_eval`, with their own spellings."""

import sys
from typing import NoReturn

from benchbot.cli.app import main

_INSTALLING = {
    "--list-addons": ("plugins", "list"),
    "--list-simulators": ("list", "simulators"),
    "--remove-addons": ("uninstall",),
    "--addons-only": ("install",),
    "-A": ("install",),
    "--addons": ("install",),
    "-a": ("install",),
}
"""Options of `benchbot_install` to commands; the word after an option is a list with commas."""


def install() -> NoReturn:
    """Run `benchbot_install`: it lists, installs or removes, as its first known option says."""
    words = [part for word in sys.argv[1:] for part in (word.split("=", 1) if word.startswith("--") else [word])]
    for position, word in enumerate(words):
        if word in _INSTALLING:
            names = words[position + 1 : position + 2] if not word.startswith("--list") else []
            main([*_INSTALLING[word], *(name for given in names for name in given.split(","))])
    _run_as("install")


def run() -> NoReturn:
    """Run `benchbot_run`: `--kill-controller` ends a running back end."""
    if {"-k", "--kill-controller"} & set(sys.argv[1:]):
        main(["stop"])
    _run_as("run")


def submit() -> NoReturn:
    """Run `benchbot_submit`."""
    _run_as("submit")


def evaluate() -> NoReturn:
    """Run `benchbot_eval`."""
    _run_as("eval")


def batch() -> NoReturn:
    """Run `benchbot_batch`: it leaves `batch_0.json` and so on in the working folder, or with another `--prefix`."""
    words = sys.argv[1:]
    if not any(
        word in ("-p", "--prefix", "-h", "--help", "-v", "--version") or word.startswith("--prefix=") for word in words
    ):
        sys.argv[1:] = [*words, "--prefix", "batch"]
    _run_as("batch")


def _run_as(command: str) -> NoReturn:
    if {"-v", "--version"} & set(sys.argv[1:2]):
        main(["--version"])
    main([command, *sys.argv[1:]])
