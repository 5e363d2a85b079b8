"""The program `benchbot`, and `python -m benchbot`."""

import gc
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit; a robot that is to be stopped does not wait for all commands to be imported."""
    if sys.argv[1:2] == ["stop"]:
        from benchbot import emergency_stop

        if emergency_stop.understands(sys.argv[2:]):
            sys.exit(emergency_stop.stop_as_told(sys.argv[2:], "benchbot stop"))
    # Few objects die young while a command line starts: looking for them less often makes every command start faster.
    gc.set_threshold(50_000, 20, 20)
    try:
        from benchbot.cli import app

        app.main()
    except KeyboardInterrupt:  # while it imports, which the command line itself does not see
        sys.exit(130)


if __name__ == "__main__":
    main()
