"""The driver of a batch that nobody looks on at: `python -m benchbot.plugins.batch.detached FOLDER`.

It launches anew what is lost, and evaluates at the end. It needs no terminal, and nobody needs it: when it dies, the
workers go on, and the last of them evaluates. SIGTERM makes it let go of the batch, for a driver that takes its place.
"""

import signal
import subprocess
import sys
from pathlib import Path

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.plugin_manager import load
from benchbot.plugins.batch import driver, finalization, plan
from benchbot.plugins.batch.driver_lock import driving
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.worker_pool import Crew

NAME = "detached driver"


class LetGoError(Exception):
    """Somebody else drives the batch from here."""


def start(folder: Folder) -> None:
    """Start the driver in a session of its own; raises BenchbotError. What it says is in `driver.log`."""
    words = [sys.executable, "-P", "-m", "benchbot.plugins.batch.detached", str(folder.path)]
    try:
        with folder.driver_log.open("ab") as log:
            # It is nobody's child any more when this process has ended.
            subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
    except OSError as error:
        raise BenchbotError(
            "The batch's driver cannot be started; its workers run.",
            f"{error.filename}: {error.strerror}.",
            f"Free some disk space or memory, then: benchbot batch attach --detach {folder.path}",
            exit_code=ExitCode.INTERNAL,
        ) from error


def main() -> int:
    """Drive the batch to its end; return the exit code."""
    folder = Folder(Path(sys.argv[1]))
    told: list[int] = []

    def note(number: int, _frame: object) -> None:
        told.append(number)

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, note)

    def look(*_: object) -> None:
        if told:
            raise LetGoError

    try:
        with driving(folder, detached=True):
            planned = plan.read(folder.plan)
            catalog = Catalog(load())

            def conclude() -> None:
                finalization.conclude(folder, planned, catalog, NAME, patient=True)

            driver.drive(folder, Crew.read(folder), look, conclude)
    except LetGoError:
        return ExitCode.INTERRUPTED
    except (BenchbotError, OSError) as error:
        print(error, file=sys.stderr)
        return ExitCode.INTERNAL
    return ExitCode.OK


if __name__ == "__main__":
    sys.exit(main())
