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
"""Options of `benchbot_install` to the command that does it; what follows an option is a list with commas."""


def install() -> NoReturn:
    """Be `benchbot_install`: it lists, installs or removes, whichever its first known option asks for."""
    words = [part for word in sys.argv[1:] for part in (word.split("=", 1) if word.startswith("--") else [word])]
    for position, word in enumerate(words):
        if word in _INSTALLING:
            names = words[position + 1 : position + 2] if not word.startswith("--list") else []
            main([*_INSTALLING[word], *(name for given in names for name in given.split(","))])
    _be("install")


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
