"""A worker of the queue: computes claimed submissions as batches, scores them, and signs what came of it.

A submission is computed in a folder of its own by `benchbot batch`, which resumes: what a worker that died has computed
counts, once. Whether an attempt still counts is the queue's to say (benchbot.plugins.challenge.queue).
"""

import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import yaml
from sqlalchemy.exc import DBAPIError

import benchbot
from benchbot.core import results
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.batch import driver_lock
from benchbot.plugins.challenge import intake, pictures, queue, signing
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import FILE, RUNS_SECRET, Challenge, Phase
from benchbot.plugins.challenge.queue import LEASE_S, Claim
from benchbot.plugins.challenge.submissions import submission
from benchbot.plugins.containers import transfer
from benchbot.process import LastWords, how_it_ended
from benchbot.submission.solution import python_first

BATCH = (sys.executable, "-P", "-m", "benchbot", "batch")
POLL_S = 1.0
RETRY_S = 2.0
HAND_OVER_S = 60.0
SCORED_CODES = (ExitCode.OK, ExitCode.SUBMISSION_FAILED, ExitCode.BELOW_THRESHOLD)
CANNOT_START = "It cannot be started: its program, its modules or its Dockerfile are not as they must be."
KEPT = (
    *("source", "environment", "seed", "episode", "repeat", "settings", "failure", "why", "scores", "ground_truths"),
    "provenance",
)


@dataclass(frozen=True)
class Worker:
    """One worker: the challenge, its database and key, its name in the log, and when it is to end."""

    challenge: Challenge
    database: Database
    key: signing.Key
    name: str
    ended: Callable[[], bool]

    def run(self, *, until_empty: bool = False) -> None:
        """Compute one submission after the other; a database that is away for a while is waited for."""
        _remove_unused_images()
        while not self.ended():
            try:
                claim = queue.claim(self.database, self.name)
            except DBAPIError:
                time.sleep(RETRY_S)
                continue
            if claim is not None:
                self._compute(claim)
                _remove_unused_images()
            elif until_empty:
                return
            else:
                time.sleep(POLL_S)

    def _compute(self, claim: Claim) -> None:
        folder = self.challenge.work / claim.submission
        phase = self.challenge.phases.get(claim.phase)
        if phase is None:
            self._settle(lambda: queue.fail(self.database, claim, "Its phase is gone.", "Its phase is gone."))
            return
        try:
            solution = self._unpacked(claim, folder)
            words_of_batch = _batch_file(self.challenge, phase, solution, folder)
            with nullcontext() if solution.image is None else transfer.in_use(folder / "solution") as lock:
                code, words = self._run_batch(claim, folder, words_of_batch, () if lock is None else (lock,))
        except BenchbotError as error:
            why = f"{error.title} {error.why}"
            self._settle(lambda: queue.fail(self.database, claim, why))
            return
        except OSError as error:
            why = f"The machine: {error.strerror}"
            self._settle(lambda: queue.fail(self.database, claim, why))
            return
        is_scored = (folder / "batch" / "scores.json").is_file()
        # The phase itself was proven when the server began. An image that cannot be built is the team's.
        if code == ExitCode.USAGE or (code == ExitCode.SUBMISSION_FAILED and not is_scored):
            told = CANNOT_START if phase.hidden else f"It cannot be started. {words}"
            self._settle(lambda: queue.fail(self.database, claim, words, told))
        elif code is None:  # the lease was lost, or this worker is to end
            self._settle(lambda: queue.give_back(self.database, claim))
        elif code not in SCORED_CODES or not is_scored:
            self._settle(lambda: queue.fail(self.database, claim, f"The batch {how_it_ended(code)}. {words}"))
        else:
            try:
                self._finish(claim, phase, folder, solution.image)
            except OSError as error:
                why = f"The machine: {error.strerror}"
                self._settle(lambda: queue.fail(self.database, claim, why))

    def _finish(self, claim: Claim, phase: Phase, folder: Path, image: str | None) -> None:
        read = results.read_scores(folder / "batch" / "scores.json")
        document = scored(read) | {"pictures": pictures.make(self.challenge, phase, folder / "batch", read)}
        headline = document["method"]["headline"]
        score = float(document["scores"][headline])
        found = submission(self.database, claim.submission)
        statement = {
            **signing.about(self.challenge.name, phase.name, found.team_name, image),
            "submission": claim.submission,
            "statement": found.statement,
            "score": score,
            "interval": document["intervals"].get(headline),
            "method": {key: document["method"][key] for key in ("name", "version", "headline")},
            "episodes": {key: document["coverage"][key] for key in ("expected", "scored")},
            "software": software(folder / "batch" / "results"),
            "commitments": self.challenge.commitments() if phase.hidden else {},
            "attempt": claim.attempt,
            "pictures": [item["file"] for item in document["pictures"]],
            "scored_at": int(phase.told_at(self.database.clock())),  # to the second it would tell how long it ran
        }
        envelope = self.key.sign(signing.SCORE, claim.sha256, statement)
        self._settle(lambda: queue.finish(self.database, claim, score, document, envelope))

    def _unpacked(self, claim: Claim, folder: Path) -> intake.Solution:
        """Return how the solution runs, its files in `solution`; from the upload, whose digest must be what it was."""
        upload = self.challenge.uploads / f"{claim.submission}.zip"
        if not upload.is_file() or intake.sha256_of(upload) != claim.sha256:
            raise BenchbotError("The upload is gone, or another file.", str(upload), "Bring it back from the backup.")
        shutil.rmtree(folder / "solution", ignore_errors=True)
        return intake.unpack(upload, folder / "solution")

    def _run_batch(
        self, claim: Claim, folder: Path, command: list[str], locks: tuple[int, ...]
    ) -> tuple[int | None, str]:
        """Run a batch while the claim has its lease; return its exit code (None: not finished), and its last words.

        It inherits `locks`, since it may outlive this worker.
        """
        _end_orphan(folder / "batch")
        with (folder / "batch.log").open("ab") as log:
            start = log.tell()
            process = subprocess.Popen(
                [*BATCH, *command],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=folder / "solution",
                env={**os.environ, **python_first()},
                start_new_session=True,
                pass_fds=locks,
            )
            extended = time.monotonic()
            while process.poll() is None:
                time.sleep(0.2)
                if self.ended():
                    _end(process)
                    return None, ""
                if time.monotonic() - extended > LEASE_S / 4:
                    with suppress(DBAPIError):  # away for a while: whether the lease holds is told when it is back
                        if not queue.extend(self.database, claim):
                            _end(process)
                            return None, ""
                        extended = time.monotonic()
        with (folder / "batch.log").open("rb") as log:
            return process.returncode, _last_words(log, start)

    def _settle(self, write: Callable[[], bool]) -> None:
        """Write the end of an attempt; while the database is away, again and again, for it must not be lost."""
        while True:
            try:
                write()
            except DBAPIError:
                if self.ended():
                    return
                time.sleep(RETRY_S)
            else:
                return


def _remove_unused_images() -> None:
    """Remove the images that were handed in and have been computed; without an engine they wait for the next time."""
    with suppress(BenchbotError):
        transfer.remove_unused()


def prove(challenge: Challenge, phase: Phase) -> dict[str, str]:
    """Prove that a phase can be computed here, by solutions that do nothing; return which modes cannot be, and why.

    Raises BenchbotError when none can be, or one that the phase names. What a batch refuses from then on is the fault
    of the submission that is in it.
    """
    lacking = {mode: why for mode in phase.modes if (why := _refused(challenge, phase, mode)) is not None}
    if lacking and (phase.modes_are_named or len(lacking) == len(phase.modes)):
        raise BenchbotError(
            f"Phase '{phase.name}' of {challenge.title} cannot be computed here.",
            next(iter(lacking.values())),
            f"Mend its batch or its modes in {challenge.folder / FILE}, or this machine: benchbot doctor",
        )
    return lacking


def _refused(challenge: Challenge, phase: Phase, mode: str) -> str | None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "solution").mkdir()
        (folder / "solution" / "solution.py").write_text("", "utf-8")
        (folder / "solution" / "Dockerfile").write_text("FROM scratch\n", "utf-8")
        solution = intake.Solution(("python", "solution.py") if mode == intake.SANDBOX else (), mode)
        words = [*BATCH, *_batch_file(challenge, phase, solution, folder), "--dry-run"]
        tried = subprocess.run(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=folder / "solution",
            env={**os.environ, **python_first()},
            check=False,
        )
    if tried.returncode == ExitCode.OK:
        return None
    said = LastWords()
    said.add(tried.stdout)
    return str(said).rpartition("Error: ")[2]  # before it comes what else was looked at


def name_of(process: int) -> str:
    """Return the name of the worker that is a process of this machine."""
    return f"worker {socket.gethostname()}:{process}"


def scored(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scores document without what would tell of the machine: no path, no provenance."""
    coverage = document["coverage"]
    return {
        **{key: document[key] for key in ("version", "method", "scores")},
        "intervals": document.get("intervals") or {},
        "task_details": {"name": document["task_details"]["name"]},
        "environment_details": [],
        "rows": [_kept(row) for row in document["rows"]],
        "coverage": {**coverage, "missing": [_kept(row) for row in coverage["missing"]], "skipped": []},
    }


def _kept(row: Mapping[str, Any]) -> dict[str, Any]:
    return {key: None if key in ("source", "provenance") else value for key, value in row.items() if key in KEPT}


def software(folder: Path) -> dict[str, str]:
    """Return the versions of all distributions that results say they ran on, by name."""
    found = {"benchbot": benchbot.__version__}
    for path in sorted(folder.rglob("*.json")):
        plugins = (results.read(path).get("provenance") or {}).get("plugins") or {}
        found |= {name: f"{used['version']} sha256:{used['sha256']}" for name, used in plugins.items()}
    return dict(sorted(found.items()))


def _batch_file(challenge: Challenge, phase: Phase, solution: intake.Solution, folder: Path) -> list[str]:
    """Write the batch of a submission, and return the words that compute it."""
    wanted: dict[str, Any] = {"name": challenge.name, **_plain(phase.batch)}
    if solution.mode == intake.CONTAINER:
        wanted |= {"containerised": str(folder / "solution"), "args": shlex.join(solution.command)}
    else:
        wanted["sandbox"] = shlex.join(solution.command)
    if phase.hidden:
        wanted["secret"] = str(challenge.folder / RUNS_SECRET)
    (folder / "batch.yaml").write_text(yaml.safe_dump(wanted, sort_keys=False), "utf-8")
    addons = [word for name in phase.addons for word in ("--addons", str(challenge.folder / name))]
    paths = [str(folder / "batch.yaml"), "--output-location", str(folder / "batch")]
    return [*paths, "--display", "plain", *addons]


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


def _end_orphan(folder: Path) -> None:
    """End the driver of a batch whose worker has died, and wait for it: it would drive the same folder."""
    entry = driver_lock.registered(folder)
    if entry is None or not entry.is_driven or entry.driver is None:
        return
    entry.driver.signal_group(signal.SIGINT)
    deadline = time.monotonic() + HAND_OVER_S
    while not entry.driver.is_dead and time.monotonic() < deadline:
        time.sleep(0.1)


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a batch in order; its workers end with it."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(HAND_OVER_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _last_words(log: IO[bytes], start: int) -> str:
    log.seek(start)
    words = LastWords()
    while chunk := log.read(2**16):
        words.add(chunk)
    return str(words)
