"""The commands of BenchBot v2: `benchbot_install`, `_run`, `_submit`, `_batch`, `_eval`, with their own spellings."""

import sys
from typing import NoReturn

from benchbot.cli.app import main
from benchbot.cli.kit import console
from benchbot.core.errors import ExitCode

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

_NO_IMAGES = "There are no images and no clones to keep in step: versions are those that pip has installed."
_SIMULATORS = "A simulator is a plug-in: pip install 'benchbot[full]' brings the ray-traced one."
_UNINSTALLING = "Nothing is installed outside the Python environment: pip uninstall benchbot"
_DROPPED = {
    **dict.fromkeys(("-b", "--branch", "-f", "--force-clean", "--no-update"), _NO_IMAGES),
    **dict.fromkeys(("-s", "--simulators", "--no-simulator"), _SIMULATORS),
    **dict.fromkeys(("-u", "--uninstall"), _UNINSTALLING),
}
"""Options of `benchbot_install` that are gone, and what takes their place."""


def install() -> NoReturn:
    """Run `benchbot_install`: it lists, installs or removes, as its first known option says."""
    words = [part for word in sys.argv[1:] for part in (word.split("=", 1) if word.startswith("--") else [word])]
    dropped = [word for word in words if word in _DROPPED]
    if dropped:
        console.note(*(f"{word} is gone. {_DROPPED[word]}" for word in dropped))
    for position, word in enumerate(words):
        if word in _INSTALLING:
            names = words[position + 1 : position + 2] if not word.startswith("--list") else []
            main([*_INSTALLING[word], *(name for given in names for name in given.split(","))])
    if dropped:
        sys.exit(ExitCode.USAGE)
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
