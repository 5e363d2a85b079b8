"""`python -m tools.bear all|NAME:VARIANT… [--folder DIR]`: write environments' files."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import benchbot_envs_bear


def main() -> int:
    """Generate the named environments, or all of them, by default into the package itself."""
    try:
        from tools.bear.places import generate, names
    except ModuleNotFoundError as error:
        sys.stderr.write(
            f"Environments cannot be generated here: the library {error.name} is not installed.\n"
            'Install what generating needs: pip install "benchbot-envs-bear[generate]"\n'
        )
        return 2
    parser = argparse.ArgumentParser(prog="python -m tools.bear", description=main.__doc__)
    parser.add_argument("environment", nargs="+", choices=["all", *names()], metavar="NAME:VARIANT")
    parser.add_argument("--folder", type=Path, default=Path(benchbot_envs_bear.__file__).parent)
    arguments = parser.parse_args()
    wanted = names() if "all" in arguments.environment else arguments.environment
    for environment in wanted:
        sys.stderr.write(generate(environment, arguments.folder) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
