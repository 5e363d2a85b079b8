"""The program `benchbot`, and `python -m benchbot`."""

import gc
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and exit."""
    # Few objects die young while a command line starts: looking for them less often makes every command start faster.
    gc.set_threshold(50_000, 20, 20)
    from benchbot.cli import app

    app.main()


if __name__ == "__main__":
    main()
